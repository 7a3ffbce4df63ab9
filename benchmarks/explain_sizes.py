"""Whether 95 % intervals hold the truth: effects' sizes where the generator means the same number, and the base."""

import math

from etb_hil.discrepancy.intervals import estimates
from etb_hil.plant.effects.catalogue import CATALOGUE

# effect -> (our parameters, forms of the generator for which they are its strength); two parameters are an amplitude.
COMPARABLE = {
    "current_sensor_gain": (("gain_error",), (0,)),
    "current_sensor_offset": (("offset",), (0, 1)),
    "angle_sensor_eccentricity": (("sine", "cosine"), (0,)),
    "cogging_torque": (("sine", "cosine"), (0,)),
    "torque_ripple": (("sine", "cosine"), (0,)),
    "gear_backlash": (("play",), (0,)),
    "shaft_compliance": (("compliance",), (0,)),
    "friction_load": (("coefficient",), (0,)),
    "supply_sag": (("source_resistance",), (0, 1)),
    "brush_drop": (("drop",), (0, 1, 2, 3)),
    "hbridge_dead_time": (("error",), (0, 1, 2)),
    "magnet_temperature": (("coefficient",), (0,)),
    "resistance_temperature": (("coefficient",), (0,)),
    "friction_asymmetry": (("friction",), ()),
}
BASE = (
    "resistance", "preload_open", "preload_close", "slope_open", "slope_close", "limp_home", "coulomb", "stiction",
    "viscous",
)  # fmt: skip


def covered(findings, truth):
    """{number: whether its interval holds the truth}; only for causes that are the truth, with nothing else named."""
    found = {e.name: e for e in estimates(findings.final, findings.balances, findings.final_floor)}
    causes = {round_.winner.id for round_ in findings.accepted}
    hidden = {entry["effect"]: entry for entry in truth["effects"]}
    if causes != set(hidden) or any(round_.alike for round_ in findings.accepted):
        return {}
    held = {}
    for name in causes:
        names, forms = COMPARABLE.get(name, ((), ()))
        if name in CATALOGUE and names and hidden[name]["form"] in forms:
            parts = [found.get(f"{name}.{part}") for part in names]
            if all(parts):
                held[name] = _holds(parts, hidden[name]["strength"])
    return held | {
        f"base:{name}": bool(found[name].low <= value <= found[name].high)
        for name, value in base_numbers(truth).items()
        if name in found
    }


def base_numbers(truth):
    """{base parameter: its true value at the throttle shaft} of a sealed truth."""
    unit = truth["unit"]
    return {name: unit[name] for name in BASE} | {
        "torque_per_ampere": unit["motor_constant"] * unit["gear_ratio"],
        "inertia": unit["plate_inertia"] + unit["gear_ratio"] ** 2 * unit["motor_inertia"],
    }


def _holds(parts, strength):
    if len(parts) == 1:
        return bool(parts[0].low <= strength <= parts[0].high)
    values = [part.value for part in parts]
    size = math.hypot(*values)
    reach = math.hypot(
        *((0.5 * (part.high - part.low)) * value / size for part, value in zip(parts, values, strict=True))
    )
    return bool(abs(size - abs(strength)) <= reach)
