"""A check of whether the samples of a run can be true.

Sensors are compared with each other, with physics, and with the clock.

A verdict says something of a unit only where nothing here speaks against the measurement. What each check sees, and
from which size on, is listed in `docs/reference/faults.md`. The results do not depend on how the stream was cut.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.compiled import njit
from etb_hil.base.modes import Mode
from etb_hil.diagnosis.motor_balance import WINDOW, worst_residual
from etb_hil.diagnosis.result import Reason
from etb_hil.plant.parameters import Model
from etb_hil.recording.samples import Float64, Int64, SampleBlock

# What each bound detects: docs/reference/faults.md. benchmarks/faults_study.py counts what is found and missed, and no
# healthy unit of benchmarks/random_units.py is withheld by one.
TRACKS = 0.03  # rad between both plate tracks
ENCODER = 0.05  # rad between plate and encoder, play and eccentricity of a healthy unit included
OFF_CURRENT = 0.03  # A between two segments with the bridge off
MISSING = 0.05  # share of the time of motion without samples
RATE = 0.3  # share by which the samples may come faster or slower than asked
STEP_NS = 20_000_000  # the least delay of the stamps behind the samples may wander by so much
DRIFT = 1e-3  # and by so much of the time passed: ten times what crystals do

_FEW = 5  # samples in all that may be off: a single bad frame of a burst is ten
_FEW_JUMPS = 2  # one frame with a wrong angle makes three second differences
_LATENCY = 1e-3  # s, a plate sensor's filter behind the encoder
_ACCELERATION = 3.0  # times what the motor's and the springs' torque give
STOPS = 0.05  # rad from a stop the stop accelerates
_FROZEN_NS = 20_000_000
_SURE = 70.0  # exp(-70): chance that noise repeats itself that long
_OFF_WINDOW = 50  # samples, whose mean has a seventh of the sensor's noise
_SETTLE_NS = 100_000_000  # the current has died away, and delayed samples have come
_LAG_WINDOW_NS = 500_000_000

# State: sums and last values.
(
    _BASE, _ENCODER, _ENCODER_BEFORE, _CURRENT, _OFF_SUM, _OFF_LOW, _OFF_HIGH,
    _VOLTAGE_FIRST, _CURRENT_FIRST, _ANGLE_FIRST, _VOLTAGE_SUM, _CURRENT_SUM, _VOLTAGE_LAST, _ROUGH, _FLOATS,
) = range(15)  # fmt: skip
(
    _ROWS, _BASED, _LAST_NS, _STEP_BEFORE, _EQUAL, _EQUAL_FROM, _FROZEN, _TRACKS_OFF, _ENCODER_OFF, _JUMPS, _OFF_N,
    _OFF_FROM, _WINDOW_FROM, _WINDOW_N, _SHORTEST, _PHASE, _MOVING_NS, _MISSING_NS, _LAG_FROM, _LAG_LEAST,
    _LAG_FIRST, _LAG_WORST, _INTS,
) = range(23)  # fmt: skip
_NONE = np.int64(1 << 62)
_BASE_ROWS = 50


class Plausibility:
    """The check of a run's joined samples, which says what speaks against them.

    The check takes them phase by phase.
    """

    def __init__(self, model: Model) -> None:
        throttle, sensors = model.values, model.sensors
        self._gear_ratio = throttle.gear_ratio
        torque = throttle.torque_per_ampere * throttle.voltage_limit / throttle.resistance
        torque += max(throttle.preload_open, throttle.preload_close) + throttle.stiction
        self._bounds = (  # what the compiled pass compares with
            _equal_readings(float(sensors.current_noise), float(sensors.current_step)),  # in a row
            _ACCELERATION * torque / throttle.inertia,  # rad/s²
            2.0 * math.pi / float(sensors.motor_counts_per_turn) / throttle.gear_ratio,  # rad of an encoder's count
            throttle.stop_low + STOPS,
            throttle.stop_high - STOPS,
        )
        self._floats = np.full(_FLOATS, np.nan)
        self._floats[[_BASE, _OFF_SUM, _VOLTAGE_SUM, _CURRENT_SUM]] = 0.0
        self._floats[_OFF_LOW], self._floats[_OFF_HIGH] = math.inf, -math.inf
        self._ints = np.zeros(_INTS, np.int64)
        self._ints[[_SHORTEST, _LAG_LEAST, _LAG_FIRST]] = _NONE
        self._ints[_PHASE] = -1
        self._windows: list[Float64] = []
        self._asks: list[tuple[int, int]] = []
        self._asked_ns, self._asked_from_ns = 0, 0
        self._other_rate: tuple[float, float] | None = None

    def ask(self, rate: float, stamp_ns: int) -> None:
        """Note that samples at `rate` (Hz) were asked for at a stamp (ns).

        This comes before samples of later stamps are pushed.
        """
        self._asks.append((stamp_ns, round(1e9 / rate) if rate > 0.0 else 0))

    def push(self, samples: SampleBlock, phase: int, *, moving: bool) -> None:
        """Take samples of the phase with this number; `moving` where its motion is judged."""
        while self._asks and (cut := int(np.searchsorted(samples.stamp_ns, self._asks[0][0]))) < len(samples):
            self._look(samples.select(slice(cut)), phase, moving=moving)
            samples = samples.select(slice(cut, None))
            self._check_rate()
            asked_at, self._asked_ns = self._asks.pop(0)
            self._asked_from_ns = asked_at + _SETTLE_NS
            self._ints[_SHORTEST] = _NONE
        self._look(samples, phase, moving=moving)

    def _look(self, samples: SampleBlock, phase: int, *, moving: bool) -> None:
        missing = np.full(len(samples), np.nan)
        columns = samples.columns
        encoder = columns["motor_angle"] / self._gear_ratio
        out = np.empty((len(samples), WINDOW))
        closed = _watch(
            samples.time_ns, samples.stamp_ns, columns["motor_current"], encoder,
            columns.get("throttle_angle", missing), columns.get("throttle_angle_2", missing),
            columns.get("motor_voltage", missing),
            columns.get("command_mode", missing) == Mode.OFF, phase, moving,
            self._asked_from_ns, *self._bounds, self._floats, self._ints, out,
        )  # fmt: skip
        if closed:
            self._windows.append(out[:closed].copy())

    def doubts(self) -> list[Reason]:
        """Return what speaks against the samples, the gravest first."""
        self._check_rate()
        s, n = self._floats, self._ints
        found = []
        if n[_TRACKS_OFF] >= _FEW:
            found.append(Reason("tracks_disagree", f"both plate tracks differ by more than "
                                                   f"{math.degrees(TRACKS):.3g} deg in "
                                f"{n[_TRACKS_OFF]} samples"))  # fmt: skip
        if n[_ENCODER_OFF] >= _FEW:
            found.append(Reason("angles_disagree", f"plate and motor encoder differ by more than "
                                                   f"{math.degrees(ENCODER):.3g} deg in "
                                f"{n[_ENCODER_OFF]} samples"))  # fmt: skip
        if n[_JUMPS] > _FEW_JUMPS:
            text = f"the motor angle jumps as no motor can move it, {n[_JUMPS]} times"
            found.append(Reason("angle_jumps", text))
        if n[_FROZEN]:
            found.append(Reason("current_frozen", f"the current reading stands still for {n[_FROZEN]} samples, without "
                                "the sensor's noise"))  # fmt: skip
        apart = s[_OFF_HIGH] - s[_OFF_LOW]
        if apart > OFF_CURRENT:
            found.append(Reason("current_zero_moves", f"with the bridge off the current reads {s[_OFF_LOW]:.3f} to "
                                f"{s[_OFF_HIGH]:.3f} A; {OFF_CURRENT} A apart are allowed"))  # fmt: skip
        if self._windows and (problem := worst_residual(np.concatenate(self._windows))):
            found.append(Reason("motor_balance", problem))
        if n[_MISSING_NS] > MISSING * n[_MOVING_NS]:
            share = n[_MISSING_NS] / n[_MOVING_NS]
            found.append(Reason("samples_missing", f"{share:.1%} of the time of motion has no samples; allowed: "
                                f"{MISSING:.0%}"))  # fmt: skip
        if self._other_rate is not None:
            asked, came = self._other_rate
            text = f"samples came at {came:.0f} Hz; {asked:.0f} Hz were asked for"
            found.append(Reason("not_as_asked", text))
        if n[_LAG_WORST] > 0:
            found.append(Reason("clocks_disagree", f"sample clock and receive stamps part by {n[_LAG_WORST] * 1e-6:.0f}"
                                " ms"))  # fmt: skip
        return found

    def _check_rate(self) -> None:
        shortest = int(self._ints[_SHORTEST])
        if self._asked_ns and shortest != _NONE and abs(shortest - self._asked_ns) > RATE * self._asked_ns:
            self._other_rate = (1e9 / self._asked_ns, 1e9 / shortest)


def _equal_readings(noise: float, step: float) -> int:
    """Return how many equal readings in a row no noise of this size gives.

    The count is 0 where readings may well be equal.
    """
    if noise < 0.5 * step or noise <= 0.0:
        return 0
    chance = step / (noise * 2.0 * math.sqrt(math.pi))  # at most 0.56, here
    return 2 * math.ceil(_SURE / -math.log(chance))


@njit(cache=True, error_model="numpy")
def _watch(
    time_ns: Int64,
    stamp_ns: Int64,
    current: Float64,
    encoder: Float64,
    plate: Float64,
    plate_2: Float64,
    voltage: Float64,
    off: NDArray[np.bool_],
    phase: int,
    moving: bool,
    asked_from_ns: int,
    equal: int,
    acceleration: float,
    step: float,
    low: float,
    high: float,
    s: Float64,
    n: Int64,
    out: Float64,
) -> int:
    """Look at every sample, and return how many windows were closed into `out`.

    They are windows of the motor's voltage balance.
    """
    closed = 0
    for k in range(len(time_ns)):
        if math.isnan(current[k]) or math.isnan(encoder[k]):
            continue
        gap = time_ns[k] - n[_LAST_NS] if n[_ROWS] else np.int64(0)
        if phase != n[_PHASE]:
            n[_PHASE], n[_OFF_FROM], n[_OFF_N], n[_WINDOW_N] = phase, time_ns[k] + _SETTLE_NS, 0, 0
        _clock(time_ns[k], stamp_ns[k], gap, moving, asked_from_ns, n)
        _angles(encoder[k], plate[k], plate_2[k], gap, acceleration, step, low, high, s, n)
        _frozen_current(time_ns[k], current[k], equal, s, n)
        if off[k]:
            _bridge_off(time_ns[k], current[k], s, n)
        else:
            n[_OFF_FROM], n[_OFF_N] = time_ns[k] + _SETTLE_NS, 0
        if math.isnan(voltage[k]):
            n[_WINDOW_N] = 0
        else:
            closed += _window(time_ns[k], gap, current[k], encoder[k], voltage[k], s, n, out[closed])
        s[_ENCODER_BEFORE], s[_ENCODER], s[_CURRENT] = s[_ENCODER], encoder[k], current[k]
        n[_STEP_BEFORE], n[_LAST_NS] = gap, time_ns[k]
        n[_ROWS] += 1
    return closed


@njit(cache=True, error_model="numpy")
def _clock(time_ns: np.int64, stamp_ns: np.int64, gap: np.int64, moving: bool, asked_from: int, n: Int64) -> None:
    """Follow the interval of samples, the time without them, and their least delay.

    The delay is that of the stamps.
    """
    if gap > 0:
        if stamp_ns > asked_from:
            n[_SHORTEST] = min(n[_SHORTEST], gap)
        if moving:
            n[_MOVING_NS] += gap
            if n[_SHORTEST] < _NONE and 2 * gap > 3 * n[_SHORTEST]:
                n[_MISSING_NS] += gap - n[_SHORTEST]
    lag = stamp_ns - time_ns
    if n[_ROWS] == 0:
        n[_LAG_FROM] = time_ns
    n[_LAG_LEAST] = min(n[_LAG_LEAST], lag)
    if time_ns - n[_LAG_FROM] < _LAG_WINDOW_NS:
        return
    if n[_LAG_FIRST] == _NONE:
        n[_LAG_FIRST] = n[_LAG_LEAST]
    passed = n[_ROWS] * (n[_SHORTEST] if n[_SHORTEST] < _NONE else 0)
    moved = abs(n[_LAG_LEAST] - n[_LAG_FIRST])
    if moved > STEP_NS + DRIFT * passed:
        n[_LAG_WORST] = max(n[_LAG_WORST], moved)
    n[_LAG_FROM], n[_LAG_LEAST] = time_ns, _NONE


@njit(cache=True, error_model="numpy")
def _angles(
    encoder: float, plate: float, plate_2: float, gap: np.int64, acceleration: float, step: float, low: float,
    high: float, s: Float64, n: Int64,
) -> None:  # fmt: skip
    """Compare the tracks of the plate sensor with each other and the encoder.

    The encoder is also compared with what a motor can do.
    """
    if abs(plate - plate_2) > TRACKS:
        n[_TRACKS_OFF] += 1
    if not math.isnan(plate):
        if n[_BASED] < _BASE_ROWS:
            s[_BASE] += plate - encoder
            n[_BASED] += 1
        base = s[_BASE] / n[_BASED]
        speed = abs(encoder - s[_ENCODER]) / (gap * 1e-9) if gap > 0 else 0.0
        if abs(plate - encoder - base) > ENCODER + _LATENCY * min(speed, 50.0):
            n[_ENCODER_OFF] += 1
        inside = low < encoder + base < high
    else:
        inside = True
    if n[_ROWS] >= 2 and gap == n[_STEP_BEFORE] and inside:
        dt = gap * 1e-9
        bend = encoder - 2.0 * s[_ENCODER] + s[_ENCODER_BEFORE]
        if abs(bend) > acceleration * dt * dt + 3.0 * step:
            n[_JUMPS] += 1


@njit(cache=True, error_model="numpy")
def _frozen_current(time_ns: np.int64, current: float, equal: int, s: Float64, n: Int64) -> None:
    if current != s[_CURRENT]:  # which is NaN before the first sample
        n[_EQUAL], n[_EQUAL_FROM] = 1, time_ns
        return
    n[_EQUAL] += 1
    if equal and n[_EQUAL] > equal and time_ns - n[_EQUAL_FROM] >= _FROZEN_NS:
        n[_FROZEN] = max(n[_FROZEN], n[_EQUAL])


@njit(cache=True, error_model="numpy")
def _bridge_off(time_ns: np.int64, current: float, s: Float64, n: Int64) -> None:
    """Keep the lowest and the highest mean of the current while the bridge is off."""
    if time_ns < n[_OFF_FROM]:
        return
    if n[_OFF_N] == 0:
        s[_OFF_SUM] = 0.0
    s[_OFF_SUM] += current
    n[_OFF_N] += 1
    if n[_OFF_N] == _OFF_WINDOW:
        mean = s[_OFF_SUM] / _OFF_WINDOW
        s[_OFF_LOW], s[_OFF_HIGH] = min(s[_OFF_LOW], mean), max(s[_OFF_HIGH], mean)
        n[_OFF_N] = 0


@njit(cache=True, error_model="numpy")
def _window(
    time_ns: np.int64, gap: np.int64, current: float, encoder: float, voltage: float, s: Float64, n: Int64, out: Float64
) -> int:
    """Add a sample to a window of the motor's voltage balance.

    A window has the means of voltage, current and velocity, and the slopes of voltage and current. Returns 1 where the
    window was closed into `out`, else 0.
    """
    if n[_WINDOW_N] and 2 * gap > 3 * n[_SHORTEST]:
        n[_WINDOW_N] = 0
    if n[_WINDOW_N] == 0:
        n[_WINDOW_FROM], s[_VOLTAGE_FIRST], s[_CURRENT_FIRST], s[_ANGLE_FIRST] = time_ns, voltage, current, encoder
        s[_VOLTAGE_SUM], s[_CURRENT_SUM], s[_ROUGH] = 0.0, 0.0, 0.0
    else:  # trapezoids
        s[_VOLTAGE_SUM] += 0.5 * (voltage + s[_VOLTAGE_LAST]) * gap
        s[_CURRENT_SUM] += 0.5 * (current + s[_CURRENT]) * gap
        s[_ROUGH] = max(s[_ROUGH], abs(voltage - s[_VOLTAGE_LAST]) * gap)
    s[_VOLTAGE_LAST] = voltage
    n[_WINDOW_N] += 1
    length = time_ns - n[_WINDOW_FROM]
    if length < 20_000_000:
        return 0
    seconds = length * 1e-9
    out[0] = s[_VOLTAGE_SUM] / length
    out[1] = s[_CURRENT_SUM] / length
    out[2] = (encoder - s[_ANGLE_FIRST]) / seconds
    out[3] = (current - s[_CURRENT_FIRST]) / seconds
    out[4] = (voltage - s[_VOLTAGE_FIRST]) / seconds
    out[5] = s[_ROUGH] / length
    n[_WINDOW_N] = 0
    return 1
