"""The one integrator of the plant, compiled, in whole ticks.

Ticks are of 50 us, or of another length for fits.

The integrator is of second order, and stable however stiff the bristles.

`step.py` holds the scheme. Here its steps are cut where a stop is met or left and where the freewheeling current ends,
so that no step runs over a jump.
"""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.plant.armature import NO_CURRENT, answer
from etb_hil.plant.contact import change_of_contact, contact_of, first_root
from etb_hil.plant.physics import (
    BACK_EMF,
    BRISTLE_STIFFNESS,
    DEAD_ZONE,
    INDUCTANCE,
    INERTIA,
    LIMP_HOME,
    RESISTANCE,
    STRIBECK_VELOCITY,
    SUPPLY_VOLTAGE,
    VOLTAGE_LIMIT,
    Values,
    Vector,
    registers,
)
from etb_hil.plant.step import step

TICK_NS = 50_000
TICK = 50e-6

THETA = 0
OMEGA = 1
BRISTLE = 2
CURRENT = 3
STATES = 4

_INSTANT = 1e-15  # s; too short for anything to move
_CUTS = 16  # in one tick; more would be chatter below what the step resolves
_SLOW = 0.05  # rad/s; faster than this the plate bounces on a stop, slower it rests there
_FAST = 0.05  # dead zones in a tick; slower than this the springs' jump is smooth enough


def new_state(theta: float) -> Vector:
    """Return the state of a throttle at rest at an angle in rad.

    The state is float64 (`STATES`), with bristles and current at zero.
    """
    state = np.zeros(STATES)
    state[THETA] = theta
    return state


@njit(cache=True, error_model="numpy", forceinline=True)
def _stride(theta: float, omega: float, contact: float, left: float, length: float, p: Values) -> float:
    """Return how far to step.

    The step is to the end of a tick of `length` s, less while a stop throws back or limp-home flies past.
    """
    travel = length * abs(omega)
    if contact != 0.0:
        fine = abs(omega) > _SLOW
    else:
        fine = travel > _FAST * p[DEAD_ZONE] and abs(theta - p[LIMP_HOME]) < p[DEAD_ZONE] + travel
    return min(left, 0.25 * length) if fine else left


@njit(cache=True, error_model="numpy")
def _end_of_current(omega: float, current: float, current_end: float, u: float, h: float, p: Values) -> float:
    """Return when in 0 ... h a freewheeling current is zero.

    The current changes its sign in that time.
    """
    rate = (u - p[RESISTANCE] * current - p[BACK_EMF] * omega) / p[INDUCTANCE]
    return first_root(current, rate, 2.0 * (current_end - current - rate * h) / (h * h), h)


@njit(cache=True, error_model="numpy")
def _run(  # noqa: C901 (one loop that must stay in registers)
    state: Vector,
    parameters: Vector,
    elastic: float,
    voltage: float,
    ticks: int,
    length: float,
    record: Vector,
    row: int,
) -> None:
    """Move `state` by whole ticks of `length` s.

    From `row` on, where that is not negative, write it to `record` after each.

    `elastic`: that of `bristle.bend`, 0 for LuGre friction.
    """
    p = registers(parameters)
    inverse = (1.0 / p[INERTIA], 1.0 / p[INDUCTANCE], 1.0 / p[STRIBECK_VELOCITY], 1.0 / p[BRISTLE_STIFFNESS])
    theta, omega, bristle, current = state[THETA], state[OMEGA], state[BRISTLE], state[CURRENT]
    is_open = np.isnan(voltage)
    conducts = not is_open or current != 0.0
    u = min(max(voltage, -p[VOLTAGE_LIMIT]), p[VOLTAGE_LIMIT])
    if is_open:
        u = -p[SUPPLY_VOLTAGE] if current > 0.0 else p[SUPPLY_VOLTAGE]
    whole = answer(length, p) if conducts else NO_CURRENT
    for tick in range(ticks):
        left = length
        contact = contact_of(theta, omega, p)
        for cut in range(_CUTS):
            last = cut == _CUTS - 1
            h = left if last else _stride(theta, omega, contact, left, length, p)
            armature = whole if h == length else answer(h, p) if conducts else NO_CURRENT
            end = step(theta, omega, bristle, current, h, u, armature, contact, inverse, elastic, p)
            part, contact_new, is_gone = h, contact, False
            if not last:
                part, contact_new = change_of_contact(theta, omega, contact, end[0], end[1], h, p)
                if is_open and conducts and end[3] * current <= 0.0:
                    gone = _end_of_current(omega, current, end[3], u, h, p)
                    is_gone = gone <= part
                    part, contact_new = (gone, contact) if gone < part else (part, contact_new)
            if part > _INSTANT:
                if part < h:
                    armature = answer(part, p) if conducts else NO_CURRENT
                    end = step(theta, omega, bristle, current, part, u, armature, contact, inverse, elastic, p)
                theta, omega, bristle, current = end
            contact = contact_new
            if is_gone:
                current, conducts, whole = 0.0, False, NO_CURRENT
            left -= part
            if left <= _INSTANT:
                break
        if row >= 0:
            record[row + tick, THETA] = theta
            record[row + tick, OMEGA] = omega
            record[row + tick, BRISTLE] = bristle
            record[row + tick, CURRENT] = current
    state[THETA], state[OMEGA], state[BRISTLE], state[CURRENT] = theta, omega, bristle, current


@njit(cache=True, error_model="numpy")
def advance_bristles(state: Vector, p: Vector, elastic: float, voltage: float, ticks: int, length: float) -> None:
    """Move `state` as `advance` does, with bristles that are elastic at first.

    They are up to a share of friction; see `bristle`. Ticks are `length` s long.
    """
    _run(state, p, elastic, voltage, ticks, length, state.reshape((1, -1)), -1)


@njit(cache=True, error_model="numpy")
def advance(state: Vector, p: Vector, voltage: float, ticks: int) -> None:
    """Move `state` in place by whole ticks of 50 us under a constant voltage.

    The voltage is in V; NaN is an open bridge.

    The voltage is limited to what the bridge gives. With the bridge open, the diodes put the supply against the
    current until it is gone; a back-EMF above the supply is not modelled.
    """
    advance_bristles(state, p, 0.0, voltage, ticks, TICK)


@njit(cache=True, error_model="numpy")
def advance_record(state: Vector, p: Vector, voltages: Vector, ticks: int, record: Vector) -> None:
    """Move `state` under each voltage (n) for so many ticks; keep every tick.

    `record` (n * ticks, `STATES`) takes the state after each tick. Per tick this costs half of calling `advance`.
    """
    for k in range(len(voltages)):
        _run(state, p, 0.0, voltages[k], ticks, TICK, record, k * ticks)
