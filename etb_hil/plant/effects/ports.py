"""Where effects enter the equations, compiled: one call an effect, shared by the plant and by what explains data."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from etb_hil.plant.effects import (
    aerodynamic_torque,
    brush_drop,
    cogging_torque,
    end_stop_compliance,
    friction_asymmetry,
    friction_load,
    friction_position_local,
    friction_position_periodic,
    friction_temperature,
    gear_backlash,
    hbridge_dead_time,
    iron_loss,
    limp_home_dead_zone,
    magnet_temperature,
    presliding_hysteresis,
    resistance_temperature,
    shaft_compliance,
    spring_nonlinear,
    spring_preload_shift,
    stiction_dwell,
    stribeck_shape,
    supply_sag,
    torque_ripple,
)
from etb_hil.plant.effects.effect import Effect
from etb_hil.plant.physics import (
    COULOMB,
    STICTION,
    STRIBECK_VELOCITY,
    VISCOUS,
    Vector,
    spring_torque,
    stop_torque,
)

# Slow states: age of contacts (s), memory of reversals, rise of the winding (K), magnets (degC), supply current (A),
# housing as the winding has followed it (degC).
AGE, MEMORY, RISE, MAGNET, DRAWN, HOUSING = range(6)
SLOW = 6


def _strengths(*effects: Effect) -> tuple[int, ...]:
    return tuple(effect.indices[k] for effect in effects for k in effect.strengths)


# Where the strengths stand that each kind of port asks for.
_FRICTION = _strengths(
    friction_position_periodic.EFFECT, friction_position_local.EFFECT, friction_temperature.EFFECT,
    friction_asymmetry.EFFECT, friction_load.EFFECT, stiction_dwell.EFFECT, stribeck_shape.EFFECT,
)  # fmt: skip
_ELASTIC = _strengths(
    spring_nonlinear.EFFECT, spring_preload_shift.EFFECT, limp_home_dead_zone.EFFECT, aerodynamic_torque.EFFECT,
    end_stop_compliance.EFFECT,
)  # fmt: skip
_DRAG = _strengths(cogging_torque.EFFECT, iron_loss.EFFECT, presliding_hysteresis.EFFECT)
_TORQUE_CONSTANT = _strengths(torque_ripple.EFFECT, magnet_temperature.EFFECT)
_VOLTAGE = _strengths(brush_drop.EFFECT, hbridge_dead_time.EFFECT, supply_sag.EFFECT, resistance_temperature.EFFECT)
_SLOW = _strengths(
    stiction_dwell.EFFECT, presliding_hysteresis.EFFECT, resistance_temperature.EFFECT, magnet_temperature.EFFECT,
    supply_sag.EFFECT,
)  # fmt: skip


@njit(cache=True, error_model="numpy")
def slow_start(temperature: float, p: Vector) -> Vector:
    """Return the slow states (float64, `SLOW`) of a throttle that has long been at a temperature in degC."""
    slow = np.zeros(SLOW)
    slow[AGE] = stiction_dwell.age_at_start(p)
    slow[MAGNET] = slow[HOUSING] = temperature
    return slow


@njit(cache=True, error_model="numpy")
def _any(p: Vector, places: tuple[int, ...]) -> bool:
    for place in places:  # noqa: SIM110 (compiled: no generators)
        if p[place] != 0.0:
            return True
    return False


@njit(cache=True, error_model="numpy")
def acting(p: Vector) -> tuple[bool, bool, bool, bool, bool, bool]:
    """Tell which kinds of effects there are: friction, springs and stops, drag, torque constant, voltage, slow states.

    A loop that asks once need not ask every effect at every sample; without effects of a kind its equation is the
    base model's.
    """
    return (
        _any(p, _FRICTION),
        _any(p, _ELASTIC),
        _any(p, _DRAG),
        _any(p, _TORQUE_CONSTANT),
        _any(p, _VOLTAGE),
        _any(p, _SLOW),
    )


@njit(cache=True, error_model="numpy")
def is_loose(p: Vector) -> bool:
    """Tell whether motor and plate are two angles."""
    return gear_backlash.is_there(p) or shaft_compliance.is_there(p)


@njit(cache=True, error_model="numpy")
def lead(load: float, p: Vector) -> float:
    """Return the angle in rad by which the motor leads the plate under a load in N·m."""
    return gear_backlash.lead(load, p) + shaft_compliance.lead(load, p)


@njit(cache=True, error_model="numpy")
def elastic_torque(plate: float, omega: float, p: Vector) -> float:
    """Return the torque in N·m of springs and stops on the plate, positive where it closes it."""
    loose = limp_home_dead_zone.is_there(p)
    springs = limp_home_dead_zone.spring_torque(plate, p) if loose else spring_torque(plate, p)
    return (
        springs
        + stop_torque(plate, omega, p)
        + spring_nonlinear.torque(plate, p)
        + spring_preload_shift.torque(plate, p)
        + aerodynamic_torque.torque(plate, p)
        + end_stop_compliance.torque(plate, omega, p)
    )


@njit(cache=True, error_model="numpy")
def motor_drag(theta: float, omega: float, memory: float, p: Vector) -> float:
    """Return the torque in N·m that brakes the motor besides LuGre friction, at the throttle shaft."""
    return cogging_torque.torque(theta, p) + iron_loss.torque(omega, p) + presliding_hysteresis.torque(memory, p)


@njit(cache=True, error_model="numpy")
def friction_level(
    theta: float, omega: float, load: float, temperature: float, age: float, friction: float, p: Vector
) -> float:
    """Return g in N·m: friction of steady sliding without viscosity (seed paper, eq. 2), with what changes it."""
    surplus = max(p[STICTION] - p[COULOMB], 0.0) * stribeck_shape.peak(omega, p)
    g = p[COULOMB] + surplus
    surplus_share = surplus / g
    share = 1.0 + (
        friction_position_periodic.share(theta, surplus_share, p) + friction_asymmetry.share(omega, surplus_share, p)
    )
    added = friction_position_local.torque(theta, p) + friction_load.torque(load, friction, p)
    cold = g * share + added + stiction_dwell.torque(age, p)
    # Heat changes how slippery a contact is, whatever presses it: the place, the direction and the load.
    return max(cold * (1.0 + friction_temperature.share(temperature, p)), 0.02 * p[COULOMB])


@njit(cache=True, error_model="numpy")
def plain_friction_level(omega: float, p: Vector) -> float:
    """Return g in N·m where no effect changes it."""
    x = omega / p[STRIBECK_VELOCITY]
    return max(p[COULOMB] + max(p[STICTION] - p[COULOMB], 0.0) * math.exp(-x * x), 0.02 * p[COULOMB])


@njit(cache=True, error_model="numpy")
def viscosity(omega: float, temperature: float, p: Vector) -> float:
    """Return sigma_2 in N·m·s/rad with what changes it."""
    by_heat = 1.0 + friction_temperature.viscous_share(temperature, p)
    return p[VISCOUS] * (1.0 + friction_asymmetry.viscous_share(omega, p)) * by_heat


@njit(cache=True, error_model="numpy")
def torque_share(theta: float, magnet: float, p: Vector) -> float:
    """Return what is added to the torque per ampere, a share of it."""
    return torque_ripple.share(theta, p) + magnet_temperature.share(magnet, p)


@njit(cache=True, error_model="numpy")
def back_emf_share(theta: float, magnet: float, p: Vector) -> float:
    """Return what is added to the back-EMF constant, a share of it."""
    return torque_ripple.back_emf_share(theta, p) + magnet_temperature.share(magnet, p)


@njit(cache=True, error_model="numpy")
def resistance_share(housing: float, rise: float, p: Vector) -> float:
    """Return what is added to the resistance, a share of it."""
    return resistance_temperature.share(housing, rise, p)


@njit(cache=True, error_model="numpy")
def voltage_loss(current: float, command: float, drawn: float, is_open: bool, p: Vector) -> float:
    """Return the voltage in V lost between command and winding; with the bridge off, what the motor itself loses."""
    lost = brush_drop.voltage(current, p)
    if is_open:
        return lost
    return lost + hbridge_dead_time.voltage(current, p) + supply_sag.voltage(current, command, drawn, p)


@njit(cache=True, error_model="numpy")
def older(age: float, omega: float, dt: float, p: Vector) -> float:
    """Return the age of the contacts in s after dt s at a velocity; as it was where nothing depends on it."""
    return stiction_dwell.older(age, omega, dt, p) if stiction_dwell.is_there(p) else age


@njit(cache=True, error_model="numpy")
def pass_time(
    slow: Vector, omega: float, way: float, current: float, command: float, temperature: float, dt: float, p: Vector
) -> None:
    """Move the slow states by dt s in place."""
    slow[AGE] = older(slow[AGE], omega, dt, p)
    slow[MEMORY] = presliding_hysteresis.remembered(slow[MEMORY], way, p)
    slow[RISE] = resistance_temperature.warmed(slow[RISE], current, dt, p)
    slow[HOUSING] = resistance_temperature.followed(slow[HOUSING], temperature, dt, p)
    slow[MAGNET] = magnet_temperature.followed(slow[MAGNET], temperature, dt, p)
    slow[DRAWN] = supply_sag.drawn(slow[DRAWN], current, command, dt, p)
