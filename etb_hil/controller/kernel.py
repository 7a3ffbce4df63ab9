"""The controller and its plant, compiled, in whole ticks of 50 us.

A call does many milliseconds.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from etb_hil.base.compiled import njit
from etb_hil.base.copying import copy_into
from etb_hil.base.modes import Mode
from etb_hil.controller import events, monitors, reference, sensors, supervision
from etb_hil.controller.drive import drive_voltage
from etb_hil.controller.laws.interface import CONTROL_PERIOD
from etb_hil.controller.state import (
    BURST_SAMPLES,
    CONTROL_TICKS,
    STATUS_TICKS,
    TICK_NS,
    DataSheet,
    Fault,
    Sample,
    Settings,
    State,
    Status,
)
from etb_hil.plant.extended import advance_extended, told_current, told_motor_angle, told_plate
from etb_hil.plant.integrator import CURRENT, OMEGA, THETA, advance
from etb_hil.plant.physics import BACK_EMF, GEAR_RATIO, SUPPLY_VOLTAGE, Vector
from etb_hil.plant.physics import LIMP_HOME as LIMP_HOME_ANGLE

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

LIMP_HOME = int(Mode.LIMP_HOME)
CRC = int(Fault.CRC)
COUNTER = int(Fault.COUNTER)

VELOCITY_SMOOTHING = 0.6  # of the newest difference: one encoder count is 0.02 rad/s at 1 kHz
SLOWEST_ORIGIN = 1000  # ticks over which the plate tracks correct the encoder's origin
ARRIVED = 0.01  # rad
DECAYED = 1e-3  # A


@njit(cache=True, error_model="numpy")
def run_ticks(
    end_tick: int,
    state: NDArray[np.void],
    fixed: NDArray[np.void],
    sheets: NDArray[np.void],
    plant: Vector,
    extended: Vector | None,
    laws: NDArray[np.float64],
    unit: Vector,
    nominal: Vector,
    event_ns: NDArray[np.int64],
    event: NDArray[np.float64],
    samples: NDArray[np.void],
    statuses: NDArray[np.void],
    switches: NDArray[np.void],
    burst: NDArray[np.float64],
) -> tuple[int, int, int, int]:
    """Run every tick before `end_tick`.

    Return how many events were used, and how many samples, statuses and switches were written.

    `state`, `fixed` and `sheets` hold one `State`, `Settings` and `DataSheet` each (`state.record`; a call from Python
    takes an array in a tenth of the time that an element of it takes). `plant` is the integrator's state, `extended`
    the same array where the unit has effects, else None: no effect is compiled then. `unit`, `nominal` are parameter
    vectors, `laws` float64 (2, p) the unit's at the ambient temperature and its change in a kelvin. `event_ns` int64
    (n), `event` float64 (n, `EVENT_WIDTH`) are sorted by stamp. The next three are written to and have room for one
    sample a tick, a status and a control tick; `burst` is room for a frame that is under way.
    """
    s, settings, sheet = state[0], fixed[0], sheets[0]
    used = sampled = stated = switched = 0
    while s.tick < end_tick:
        if s.tick % CONTROL_TICKS == 0:
            now_ns = settings.start_ns + s.tick * TICK_NS
            _measure(s, plant, extended, unit, nominal, sheet)
            while used < len(event_ns) and event_ns[used] <= now_ns:
                events.apply_event(s, settings, now_ns, event_ns[used], event[used])
                used += 1
            switched_now = _control(s, settings, sheet, plant, extended, unit, nominal, now_ns)
            monitors.watch(s, nominal)
            if switched_now:
                switch = switches[switched]
                switch.tick, switch.on, switch.mode = s.tick, s.driving, s.mode
                switch.faults, switch.command_ns = s.faults, s.command_ns
                switched += 1
            if s.tick % STATUS_TICKS == 0:
                _warm(s, settings, unit, laws)
                _state(s, unit, statuses[stated])
                stated += 1
        sampling = s.sample_ticks > 0
        if sampling and s.tick >= s.sample_end and s.tick % BURST_SAMPLES == 0:
            s.sample_ticks, sampling = 0, False
        if sampling and s.tick % s.sample_ticks == 0:
            sampled += _sample(s, plant, extended, unit, sheet, samples[sampled], burst)
        # Up to the next tick at which something happens, even past the end: the plant must not feel how time is cut.
        next_tick = (s.tick // CONTROL_TICKS + 1) * CONTROL_TICKS
        if sampling:
            next_tick = min(next_tick, (s.tick // s.sample_ticks + 1) * s.sample_ticks)
        if extended is None:
            advance(plant, unit, s.voltage, next_tick - s.tick)
        else:
            advance_extended(extended, unit, s.voltage, next_tick - s.tick, s.temperature)
        s.tick = next_tick
    return used, sampled, stated, switched


@njit(cache=True, error_model="numpy")
def _control(
    s: State,
    settings: Settings,
    sheet: DataSheet,
    plant: Vector,
    extended: Vector | None,
    unit: Vector,
    nominal: Vector,
    now_ns: int,
) -> bool:
    """Do one control tick; return whether the bridge was switched on or off."""
    s.current = sensors.measured_current(_current(s, plant, extended, unit), s.tick, sheet)
    supervision.warm_up(s, settings, unit, plant[CURRENT], CONTROL_PERIOD)
    supervision.watch(s, now_ns)
    supervision.protect(s, s.current, nominal)
    _show_refusals(s)
    was = s.driving
    s.driving = 1 if s.mode != 0 and not s.released and supervision.may_drive(s) else 0
    if not s.driving:
        s.voltage = math.nan
        return was != s.driving
    if not was:
        s.law_memory[:] = 0.0
    if s.mode != events.VOLTAGE:
        reference.step(s, settings, nominal, now_ns)
    s.voltage = drive_voltage(s, settings, nominal)
    if s.mode == LIMP_HOME and s.velocity == 0.0 and abs(s.measured_position - nominal[LIMP_HOME_ANGLE]) < ARRIVED:
        s.released = 1
    return was != s.driving


@njit(cache=True, error_model="numpy")
def _measure(s: State, plant: Vector, extended: Vector | None, unit: Vector, nominal: Vector, sheet: DataSheet) -> None:
    """Read encoder and plate tracks.

    The tracks say, slowly, where the encoder's origin is.
    """
    encoder = sensors.encoder_angle(_motor_angle(plant, extended, unit), sheet) / nominal[GEAR_RATIO]
    s.track, s.track_2 = track, track_2 = sensors.track_angles(_plate_angle(plant, extended, unit), s.tick, sheet)
    s.origin_samples = min(s.origin_samples + 1, SLOWEST_ORIGIN)
    s.encoder_origin += (0.5 * (track + track_2) - encoder - s.encoder_origin) / s.origin_samples
    velocity = (encoder - s.encoder) / CONTROL_PERIOD
    s.measured_velocity += VELOCITY_SMOOTHING * (velocity - s.measured_velocity)
    s.encoder = encoder
    s.measured_position = encoder + s.encoder_origin


@njit(cache=True, error_model="numpy")
def _show_refusals(s: State) -> None:
    s.faults = s.faults | CRC if s.tick < s.crc_until else s.faults & ~CRC
    s.faults = s.faults | COUNTER if s.tick < s.counter_until else s.faults & ~COUNTER


@njit(cache=True, error_model="numpy")
def _sample(
    s: State,
    plant: Vector,
    extended: Vector | None,
    unit: Vector,
    sheet: DataSheet,
    sample: Sample,
    burst: NDArray[np.float64],
) -> bool:
    """Sample this instant.

    Return whether it completed the sample, which only the last one of a burst does.

    The voltage is the one that the bridge gives from this instant on.
    """
    index = s.tick % BURST_SAMPLES if s.burst else 0
    burst[0, index] = sensors.measured_current(_current(s, plant, extended, unit), s.tick, sheet)
    burst[1, index] = sensors.encoder_angle(_motor_angle(plant, extended, unit), sheet)
    if index == 0:
        burst[2, 0] = sensors.measured_voltage(_terminal_voltage(s, plant, unit), s.tick, sheet)
        burst[2, 1], burst[2, 2] = sensors.track_angles(_plate_angle(plant, extended, unit), s.tick, sheet)
    if s.burst and index < BURST_SAMPLES - 1:
        return False
    sample.tick, sample.last_tick, sample.signals, sample.burst = s.tick - index, s.tick, s.signals, s.burst
    copy_into(sample.current, 0, burst[0])
    copy_into(sample.motor_angle, 0, burst[1])
    sample.voltage, sample.track, sample.track_2 = burst[2, 0], burst[2, 1], burst[2, 2]
    return True


@njit(cache=True, error_model="numpy")
def _current(s: State, plant: Vector, extended: Vector | None, unit: Vector) -> float:
    """Return what the current sensor is given in A."""
    return plant[CURRENT] if extended is None else told_current(extended, s.temperature, unit)


@njit(cache=True, error_model="numpy")
def _motor_angle(plant: Vector, extended: Vector | None, unit: Vector) -> float:
    """Return what the encoder is given in rad."""
    return plant[THETA] * unit[GEAR_RATIO] if extended is None else told_motor_angle(extended, unit)


@njit(cache=True, error_model="numpy")
def _plate_angle(plant: Vector, extended: Vector | None, unit: Vector) -> float:
    """Return what the plate sensor is given in rad."""
    return plant[THETA] if extended is None else told_plate(extended, unit)


@njit(cache=True, error_model="numpy")
def _terminal_voltage(s: State, plant: Vector, unit: Vector) -> float:
    """Return the voltage over the motor.

    With the bridge open the diodes', then the motor's own as a generator.
    """
    if not math.isnan(s.voltage):
        return s.voltage
    if abs(plant[CURRENT]) > DECAYED:
        return -math.copysign(unit[SUPPLY_VOLTAGE], plant[CURRENT])
    return unit[BACK_EMF] * plant[OMEGA]


@njit(cache=True, error_model="numpy")
def _warm(s: State, settings: Settings, unit: Vector, laws: NDArray[np.float64]) -> None:
    """Bring the unit's parameters to the housing's temperature."""
    above = s.temperature - settings.ambient
    for index in range(len(unit)):
        unit[index] = laws[0, index] + above * laws[1, index]


@njit(cache=True, error_model="numpy")
def _state(s: State, unit: Vector, status: Status) -> None:
    status.tick, status.mode, status.enable, status.faults = s.tick, s.mode, s.driving, s.faults
    status.temperature, status.supply = s.temperature, unit[SUPPLY_VOLTAGE]
