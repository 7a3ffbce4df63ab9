"""Inverse model: torque and voltage along a measured motion, compiled.

Three passes: the plate with springs and stops, the bristles, and the electrical part. A fit changes one parameter at a
time, so that two of the three passes are nearly always cached.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.compiled import njit
from etb_hil.base.side_by_side import cores
from etb_hil.discrepancy.fitting.cache import Cache
from etb_hil.plant.bristle import bend
from etb_hil.plant.effects import backlash_contact, layout, ports
from etb_hil.plant.effects.layout import PLATE_INERTIA
from etb_hil.plant.effects.port import ELASTIC, FRICTION, Port
from etb_hil.plant.physics import (
    BACK_EMF,
    BRISTLE_DAMPING,
    BRISTLE_STIFFNESS,
    COULOMB,
    DEAD_ZONE,
    LIMP_HOME,
    PRELOAD_CLOSE,
    PRELOAD_OPEN,
    RESISTANCE,
    SLOPE_CLOSE,
    SLOPE_OPEN,
    STICTION,
    STOP_DAMPING,
    STOP_HIGH,
    STOP_LOW,
    STOP_STIFFNESS,
    STRIBECK_VELOCITY,
    TORQUE_PER_AMPERE,
    VISCOUS,
    VOLTAGE_LIMIT,
    Vector,
    spring_torque,
    stop_torque,
)

_SETTLE = 0.02  # s in which the smoothing of the record's start would move the bristles


# What the plate's place and springs, and what the bristles, depend on.
_OF_THE_PLATE = np.array([
    PRELOAD_OPEN, PRELOAD_CLOSE, SLOPE_OPEN, SLOPE_CLOSE, LIMP_HOME, DEAD_ZONE, STOP_LOW, STOP_HIGH,
    STOP_STIFFNESS, STOP_DAMPING, PLATE_INERTIA, *ports.places(*ELASTIC, Port.PLATE_LEAD),
])  # fmt: skip
_OF_THE_BRISTLES = np.array([
    COULOMB, STICTION, STRIBECK_VELOCITY, BRISTLE_STIFFNESS, BRISTLE_DAMPING, layout.ELASTIC,
    *ports.places(*FRICTION),
])  # fmt: skip
_OF_THE_LOAD = np.array(ports.strengths_that_ask("load", *FRICTION))


@dataclass(frozen=True, slots=True, eq=False)
class InverseModel:
    """A model evaluated along one motion with any parameters.

    Angle, velocity, acceleration (n each) at the throttle shaft; temperature (n). `is_open` (n): samples with the
    bridge open; `dt`: sample time in s.
    """

    angle: Vector
    velocity: Vector
    acceleration: Vector
    temperature: Vector
    is_open: NDArray[np.bool_]
    dt: float
    _plates: Cache[tuple[Vector, Vector]] = field(default_factory=lambda: Cache(cores()))
    _bristles: Cache[Vector] = field(default_factory=lambda: Cache(cores()))

    @staticmethod
    def plate_key(p: Vector) -> bytes:
        """Return the parameters that the plate's angle depends on, as a cache key."""
        return p[_OF_THE_PLATE].tobytes()

    def plate(self, p: Vector) -> tuple[Vector, Vector]:
        """Return the plate's angle (n, rad) and the torque on it (n, N·m).

        The torque is that of springs, stops and flow.
        """

        def make() -> tuple[Vector, Vector]:
            plate = np.empty_like(self.angle) if ports.is_loose(p) else self.angle
            holds = np.empty_like(self.angle)
            _hold(self.angle, self.velocity, self.acceleration, p, plate, holds)
            return plate, holds

        return self._plates.of(self.plate_key(p), make)

    def __call__(self, current: Vector, p: Vector) -> tuple[Vector, Vector, bool]:
        """Return driving less passive torque (n, N·m) and voltage (n, V) along the motion.

        The torque is without the inertia's; the voltage without L di/dt and K_e times the velocity. The third value
        tells whether the voltage is more than the resistance's. `current` (n) and extended parameters `p` are given.
        """
        _, holds = self.plate(p)

        def make() -> Vector:
            carried = np.empty_like(self.angle)
            _carry(self.angle, self.velocity, self.acceleration, self.temperature, holds, self.dt, p, carried)
            return carried

        key = p[_OF_THE_BRISTLES].tobytes() + (self.plate_key(p) if p[_OF_THE_LOAD].any() else b"")
        carried = self._bristles.of(key, make)
        torque, voltage = np.empty((2, len(self.angle)))
        lossy = _drive(
            self.angle, self.velocity, current, self.is_open, self.temperature, holds, carried, self.dt, p, torque,
            voltage,
        )  # fmt: skip
        return torque, voltage, lossy


