"""Effects of sampling: held voltages, missed currents, open bridges, jitter."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.measured.measurement import Measurement, voltage_rms
from etb_hil.discrepancy.measured.spectrum import Complex128
from etb_hil.recording.samples import Float64

_JUMPS = 10.0  # times the voltmeter's noise
_OPEN_FOR = 0.02  # s
_QUIET = 2.0  # times the noise and the step of the current's sensor
_ZERO = 0.1  # A, by which the zero of a Hall sensor is off at most, by the data sheets of `current_sensor_offset`
_OTHER = 0.05  # of the back-EMF, by which the unit's may be another than the model's
_CALM_FOR = 0.1  # s of rest in which an angle shows whether it trembles
_CALMEST = 0.02  # of all such times
_SHORT = 0.02  # s
_LIKELY_JITTER = 1e-6  # s
_TELLING = 0.5  # of the noise that such a jitter makes where it is looked for
_ENOUGH = 25  # windows
_SAME = 1e-4  # of a time constant


def held(s: Complex128, dt: float) -> Complex128:
    """Return the spectrum of a zero-order hold over that of its samples."""
    x = s * dt
    x = np.where(np.abs(x) < 1e-9, 1e-9, x)
    return (1.0 - np.exp(-x)) / x


def missed_by_samples(
    s: Complex128, dt: float, resistance: float, inductance: float, delay: float = 0.0, lag: float = 0.0
) -> Complex128:
    """Return what samples of a winding's current miss, over its voltage's spectrum.

    Between two samples the current bends after every voltage step. The samples alone take that for a straight line; at
    2 kHz and a step of 12 V a throttle's torque balance would see ten times its noise. Samples read late by a `delay`
    and a `lag` see another part of each bend, and are taken as shifted back in time.
    """
    back = np.exp(s * delay) * (1.0 + s * lag)
    return held(s, dt) / (resistance + inductance * s) - back * current_in_samples(
        s, dt, resistance, inductance, delay, lag
    )


def current_in_samples(
    s: Complex128, dt: float, resistance: float, inductance: float, delay: float = 0.0, lag: float = 0.0
) -> Complex128:
    """Return the spectrum of a late sampled current over that of its held voltage."""
    winding = inductance / resistance
    if abs(winding - lag) < _SAME * winding:
        lag = (1.0 - _SAME) * winding
    whole = np.floor(delay / dt)
    since = 1.0 + whole - delay / dt  # samples' times from a step of the voltage to the next reading
    z = np.exp(s * dt)
    found = np.ones(len(s), np.complex128)
    for time, share in ((winding, winding / (winding - lag)), (lag, -lag / (winding - lag))):
        if time > 0.0:
            found += share * np.exp(-dt * since / time) * (1.0 - z) / (z - np.exp(-dt / time))
        elif time < 0.0:  # a lag that is undone
            found += share * np.exp(dt * (1.0 - since) / time) * (1.0 - z) / (z * np.exp(dt / time) - 1.0)
    return np.asarray(found * z ** -(whole + 1.0) / resistance)


def until_next(voltage: Float64, is_open: NDArray[np.bool_]) -> Float64:
    """Return the mean voltage (n) until the next sample; back-EMF with an open bridge."""
    ahead = np.concatenate([voltage[1:], voltage[-1:]])
    return np.where(is_open, 0.5 * (voltage + ahead), voltage)


def in_blocks(values: NDArray[Any], samples: int) -> NDArray[Any]:
    """Return a signal (n) by whole blocks (blocks, samples), without what is over."""
    count = len(values) // samples
    return values[: count * samples].reshape(count, samples)


def commanded(measured: Measurement) -> NDArray[np.bool_]:
    """Return where (n - 1) the voltage steps by more than the voltmeter's noise."""
    return np.abs(np.diff(measured.voltage)) > _JUMPS * voltage_rms(measured.sensors)


def open_bridge(measured: Measurement) -> NDArray[np.bool_]:
    """Return where (n) no current has flowed for some time: the bridge is off."""
    if measured.current is None:
        return np.zeros(len(measured), np.bool_)
    return np.asarray(np.sqrt(_mean(measured, measured.current**2)) < _most_of_none(measured))


def back_emf_alone(measured: Measurement, back_emf: float) -> NDArray[np.bool_]:
    """Return where (n) no current flows, whatever the zero of its sensor is.

    The current is quiet there and no larger than such a zero, and the voltage is the back-EMF (`back_emf`, V·s/rad).
    """
    if measured.current is None:
        return np.zeros(len(measured), np.bool_)
    current = _mean(measured, measured.current)
    spread = np.sqrt(np.maximum(_mean(measured, measured.current**2) - current**2, 0.0))
    expected = back_emf * _mean(measured, np.gradient(measured.angle) * measured.rate)
    sensors = measured.sensors
    noise = np.hypot(sensors.voltage_noise, sensors.voltage_step) / np.sqrt(_width(measured))
    is_back_emf = np.abs(_mean(measured, measured.voltage) - expected) < _OTHER * np.abs(expected) + 3.0 * noise
    is_quiet = spread < _most_of_none(measured)
    return np.asarray(is_quiet & (np.abs(current) < _ZERO) & is_back_emf)


def _most_of_none(measured: Measurement) -> float:
    """Return the rms in A that a sensor reads at most where no current flows."""
    return float(_QUIET * np.hypot(measured.sensors.current_noise, measured.sensors.current_step))


def _width(measured: Measurement) -> int:
    """Return how many samples an open bridge lasts at least."""
    return max(3, round(_OPEN_FOR * measured.rate))


def _mean(measured: Measurement, values: Float64) -> Float64:
    """Return the running mean (n) of values over so many samples."""
    width = _width(measured)
    return np.convolve(values, np.full(width, 1.0 / width), "same")


def trembling(angle: Float64, rate: float) -> float:
    """Return the rms of an angle's second differences (rad) where it is calmest."""
    samples = max(round(_CALM_FOR * rate), 2)
    steps = np.diff(angle, 2) / np.sqrt(3.0)
    return float(np.sqrt(np.quantile(np.mean(in_blocks(steps, samples) ** 2, axis=1), _CALMEST)))


def jitter(angle: Float64, rate: float, noise: float) -> float:
    """Return the rms sampling jitter of an angle in s; `noise`: its other noise, rad.

    An angle read at the wrong moment is wrong by its speed. Fourth differences suppress the motion up to what voltage
    steps do to it, and the median over short windows suppresses that.
    """
    samples = max(round(_SHORT * rate), 8)
    velocity = np.diff(angle)[1:-2] * rate
    fourth = np.diff(angle, 4) / np.sqrt(70.0)
    speeds = np.mean(in_blocks(velocity, samples), axis=1)
    left = np.mean(in_blocks(fourth, samples) ** 2, axis=1) - noise**2
    fast = np.abs(speeds) > _TELLING * noise / _LIKELY_JITTER
    if np.count_nonzero(fast) < _ENOUGH:
        return 0.0
    return float(np.sqrt(max(float(np.median(left[fast] / speeds[fast] ** 2)), 0.0)))
