"""A nominal value outside its stated tolerance, and nothing else wrong."""

import numpy as np

from generator.balances import balances
from generator.rig import no_effects
from generator.size import BANDS, OutOfReachError, find_strength, ratios
from generator.unit import STATED_TOLERANCE, vector

# Parameters of the model file whose error shows in a balance by itself.
PARAMETERS = (
    "resistance",
    "motor_constant",
    "motor_inertia",
    "preload_open",
    "preload_close",
    "slope_open",
    "coulomb",
    "viscous",
    "bristle_stiffness",
)
# A throttle that sticks: what raises one of its frictions raises the other.
FRICTION = ("parameter:coulomb", "parameter:stiction")
_MOST = np.log(4.0)
_CLEARLY_OUTSIDE = np.log(1.05)  # strong cases: nobody need argue over a slack of the tolerance


def nominal_over_truth(sign):
    """Nominal over truth at the near edge of a tolerance, which is stated as a share of the nominal value."""
    return 1.0 / (1.0 - sign * STATED_TOLERANCE)


def misjudge(rig, name, level, rng, floors, also=()):
    """Put the nominal value so far off that its tolerance's near edge still leaves the requested residual.

    Changes `rig.nominal`; returns nominal over truth and the ratios at the edge of the tolerance. `also`: parameters
    that are off by the same factor.
    """
    names = (name, *also)
    table = rig.record(no_effects())
    sign = rng.choice([-1.0, 1.0])
    low, high = BANDS[level]
    goal = float(np.exp(rng.uniform(np.log(low * 1.06), np.log(high / 1.06))))

    def reached(excess):
        wrong = {**rig.unit, **{each: rig.unit[each] * float(np.exp(sign * excess)) for each in names}}
        return excess, ratios(f"parameter:{name}", balances(table, vector(wrong), rig.rate), floors)

    excess, sizes = find_strength(reached, 0.05, _MOST, goal, (low, high))
    if level == "strong" and excess < _CLEARLY_OUTSIDE:
        excess, sizes = reached(_CLEARLY_OUTSIDE)
    factor = nominal_over_truth(sign) * float(np.exp(sign * excess))
    for each in names:
        rig.nominal[each] = rig.unit[each] * factor
    if rig.nominal["coulomb"] > rig.nominal["stiction"]:
        raise OutOfReachError(f"{name} off by {factor:.2f} is no model: sliding friction above break-away friction")
    return factor, sizes
