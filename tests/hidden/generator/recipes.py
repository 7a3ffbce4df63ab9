"""How each effect is drawn: its shape at random, a strength to start from, and the most that physics allows."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from generator import layout as at


def _shapeless(rng, unit):
    del rng, unit
    return ()


@dataclass(frozen=True)
class Recipe:
    """Random shape of one effect.

    `start` and `most`: strengths in the effect's own unit; `forms`: how many variants of the curve; `signed`: the
    strength may be negative; `shape(rng, unit)`: up to four shape parameters; `reads_only`: changes what is measured
    and not what happens.
    """

    start: float
    most: float
    unit: str
    forms: int = 1
    signed: bool = False
    reads_only: bool = False
    shape: Callable = _shapeless

    @property
    def has_shape(self):
        """Whether two draws may differ in more than their strength."""
        return self.forms > 1 or self.shape is not _shapeless

    def draw(self, name, rng, unit):
        """A row of the effects' table at strength +-1, to be scaled."""
        row = np.zeros(at.ROW_WIDTH)
        row[at.STRENGTH] = rng.choice([-1.0, 1.0]) if self.signed else 1.0
        row[at.FORM] = rng.integers(self.forms)
        if name == "angle_sensor_eccentricity":
            row[at.FORM] *= 2.0  # a sine, or one with a second harmonic
        shape = self.shape(rng, unit)
        row[at.A : at.A + len(shape)] = shape
        return row


def _phase(rng):
    return rng.uniform(0.0, 2.0 * np.pi)


def _slots(rng, unit):
    """Periods a motor turn, phase, and whether the back-EMF shares the ripple."""
    del unit
    return rng.choice([3.0, 5.0, 6.0, 10.0, 12.0]), _phase(rng), rng.integers(2)


def _stribeck(rng, unit):
    del unit
    return (rng.uniform(0.25, 0.6) if rng.random() < 0.5 else rng.uniform(1.8, 3.0)), rng.uniform(0.5, 1.0)


def _stops(rng, unit):
    """Depth of the layer before the upper and the lower stop (none: -1), and its damping."""
    del unit
    depths = rng.uniform(0.008, 0.04, 2)
    if rng.random() < 0.4:
        depths[rng.integers(2)] = -1.0
    return depths[0], depths[1], rng.uniform(0.001, 0.006)