@njit(cache=True, error_model="numpy", nogil=True)
def _hold(angle: Vector, velocity: Vector, acceleration: Vector, p: Vector, plate: Vector, holds: Vector) -> None:
    """Fill in the plate's angle behind backlash, and the torque of springs and stops."""
    elastic_acts, loose = ports.acting(p)[1], ports.is_loose(p)
    where = angle[0]
    for k in range(angle.size):
        theta, omega = angle[k], velocity[k]
        if loose:
            swing = p[PLATE_INERTIA] * acceleration[k]
            where = backlash_contact.on_plate(theta, where + theta - angle[max(k - 1, 0)], omega, swing, p)
            plate[k] = where
        else:
            where = theta
        if elastic_acts or loose:
            holds[k] = ports.elastic_torque(where, omega, p)
        else:
            holds[k] = spring_torque(where, p) + stop_torque(where, omega, p)


@njit(cache=True, error_model="numpy", nogil=True)
def _carry(
    angle: Vector,
    velocity: Vector,
    acceleration: Vector,
    temperature: Vector,
    holds: Vector,
    dt: float,
    p: Vector,
    carried: Vector,
) -> None:
    """Fill in the bristles' torque, exact over the travel."""
    friction_acts = ports.acting(p)[0]
    sigma_0, sigma_1 = p[BRISTLE_STIFFNESS], p[BRISTLE_DAMPING]
    continue_from = int(_SETTLE / dt)
    bristle, friction, slow = 0.0, 0.0, ports.slow_start(temperature[0], p)
    for k in range(angle.size):
        theta, omega = angle[k], velocity[k]
        way = theta - angle[k - 1] if k > continue_from else 0.0
        if friction_acts:
            ports.pass_friction_time(slow, omega, way, temperature[k], dt, p)
            load = holds[k] + p[PLATE_INERTIA] * acceleration[k]
            g = ports.friction_level(theta, omega, load, temperature[k], friction, slow, p)
        else:
            g = ports.plain_friction_level(omega, p)
        before = bristle
        if way != 0.0:
            bristle, _, _, _ = bend(bristle, way, g, g, sigma_0, 1.0 / sigma_0, p[layout.ELASTIC])
        friction = sigma_0 * bristle
        # The bristles' rate between two samples is told to both of them: it is centred, then.
        rate = 0.5 * sigma_1 * (bristle - before) / dt
        if k > 0:
            carried[k - 1] += rate
        carried[k] = friction + rate


@njit(cache=True, error_model="numpy", nogil=True)
def _drive(
    angle: Vector,
    velocity: Vector,
    current: Vector,
    is_open: NDArray[np.bool_],
    temperature: Vector,
    holds: Vector,
    carried: Vector,
    dt: float,
    p: Vector,
    torque: Vector,
    voltage: Vector,
) -> bool:
    """Fill in torque and voltage; return whether the voltage exceeds the resistance's."""
    friction_acts, _, drag_acts, constant_acts, voltage_acts, slow_acts = ports.acting(p)
    slow = ports.slow_start(temperature[0], p)
    resistance, torque_per_ampere, back_emf = p[RESISTANCE], p[TORQUE_PER_AMPERE], p[BACK_EMF]
    limit = p[VOLTAGE_LIMIT]
    sigma_2, drag, lost = p[VISCOUS], 0.0, 0.0
    continue_from = int(_SETTLE / dt)
    for k in range(angle.size):
        theta, omega, i = angle[k], velocity[k], current[k]
        # What the balance itself says of the voltage: losses that scale the measured one would scale its noise away.
        command = 0.0 if is_open[k] else resistance * i + back_emf * omega + lost
        command = min(max(command, -limit), limit)  # no bridge gives more; losses that grow with it would run away
        if slow_acts:
            way = theta - angle[k - 1] if k > continue_from else 0.0
            ports.pass_time(slow, omega, way, i, command, temperature[k], dt, p)
        if friction_acts:
            sigma_2 = ports.viscosity(omega, temperature[k], p)
        if drag_acts:
            drag = ports.motor_drag(theta, omega, slow, p)
        drive, voltage[k] = torque_per_ampere * i, resistance * i
        if constant_acts:
            drive = torque_per_ampere * (1.0 + ports.torque_share(theta, slow, p)) * i
        torque[k] = drive - (carried[k] + sigma_2 * omega + holds[k] + drag)
        if voltage_acts or constant_acts:
            lost = ports.voltage_loss(i, command, is_open[k], slow, p)
            voltage[k] = (
                resistance * (1.0 + ports.resistance_share(i, slow, p)) * i
                + lost
                + back_emf * ports.back_emf_share(theta, slow, p) * omega
            )
    return voltage_acts or constant_acts
