"""Units drawn at random from the box of production throttles, and what a bench believes of them."""

import numpy as np

from generator.layout import PARAMETERS

STATED_TOLERANCE = 0.10  # truth over nominal lies in [1 / 1.1, 1.1]
STOP_TOLERANCE = 0.005  # rad
EXACT = ("gear_ratio",)
BY_AMOUNT = ("stop_low", "stop_high")


def vector(values):
    """Values of a dict in the compiled plant's order."""
    return np.array([values[name] for name in PARAMETERS])


def draw_unit(rng):
    """A healthy unit (dict, SI) that returns from the stops by itself and that 12 V can open."""
    while True:
        gear = float(rng.uniform(15.0, 22.0))
        coulomb = float(rng.uniform(0.005, 0.009))
        unit = {
            "resistance": rng.uniform(1.0, 3.0),
            "inductance": rng.uniform(0.5e-3, 3e-3),
            "motor_constant": rng.uniform(0.012, 0.03),
            "gear_ratio": gear,
            "motor_inertia": rng.uniform(2e-6, 8e-6),
            "plate_inertia": rng.uniform(20e-6, 50e-6),
            "preload_open": rng.uniform(0.25, 0.45),
            "preload_close": rng.uniform(0.3, 0.4),
            "slope_open": rng.uniform(0.03, 0.09),
            "slope_close": rng.uniform(0.03, 0.09),
            "limp_home": rng.uniform(0.10, 0.18),
            "dead_zone": rng.uniform(1.5e-3, 4e-3),
            "stop_low": rng.uniform(-0.003, 0.003),
            "stop_high": rng.uniform(1.46, 1.51),
            "stop_stiffness": rng.uniform(200.0, 400.0),
            "stop_damping": rng.uniform(0.2, 0.5),
            "coulomb": coulomb * gear,
            "stiction": coulomb * gear * rng.uniform(1.05, 1.4),
            "stribeck_velocity": rng.uniform(100.0, 180.0) / gear,
            "bristle_stiffness": float(np.exp(rng.uniform(np.log(40.0), np.log(120.0)))),
            "bristle_damping": rng.uniform(0.05, 0.2),
            "viscous": rng.uniform(0.001, 0.005),
        }
        unit = {name: float(value) for name, value in unit.items()}
        if _opens_and_returns(unit):
            return unit


def _opens_and_returns(unit):
    per_volt = unit["motor_constant"] * unit["gear_ratio"] / unit["resistance"]
    hardest = unit["preload_open"] + unit["slope_open"] * 1.4 + unit["stiction"]
    margin = min(unit["preload_open"], unit["preload_close"]) - unit["stiction"]
    return 12.0 * per_volt > 1.35 * hardest and margin > 0.05


def draw_nominal(rng, unit):
    """What the bench believes: every value off by a factor of up to 1.1, the stops by up to 5 mrad."""
    while True:
        nominal = {name: value * (1.0 + STATED_TOLERANCE) ** rng.uniform(-1.0, 1.0) for name, value in unit.items()}
        for name in EXACT:
            nominal[name] = unit[name]
        nominal["stop_low"] = 0.0
        nominal["stop_high"] = unit["stop_high"] + rng.uniform(-STOP_TOLERANCE, STOP_TOLERANCE)
        if nominal["stiction"] > 1.01 * nominal["coulomb"]:
            return {name: float(value) for name, value in nominal.items()}
