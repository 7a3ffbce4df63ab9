"""Cases: a measured table and a nominal model for the tool, the truth sealed beside them."""

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from generator import layout as at
from generator.own_clock import beside_the_ticks
from generator.recipes import PARAMETER_LIKE, RECIPES, look_alike
from generator.rig import Rig, no_effects, set_up
from generator.rough_bench import as_logged, rough
from generator.sensors import Sensors
from generator.size import OutOfReachError, bring_to_size, ratios
from generator.wrong_parameter import PARAMETERS, misjudge

# By view, what is not measured, and the counts of an encoder that has fewer than the rig's.
MISSING = {"plate_only": "motor_angle", "no_current": "motor_current", "encoder_only": "throttle_angle"}
COUNTS = {"coarse_encoder": 64, "fair_encoder": 1024, "encoder_only": 256}
ROUGH = "rough_bench"  # everything is measured, badly
OWN_CLOCK = "own_clock"  # between the controller's ticks
VIEWS = ("full", ROUGH, OWN_CLOCK, *sorted({*MISSING, *COUNTS}))
_DRAWS = 12


@dataclass
class Case:
    """What the tool may see (`table`, `nominal`, `sensors`, `about`) and what it may not (`truth`, `rig`)."""

    table: dict
    nominal: dict
    sensors: Sensors
    about: dict
    truth: dict
    rig: Rig
    effects: np.ndarray


def make_case(seed, effects=(), level="strong", *, excitation="rich", seconds=40.0, rate=2000, view="full", form=None):
    """Hide `effects` in a record of a unit drawn from `seed`.

    `effects`: none (nothing hidden, nominal up to 10 % off all the same), one to three ids of the catalogue or from
    outside it, one `parameter:<name>`, or several that are off by one factor. `rate` in Hz; `view`: what of the sensors
    the tool gets; `form`: the variant of the effects' curve, drawn where it is none. A draw that cannot reach its size
    is replaced by the next draw of the same seed; OutOfReachError after some of those.
    """
    if view not in VIEWS:
        raise ValueError(f"view is one of {VIEWS}")
    for attempt in range(_DRAWS):
        try:
            return _drawn(seed * _DRAWS + attempt, seed, tuple(effects), level, excitation, seconds, rate, view, form)
        except OutOfReachError:
            continue
    raise OutOfReachError(f"{effects} cannot be made {level} with the excitation {excitation}")


def together(seed, count):
    """Draw effects of the catalogue that data can distinguish from each other and from base parameters."""
    rng = np.random.default_rng([seed, 2])
    alone = [name for name in at.CATALOGUE if name not in PARAMETER_LIKE]
    while True:
        drawn = rng.choice(alone, count, replace=False)
        if not any(look_alike(first, second) for first, second in combinations(drawn, 2)):
            return tuple(str(one) for one in drawn)


def _drawn(number, seed, names, level, excitation, seconds, rate, view, form):
    rig = set_up(number, excitation, seconds, rate, _with_visible_peak if "stribeck_shape" in names else None)
    rng = np.random.default_rng([number, 3])
    floors = rig.floors()
    effects = no_effects()
    hidden = []
    wrong = [name.removeprefix("parameter:") for name in names if name.startswith("parameter:")]
    if wrong:
        amount, sizes = misjudge(rig, wrong[0], level, rng, floors, wrong[1:])
        of_all = {"strength": amount, "unit": "nominal over truth", "level": level, "ratios": sizes}
        hidden += [{"effect": f"parameter:{name}", **of_all} for name in wrong]
    for name in (name for name in names if name in at.ROW):
        row, sizes = bring_to_size(rig, name, level, rng, floors, form)
        effects[at.ROW[name]] = row
        hidden.append(_entry(name, row, level, sizes))
    residuals = rig.residuals(effects)
    sensors = replace(rig.sensors, motor_counts=COUNTS.get(view, rig.sensors.motor_counts))
    table = _table(rig, effects, sensors, view, seed)
    if view in MISSING:
        del table[MISSING[view]]
    about = {
        "excitation": excitation,
        "seconds": seconds,
        "rate_hz": rate,
        "view": view,
        "columns": list(table),
        "voltage": "as commanded, held from its row to the next; at the terminals while the bridge is off",
    }
    truth = {
        "kind": _kind(names),
        "seed": seed,
        "effects": hidden,
        "unit": rig.unit,
        "floors": floors,
        "ratios_together": ratios(names[0] if len(names) == 1 else "", residuals, floors),
    }
    return Case(table, rig.nominal, sensors, about, truth, rig, effects)


def _table(rig, effects, sensors, view, seed):
    if view == ROUGH:
        return as_logged(rig.record(effects, rough(sensors)), seed)
    if view == OWN_CLOCK:
        return beside_the_ticks(rig, effects, sensors)
    return rig.record(effects, sensors)


def _entry(name, row, level, sizes):
    return {
        "effect": name,
        "strength": float(row[at.STRENGTH]),
        "unit": RECIPES[name].unit,
        "form": int(row[at.FORM]),
        "shape": [float(value) for value in row[at.A :]],
        "level": level,
        "ratios": sizes,
    }


def _kind(names):
    if not names:
        return "nothing"
    if len(names) > 1:
        return "several"
    return "outside" if names[0] in at.OUTSIDE else "single"


def _with_visible_peak(unit, rng):
    """The shape of a Stribeck peak can be known only of a unit that has one."""
    still_returns = min(unit["preload_open"], unit["preload_close"]) - 0.05
    return {**unit, "stiction": min(still_returns, unit["coulomb"] * float(rng.uniform(1.3, 1.6)))}


SINGLES = at.CATALOGUE + tuple(f"parameter:{name}" for name in PARAMETERS)
