"""Where effects enter the equations, compiled.

The plant, what explains data, and observers share it.

Which effects there are at a port, and what they ask for, is in their declarations alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.plant.effects import compose
from etb_hil.plant.effects.catalogue import OWN
from etb_hil.plant.effects.effect import Effect, arguments
from etb_hil.plant.effects.layout import EFFECTS, EXTENDED, SLOW
from etb_hil.plant.effects.outside import STEPS
from etb_hil.plant.effects.port import DRAG, ELASTIC, FRICTION, MOTOR_CONSTANT, READINGS, VOLTAGE, Port
from etb_hil.plant.physics import (
    COULOMB,
    STICTION,
    STRIBECK_VELOCITY,
    VISCOUS,
    Vector,
    spring_torque,
    stop_torque,
)


def _at(*ports: Port) -> list[Effect]:
    return [effect for effect in OWN if effect.acts_at(*ports)]


def _acting_places(effects: Iterable[Effect]) -> tuple[int, ...]:
    return tuple(place for effect in effects for place in effect.acting_indices)


def places(*ports: Port) -> tuple[int, ...]:
    """Return the indices of all that the terms at some ports depend on.

    They are those in the extended vector.

    Those are their effects' parameters and the base parameters that they ask for, of this package's effects, and the
    room of all effects from outside.
    """
    found = set(range(_OUTSIDE, EXTENDED))
    for effect in _at(*ports):
        found.update(effect.stated_indices)
        found.update(
            compose.BASE[n] for function in effect.at(*ports) for n in arguments(function) if n in compose.BASE
        )
        for state in effect.states:
            found.update(compose.BASE[name] for name in arguments(state.step) if name in compose.BASE)
    return tuple(sorted(found))


def strengths_that_ask(quantity: str, *ports: Port) -> tuple[int, ...]:
    """Return the strengths of effects that ask for a quantity.

    The terms are at some ports; all that is from outside is among them.
    """
    asking = [one for one in _at(*ports) if any(quantity in arguments(f) for f in one.at(*ports))]
    return (*_acting_places(asking), *range(_OUTSIDE, EXTENDED))


_OUTSIDE = max((effect.stated_indices[-1] + 1 for effect in OWN), default=EFFECTS)

# Where the strengths stand that each kind of port asks for.
_FRICTION = _acting_places(_at(*FRICTION))
_ELASTIC = _acting_places(_at(*ELASTIC))
_LEAD = _acting_places(_at(Port.PLATE_LEAD))
_DRAG = _acting_places(_at(*DRAG))
_MOTOR_CONSTANT = _acting_places(_at(*MOTOR_CONSTANT))
_VOLTAGE = _acting_places(_at(*VOLTAGE))
_SLOW = _acting_places(effect for effect in OWN if effect.states)

_friction_outside = compose.outside_at(*(port.index for port in FRICTION))
_elastic_outside = compose.outside_at(*(port.index for port in ELASTIC))
_lead_outside = compose.outside_at(Port.PLATE_LEAD.index)
_drag_outside = compose.outside_at(*(port.index for port in DRAG))
_constant_outside = compose.outside_at(*(port.index for port in MOTOR_CONSTANT))
_voltage_outside = compose.outside_at(*(port.index for port in VOLTAGE))
_slow_outside = compose.outside_at(STEPS)

_starts = compose.starts(OWN, is_open=True)
_steps = compose.steps(OWN, of_friction=False, is_open=True)
_friction_steps = compose.steps(OWN, of_friction=True, is_open=True)
_of = {port: compose.composed(port, OWN, is_open=port.is_open) for port in Port if port not in READINGS}
_friction_share, _friction_torque = _of[Port.FRICTION_SHARE], _of[Port.FRICTION_TORQUE]
_friction_age, _friction_heat = _of[Port.FRICTION_AGE], _of[Port.FRICTION_HEAT]
_viscous_share, _stribeck_peak = _of[Port.VISCOUS_SHARE], _of[Port.STRIBECK_PEAK]
_springs, _spring_torque, _plate_torque = _of[Port.SPRINGS], _of[Port.SPRING_TORQUE], _of[Port.PLATE_TORQUE]
_plate_lead, _motor_torque, _drag_torque = _of[Port.PLATE_LEAD], _of[Port.MOTOR_TORQUE], _of[Port.DRAG_TORQUE]
_torque_share, _back_emf_share = _of[Port.TORQUE_SHARE], _of[Port.BACK_EMF_SHARE]
_resistance_share = _of[Port.RESISTANCE_SHARE]
_motor_voltage, _bridge_voltage = _of[Port.MOTOR_VOLTAGE], _of[Port.BRIDGE_VOLTAGE]


@njit(cache=True, error_model="numpy")
def slow_start(temperature: float, p: Vector) -> Vector:
    """Return the slow states of a throttle that has long been at a temperature.

    They are float64 (`SLOW`), the temperature is in degC.
    """
    slow = np.zeros(SLOW)
    _starts(0.0, temperature, slow, p)
    return slow


@njit(cache=True, error_model="numpy")
def _any(p: Vector, places: tuple[int, ...]) -> bool:
    for place in places:  # noqa: SIM110 (compiled: no generators)
        if p[place] != 0.0:
            return True
    return False


@njit(cache=True, error_model="numpy")
def _any_outside(p: Vector) -> bool:
    found = 0
    for place in range(_OUTSIDE, EXTENDED):  # all of them: without a way out the loop is eight times as fast
        found += p[place] != 0.0
    return found > 0


@njit(cache=True, error_model="numpy")
def acting(p: Vector) -> tuple[bool, bool, bool, bool, bool, bool]:
    """Tell which kinds of effects there are.

    Friction, springs and stops, drag, torque constant, voltage, slow states.

    A loop that asks once need not ask every effect at every sample; without effects of a kind its equation is the
    base model's.
    """
    outside = _any_outside(p)
    return (
        (outside and _friction_outside()) or _any(p, _FRICTION),
        (outside and _elastic_outside()) or _any(p, _ELASTIC),
        (outside and _drag_outside()) or _any(p, _DRAG),
        (outside and _constant_outside()) or _any(p, _MOTOR_CONSTANT),
        (outside and _voltage_outside()) or _any(p, _VOLTAGE),
        (outside and _slow_outside()) or _any(p, _SLOW),
    )


@njit(cache=True, error_model="numpy")
def is_loose(p: Vector) -> bool:
    """Tell whether motor and plate are two angles."""
    return _any(p, _LEAD) or (_lead_outside() and _any_outside(p))


@njit(cache=True, error_model="numpy")
def lead(load: float, p: Vector) -> float:
    """Return the angle in rad by which the motor leads the plate under a load in N·m."""
    return _plate_lead(0.0, load, p)


@njit(cache=True, error_model="numpy")
def elastic_torque(plate: float, omega: float, p: Vector) -> float:
    """Return the torque in N·m of springs, stops and what else acts on the plate.

    The torque is positive where it closes the plate.
    """
    springs = _springs(spring_torque(plate, p), plate, p)
    return _plate_torque(_spring_torque(springs + stop_torque(plate, omega, p), plate, p), plate, omega, p)


@njit(cache=True, error_model="numpy")
def motor_torque(theta: float, p: Vector) -> float:
    """Return the torque in N·m on the motor that stores energy.

    The torque gives the energy back; it is at the throttle shaft.
    """
    return _motor_torque(0.0, theta, p)


@njit(cache=True, error_model="numpy")
def motor_drag(theta: float, omega: float, slow: Vector, p: Vector) -> float:
    """Return the torque in N·m that brakes the motor besides LuGre friction.

    The torque is at the throttle shaft.
    """
    return _drag_torque(_motor_torque(0.0, theta, p), theta, omega, slow, p)


@njit(cache=True, error_model="numpy", forceinline=True)
def friction_level(
    theta: float, omega: float, load: float, temperature: float, bristle_torque: float, slow: Vector, p: Vector
) -> float:
    """Return g in N·m, the friction of steady sliding, with what changes it.

    The friction is without viscosity (seed paper, eq. 2).
    """
    x = omega / p[STRIBECK_VELOCITY]
    surplus = max(p[STICTION] - p[COULOMB], 0.0) * _stribeck_peak(math.exp(-x * x), omega, p)
    g = p[COULOMB] + surplus
    part = surplus / g
    share = 1.0 + _friction_share(0.0, theta, omega, load, bristle_torque, temperature, part, slow, p)
    added = _friction_torque(0.0, theta, omega, load, bristle_torque, temperature, part, slow, p)
    cold = g * share + added
    # Heat changes how slippery a contact is, whatever presses it: the place, the direction and the load.
    return max(_friction_heat(_friction_age(cold, slow, p), temperature, p), 0.02 * p[COULOMB])


@njit(cache=True, error_model="numpy")
def plain_friction_level(omega: float, p: Vector) -> float:
    """Return g in N·m where no effect changes it."""
    x = omega / p[STRIBECK_VELOCITY]
    return max(p[COULOMB] + max(p[STICTION] - p[COULOMB], 0.0) * math.exp(-x * x), 0.02 * p[COULOMB])


@njit(cache=True, error_model="numpy")
def viscosity(omega: float, temperature: float, p: Vector) -> float:
    """Return sigma_2 in N·m·s/rad with what changes it."""
    return _viscous_share(p[VISCOUS], omega, temperature, p)


@njit(cache=True, error_model="numpy")
def torque_share(theta: float, slow: Vector, p: Vector) -> float:
    """Return what is added to the torque per ampere, a share of it."""
    return _torque_share(0.0, theta, slow, p)


@njit(cache=True, error_model="numpy")
def back_emf_share(theta: float, slow: Vector, p: Vector) -> float:
    """Return what is added to the back-EMF constant, a share of it."""
    return _back_emf_share(0.0, theta, slow, p)


@njit(cache=True, error_model="numpy")
def resistance_share(current: float, slow: Vector, p: Vector) -> float:
    """Return what is added to the resistance, a share of it."""
    return _resistance_share(0.0, current, slow, p)


@njit(cache=True, error_model="numpy")
def voltage_loss(current: float, command: float, is_open: bool, slow: Vector, p: Vector) -> float:
    """Return the voltage in V lost between command and winding.

    With the bridge off it is what the motor itself loses.
    """
    lost = _motor_voltage(0.0, current, p)
    return lost if is_open else _bridge_voltage(lost, current, command, slow, p)


@njit(cache=True, error_model="numpy", forceinline=True)
def pass_friction_time(slow: Vector, omega: float, travel: float, temperature: float, dt: float, p: Vector) -> None:
    """Move the slow states that friction has by dt s in place."""
    _friction_steps(0.0, omega, travel, temperature, dt, slow, p)


@njit(cache=True, error_model="numpy")
def pass_time(
    slow: Vector, omega: float, travel: float, current: float, command: float, temperature: float, dt: float, p: Vector
) -> None:
    """Move the slow states by dt s in place."""
    _steps(0.0, omega, travel, current, command, temperature, dt, slow, p)
