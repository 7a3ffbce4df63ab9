"""Supervision that switches the bridge off whatever the set-points say.

This is the watchdog and the controller's own protections.
"""

from __future__ import annotations

from etb_hil.base.compiled import njit
from etb_hil.controller.state import CONTROL_NS, LATCHED, WATCHDOG_NS, Fault, Settings, State
from etb_hil.plant.physics import RESISTANCE, VOLTAGE_LIMIT, Vector

# As production controllers do (P2118): 11 A for 200 ms, or more than 80 % of the voltage for 5 s.
OVER_CURRENT_A, OVER_CURRENT_MS = 11.0, 200
OVER_DUTY, OVER_DUTY_MS = 0.8, 5000
OVER_TEMPERATURE_C = 125.0

TIMEOUT = int(Fault.TIMEOUT)
OVER_CURRENT = int(Fault.OVER_CURRENT)
OVER_TEMPERATURE = int(Fault.OVER_TEMPERATURE)


@njit(cache=True, error_model="numpy")
def watch(s: State, now_ns: int) -> None:
    """Latch a time-out `WATCHDOG_NS` after the last good command, at the latest.

    The latch is at the last control tick that keeps this promise.
    """
    if s.driving and now_ns + CONTROL_NS - s.command_ns > WATCHDOG_NS:
        s.faults |= TIMEOUT


@njit(cache=True, error_model="numpy")
def protect(s: State, current: float, nominal: Vector) -> None:
    """Latch a fault where a measured value has been too high for too long.

    The value is the current (A), the voltage, or the housing's temperature.
    """
    s.over_current_ms = s.over_current_ms + 1 if abs(current) > OVER_CURRENT_A else 0
    s.over_duty_ms = s.over_duty_ms + 1 if abs(s.voltage) > OVER_DUTY * nominal[VOLTAGE_LIMIT] else 0
    if s.over_current_ms >= OVER_CURRENT_MS or s.over_duty_ms >= OVER_DUTY_MS:
        s.faults |= OVER_CURRENT
    if s.temperature > OVER_TEMPERATURE_C:
        s.faults |= OVER_TEMPERATURE


@njit(cache=True, error_model="numpy")
def may_drive(s: State) -> bool:
    """Return whether no latched fault keeps the bridge open."""
    return s.faults & LATCHED == 0


@njit(cache=True, error_model="numpy")
def warm_up(s: State, settings: Settings, unit: Vector, current: float, seconds: float) -> None:
    """Move the housing's temperature by one step.

    The motor's loss goes through one thermal resistance and capacity.
    """
    target = settings.ambient + settings.heating * unit[RESISTANCE] * current * current
    s.temperature += (target - s.temperature) * seconds / settings.heating_time
