"""Bring an effect to a requested size: its residual over the noise-only residual, in the balance that shows it most."""

import numpy as np

from generator import layout as at
from generator.balances import BREAKING_AWAY, root_mean_square
from generator.recipes import PARAMETER_LIKE, RECIPES
from generator.rig import no_effects

BANDS = {"weak": (1.2, 2.0), "medium": (2.0, 5.0), "strong": (5.0, 40.0)}
_STRONG_BEYOND_TOLERANCE = (12.0, 80.0)
_TRIALS = 12
_OWN_PLACE = {"end_stop_compliance": "torque_at_stops", "stiction_dwell": BREAKING_AWAY}


class OutOfReachError(Exception):
    """No strength within what physics allows brings this draw to the requested size."""


def band(name, level):
    """Allowed ratio of residual to noise-only residual."""
    if level == "strong" and name in PARAMETER_LIKE:
        return _STRONG_BEYOND_TOLERANCE
    return BANDS[level]


def ratios(name, residuals, floors):
    """Residual over noise-only residual by balance; two parts of the torque count only for what sits there alone."""
    counted = {"torque", "voltage", "angle", _OWN_PLACE.get(name)}
    shown = [channel for channel in floors if floors[channel] > 0.0 and channel in counted]
    return {channel: root_mean_square(residuals[channel]) / floors[channel] for channel in shown}


def bring_to_size(rig, name, level, rng, floors, form=None):
    """Draw the effect's shape (of a `form` where one is asked for) and find its strength; return row and ratios."""
    recipe = RECIPES[name]
    low, high = band(name, level)
    goal = float(np.exp(rng.uniform(np.log(low * 1.06), np.log(high / 1.06))))
    shape = recipe.draw(name, rng, rig.unit)
    if form is not None:
        shape[at.FORM] = form

    def reached(strength):
        effects = no_effects()
        row = shape.copy()
        row[at.STRENGTH] *= strength
        effects[at.ROW[name]] = row
        return row, ratios(name, rig.residuals(effects), floors)

    return find_strength(reached, recipe.start, recipe.most, goal, (low, high))


def find_strength(reached, start, most, goal, allowed):
    """Bracketed search for the strength at which the largest ratio meets its goal.

    `reached(strength)` returns (anything, ratios). Squares of residuals add, which gives the next guess; the bracket
    bisects where that guess leaves it. OutOfReachError where `most` is not enough.
    """
    below, above, strength = 0.0, most, start
    for _ in range(_TRIALS):
        found, by_channel = reached(strength)
        ratio = max(by_channel.values())
        if allowed[0] < ratio < allowed[1] and abs(np.log(ratio / goal)) < 0.15:
            return found, by_channel
        if ratio < goal:
            below = strength
            if strength >= most:
                if ratio > allowed[0]:
                    return found, by_channel
                break
        else:
            above = strength
        grown = np.sqrt((goal**2 - 1.0) / max(ratio**2 - 1.0, 0.02))
        strength = min(most, strength * grown)
        if not below < strength < above and not (strength == most == above):
            strength = 0.5 * (below + above)
    raise OutOfReachError
