"""Where each effect's parameters stand: a row behind the base model's parameters."""

from __future__ import annotations

import numpy as np

from etb_hil.plant.physics import PARAMETERS, Vector

IDS = (
    "friction_position_periodic",
    "friction_position_local",
    "friction_temperature",
    "friction_asymmetry",
    "friction_load",
    "stiction_dwell",
    "stribeck_shape",
    "presliding_hysteresis",
    "gear_backlash",
    "shaft_compliance",
    "cogging_torque",
    "torque_ripple",
    "spring_nonlinear",
    "spring_preload_shift",
    "limp_home_dead_zone",
    "aerodynamic_torque",
    "end_stop_compliance",
    "iron_loss",
    "resistance_temperature",
    "magnet_temperature",
    "brush_drop",
    "hbridge_dead_time",
    "supply_sag",
    "current_sensor_gain",
    "current_sensor_offset",
    "angle_sensor_eccentricity",
    "sensor_hysteresis",
    "measurement_delay",
)
WIDTH = 7
PLATE_INERTIA = PARAMETERS + WIDTH * len(IDS)  # of the plate alone, for what lies between motor and plate
EXTENDED = PLATE_INERTIA + 1


def row(effect: str) -> int:
    """Return the index of an effect's first parameter in the extended vector."""
    return PARAMETERS + WIDTH * IDS.index(effect)


def extended(base: Vector) -> Vector:
    """Return base parameters (24) with no effect behind them (float64, `EXTENDED`)."""
    return np.concatenate([base, np.zeros(EXTENDED - PARAMETERS)])