RECIPES = {
    "friction_position_periodic": Recipe(
        0.08,
        0.6,
        "share of T_c",
        3,
        shape=lambda r, u: (r.choice([1.0, 2.0, r.uniform(0.2, 0.4)]) * u["gear_ratio"], _phase(r)),
    ),
    "friction_position_local": Recipe(
        0.05,
        0.25,
        "N·m",
        4,
        shape=lambda r, u: (
            u["stop_low"] + (r.uniform(0.02, 0.08) if r.random() < 0.3 else r.uniform(0.1, 1.3)),
            r.uniform(0.035, 0.14),
        ),
    ),
    "friction_temperature": Recipe(0.1, 0.8, "share in 30 K", 3, shape=lambda r, _: (r.uniform(0.5, 3.0),)),
    "friction_asymmetry": Recipe(
        0.1, 0.6, "share of T_c", 4, True, shape=lambda r, _: (r.uniform(0.05, 0.4), r.choice([-1.0, 0.0, 1.0]))
    ),
    "friction_load": Recipe(
        0.1, 0.5, "share of load", 3, shape=lambda r, _: (r.uniform(0.8, 1.3), r.uniform(0.1, 0.25))
    ),
    "stiction_dwell": Recipe(
        0.1, 1.2, "share of T_st", 3, shape=lambda r, _: (r.uniform(0.01, 0.3), r.uniform(0.001, 0.006))
    ),
    "stribeck_shape": Recipe(0.5, 1.0, "share", 3, shape=_stribeck),
    "presliding_hysteresis": Recipe(0.02, 0.2, "N·m", 3, shape=lambda r, _: (r.uniform(0.0009, 0.009),)),
    "gear_backlash": Recipe(0.002, 0.04, "rad", 2, shape=lambda r, _: (r.uniform(5e-5, 3e-4),)),
    "shaft_compliance": Recipe(0.01, 0.08, "rad/(N·m)", 3, shape=lambda r, _: (r.uniform(0.002, 0.006),)),
    "cogging_torque": Recipe(0.005, 0.08, "N·m", 3, shape=_slots),
    "torque_ripple": Recipe(0.04, 0.4, "share of K_t", 3, shape=_slots),
    "spring_nonlinear": Recipe(0.02, 0.3, "N·m", 4, True, shape=lambda r, _: (r.uniform(0.3, 0.8),)),
    "spring_preload_shift": Recipe(0.03, 0.15, "N·m", 1, True),
    "limp_home_dead_zone": Recipe(0.005, 0.05, "rad", 3),
    "aerodynamic_torque": Recipe(0.03, 0.2, "N·m", 3, shape=lambda r, _: (r.uniform(0.3, 0.7), r.uniform(0.7, 1.5))),
    "end_stop_compliance": Recipe(10.0, 250.0, "N·m/rad", 3, shape=_stops),
    "iron_loss": Recipe(0.01, 0.1, "N·m", 4, shape=lambda r, _: (r.uniform(0.3, 2.0), r.uniform(0.0, 0.1))),
    "resistance_temperature": Recipe(
        0.5, 1.6, "share of copper's 0.393 %/K", 1, shape=lambda r, _: (r.uniform(2.0, 15.0), r.uniform(5.0, 60.0))
    ),
    "magnet_temperature": Recipe(1.0, 4.0, "share of -0.2 %/K", 2, shape=lambda r, _: (r.uniform(3.0, 60.0),)),
    "brush_drop": Recipe(0.1, 1.5, "V", 4, shape=lambda r, _: (r.uniform(0.03, 0.2),)),
    "hbridge_dead_time": Recipe(0.1, 1.5, "V", 3, shape=lambda r, _: (r.uniform(0.15, 0.6),)),
    "supply_sag": Recipe(0.2, 1.5, "ohm", 2, shape=lambda r, _: (r.uniform(0.0, 0.5),)),
    "current_sensor_gain": Recipe(0.05, 0.3, "share", 1, True, True),
    "current_sensor_offset": Recipe(0.02, 0.4, "A", 2, True, True),
    "angle_sensor_eccentricity": Recipe(0.02, 0.3, "rad of the motor", 2, shape=lambda r, _: (_phase(r),)),
    "sensor_hysteresis": Recipe(0.001, 0.012, "rad", 3, False, True),
    "measurement_delay": Recipe(0.0005, 0.01, "s", 2, False, True),
    "air_drag": Recipe(2e-4, 5e-3, "N·m·s²/rad²", shape=lambda r, _: (r.uniform(0.85, 1.15),)),
    "running_in": Recipe(0.05, 0.6, "share of friction"),
    "friction_bursts": Recipe(0.2, 2.0, "share of friction"),
    "eccentric_inertia": Recipe(0.1, 0.6, "share of J", shape=lambda r, _: (r.uniform(2.0, 6.0), _phase(r))),
    "external_vibration": Recipe(0.004, 0.08, "N·m rms"),
    "supply_ripple": Recipe(
        0.2, 3.0, "V", 2, shape=lambda r, _: (2.0 * np.pi * r.uniform(15.0, 45.0), r.uniform(0.5, 3.0))
    ),
    "encoder_slip": Recipe(0.01, 1.0, "rad of the motor", 1, False, True, shape=lambda r, _: (r.uniform(0.3, 0.9),)),
    "magnetic_saturation": Recipe(2e-3, 0.08, "1/A²", 2),
    "brush_contact_position": Recipe(0.1, 0.8, "share of R", 3, shape=_slots),
    "spring_thermal_drift": Recipe(0.03, 0.3, "share in 30 K", 1, True),
    "current_sensor_curvature": Recipe(0.01, 0.12, "1/A", 1, True, True),
    "plate_sensor_curvature": Recipe(
        0.001, 0.03, "rad", 1, False, True, shape=lambda r, _: (r.uniform(2.0, 5.0), _phase(r))
    ),
    "angle_delay": Recipe(0.0005, 0.02, "s", 2, False, True),
    "motor_angle_delay": Recipe(0.0005, 0.02, "s", 2, False, True),
    "plate_angle_delay": Recipe(0.0005, 0.02, "s", 2, False, True),
}

# Effects that are collinear with a base parameter: only a part outside the parameter's tolerance can be named.
PARAMETER_LIKE = frozenset({"spring_preload_shift", "current_sensor_gain", "limp_home_dead_zone"})

# Never hidden together: pairs that are known to be collinear (both ways).
LOOK_ALIKE = (
    {"shaft_compliance", "gear_backlash", "sensor_hysteresis"},
    {"brush_drop", "hbridge_dead_time", "resistance_temperature", "supply_sag"},
    {"aerodynamic_torque", "spring_nonlinear", "spring_preload_shift"},
    {"friction_load", "friction_asymmetry", "current_sensor_gain", "magnet_temperature", "current_sensor_offset"},
    {"friction_asymmetry", "spring_preload_shift"},
    {"end_stop_compliance", "shaft_compliance", "gear_backlash", "limp_home_dead_zone"},
    {"iron_loss", "stribeck_shape", "presliding_hysteresis"},
    {"cogging_torque", "torque_ripple", "angle_sensor_eccentricity"},
    {"friction_temperature", "magnet_temperature"},
    {"stiction_dwell", "stribeck_shape"},
)


def look_alike(first, second):
    """Tell whether two effects are a known look-alike pair."""
    return first == second or any(first in group and second in group for group in LOOK_ALIKE)
