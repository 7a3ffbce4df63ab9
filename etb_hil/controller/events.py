"""Effects of commands, requests and refused frames at a control tick."""

from __future__ import annotations

import math

from etb_hil.base.compiled import njit
from etb_hil.base.modes import Mode
from etb_hil.controller import reference
from etb_hil.controller.state import (
    BURST_SAMPLES,
    COMMAND,
    CONTROL_NS,
    LATCHED,
    REFUSED_CRC,
    REQUEST,
    SAMPLE_RATE,
    Settings,
    State,
)
from etb_hil.plant.physics import Vector

OFF = int(Mode.OFF)
VOLTAGE = int(Mode.VOLTAGE)
LIMP_HOME = int(Mode.LIMP_HOME)

SHOW_TICKS = 2000  # a refused frame shows in the status for 100 ms
SMOOTHING = 0.25  # of the newest command interval in the mean
LONGEST = 30e-3  # s, a longer pause is no interval: the watchdog has come between


@njit(cache=True, error_model="numpy")
def apply_event(s: State, settings: Settings, now_ns: int, stamp_ns: int, event: Vector) -> None:
    """Take one event that was received at `stamp_ns`, at the tick of `now_ns`.

    The event is float64 (`EVENT_WIDTH`); the tick is a control tick.
    """
    kind = int(event[0])
    if kind == COMMAND:
        _command(s, now_ns, stamp_ns, event)
    elif kind == REQUEST:
        _request(s, settings, event)
    elif kind == REFUSED_CRC:
        s.crc_until = s.tick + SHOW_TICKS
    else:
        s.counter_until = s.tick + SHOW_TICKS


@njit(cache=True, error_model="numpy")
def _command(s: State, now_ns: int, stamp_ns: int, event: Vector) -> None:
    mode = int(event[1])
    wants_drive = event[2] > 0.0 and OFF < mode <= LIMP_HOME
    since = (stamp_ns - s.command_ns) * 1e-9
    if s.has_command and since < LONGEST:
        s.interval += SMOOTHING * (since - s.interval)
    s.command_ns = stamp_ns
    s.has_command = 1
    if not wants_drive:
        s.mode = OFF
        s.faults &= ~LATCHED
        return
    if mode != s.mode:
        s.mode = mode
        s.released = 0
        reference.restart(s, stamp_ns)
    if mode == VOLTAGE:
        s.setpoint_voltage = event[5]
    else:
        reference.aim(s, max(stamp_ns, now_ns - CONTROL_NS), event[3], event[4])


@njit(cache=True, error_model="numpy")
def _request(s: State, settings: Settings, event: Vector) -> None:
    """Signals, rate in Hz, burst, duration in s.

    Without a signal, a rate or a frame for it the measurement ends.
    """
    signals, rate, duration = int(event[1]), event[2], event[4]
    s.burst = settings.has_burst if event[3] > 0.0 else 0
    if signals == 0 or not (s.burst or (rate > 0.0 and settings.has_single)):
        s.sample_ticks = 0
        return
    s.signals = signals
    s.sample_ticks = 1 if s.burst else max(int(SAMPLE_RATE / rate + 0.5), 1)
    if duration > 0.0:
        frames = math.ceil(duration * SAMPLE_RATE / BURST_SAMPLES)
        s.sample_end = s.tick + int(frames) * BURST_SAMPLES
    else:
        s.sample_end = 1 << 62
