"""State of the controller from tick to tick, and its constants.

The classes below are the fields of records: elements of a numpy array that compiled code reads and writes by name.
Ticks count 50 us from power-on; angles are at the throttle shaft and in rad unless a field says otherwise.
"""

from __future__ import annotations

from enum import IntFlag
from typing import Annotated, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

from etb_hil.controller.laws.interface import GAINS, MEMORY

TICK_NS = 50_000  # plant and sampling, 20 kHz
CONTROL_TICKS = 20  # 1 kHz
STATUS_TICKS = 200  # 100 Hz
BURST_SAMPLES = 10
SAMPLE_RATE = 20_000
CONTROL_NS = CONTROL_TICKS * TICK_NS

WATCHDOG_NS = 30_000_000  # the bridge is off at the latest this long after the last good command

# What happens to the controller from outside, one row an event: kind, then its values.
COMMAND = 0  # mode, enable, position, velocity, voltage
REQUEST = 1  # signals, rate, burst, duration
REFUSED_CRC = 2
REFUSED_COUNTER = 3
EVENT_WIDTH = 6

CURRENT_SIGNALS, ENCODER_SIGNALS = 1, 2  # bits of a request


class Fault(IntFlag):
    """Fault bits of the status frame, as `dbc/` lists them.

    A refused command frame shows for 100 ms; the others hold until a command takes the drive off.
    """

    TIMEOUT = 1
    CRC = 2
    COUNTER = 4
    OVER_CURRENT = 8
    OVER_TEMPERATURE = 64


LATCHED = int(Fault.TIMEOUT | Fault.OVER_CURRENT | Fault.OVER_TEMPERATURE)


class State:
    """What changes from tick to tick."""

    tick: int
    mode: int
    driving: int  # 1 while the bridge is on
    released: int  # 1 once limp-home mode has done its work, or the law has failed
    faults: int
    crc_until: int  # ticks until which a refused frame shows in the status
    counter_until: int
    command_ns: int  # stamp of the last good command
    has_command: int
    interval: float  # s between good commands, smoothed
    setpoint_voltage: float
    # a segment of the reference: from where it was to the newest set-point
    segment_ns: int
    segment: float  # s
    start_position: float
    start_velocity: float
    end_position: float
    end_velocity: float
    position: float  # the reference now
    velocity: float
    acceleration: float
    # what the sensors said
    encoder: float  # throttle angle since power-on
    encoder_origin: float  # throttle angle at power-on, learnt from the plate tracks
    origin_samples: int
    measured_position: float
    measured_velocity: float
    voltage: float  # V over the motor, NaN with the bridge open
    law_memory: Annotated[NDArray[np.float64], MEMORY]
    law_failed: int  # 1 once the law's torque is not finite
    law_refused: Annotated[NDArray[np.float64], 3]  # its error in rad, its rate in rad/s and its torque in N·m
    over_current_ms: int
    over_duty_ms: int
    temperature: float  # degC of the housing
    # what the trouble codes' tests have seen (`monitors.py`), and for how many ms
    track: float
    track_2: float
    current: float
    far_ms: int
    stuck_ms: int
    apart_ms: int
    off_ms: int
    failing: int
    failed: int  # since the codes were cleared
    tested: int
    # the measurement that is under way
    sample_ticks: int  # between samples, 0 when nothing is asked for
    sample_end: int  # first tick without samples
    signals: int
    burst: int


class Settings:
    """What never changes while the controller runs."""

    start_ns: int
    has_single: int  # 1 where the dialect has frames of one sample
    has_burst: int  # 1 where it has frames of a burst
    law: int
    gain: Annotated[NDArray[np.float64], GAINS]
    braking: float  # rad/s², what the bridge can do against the motion on approach to a stop
    ambient: float  # degC
    heating: float  # K/W, housing over ambient
    heating_time: float  # s


class DataSheet:
    """One set of sensors; the encoder at the motor shaft."""

    encoder_step: float  # rad a count
    encoder_phase: float  # where inside a count the motor stood at power-on, 0 to 1
    encoder_zero: float  # motor angle at power-on: the encoder is incremental
    track_step: float  # rad a bit
    track_low: float
    track_high: float
    track_noise: float  # rad rms
    track_2_offset: float  # rad that the second track is off by: a fault
    current_step: float  # A
    current_noise: float  # A rms
    voltage_step: float  # V
    voltage_noise: float  # V rms
    seed: int


class Sample:
    """What measuring frames are made from.

    The source is one sampled instant, or the instants of one burst frame.

    Voltage and tracks are those of the first instant.
    """

    tick: int  # of the first instant
    last_tick: int
    signals: int
    burst: int
    voltage: float  # V
    track: float
    track_2: float
    current: Annotated[NDArray[np.float64], BURST_SAMPLES]  # A; one instant fills the first only
    motor_angle: Annotated[NDArray[np.float64], BURST_SAMPLES]  # motor shaft, since power-on


class Status:
    """What the status frame says."""

    tick: int
    mode: int
    enable: int
    faults: int
    temperature: float  # degC
    supply: float  # V


class Switch:
    """The bridge went on or off."""

    tick: int
    on: int
    mode: int
    faults: int
    command_ns: int


def record(kind: type, count: int = 1) -> NDArray[np.void]:
    """Return zeroed records (n) with the fields of one of the classes above.

    Fields are int64, float64 and float64 (m).
    """
    fields: list[tuple[str, type, tuple[int, ...]]] = []
    for name, hint in get_type_hints(kind, include_extras=True).items():
        if hint in (int, float):
            fields.append((name, np.int64 if hint is int else np.float64, ()))
        else:
            fields.append((name, np.float64, (get_args(hint)[1],)))
    return np.zeros(count, np.dtype(fields, align=True))
