"""What evenly spaced samples say of the signals between them: voltages held, currents missed, open bridges, tremor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.sheet import voltage_rms

Float64 = NDArray[np.float64]
Complex128 = NDArray[np.complex128]

_JUMPS = 10.0  # times the voltmeter's noise
_OPEN_FOR = 0.02  # s
_CALM_FOR = 0.1  # s of rest in which an angle shows whether it trembles
_CALMEST = 0.02  # of all such times
_SHORT = 0.02  # s
_LIKELY_JITTER = 1e-6  # s
_TELLING = 0.5  # of the noise that such a jitter makes where it is looked for
_ENOUGH = 25  # windows
_SAME = 1e-4  # of a time constant


def held(s: Complex128, dt: float) -> Complex128:
    """Return what a signal that is held from sample to sample has of the spectrum of its samples."""
    x = s * dt
    x = np.where(np.abs(x) < 1e-9, 1e-9, x)
    return (1.0 - np.exp(-x)) / x


def missed_by_rows(
    s: Complex128, dt: float, resistance: float, inductance: float, delay: float = 0.0, lag: float = 0.0
) -> Complex128:
    """Return what samples of a winding's current miss of it, over the spectrum of the samples of its held voltage.

    Between two samples the current bends after every step of the voltage. Its samples alone take that for a straight
    line; at 2 kHz and a step of 12 V a throttle's torque balance would see ten times its noise. Samples that are
    read late by a
    `delay` and a `lag` see another part of each bend, and are taken to have been put back in time.
    """
    back = np.exp(s * delay) * (1.0 + s * lag)
    return held(s, dt) / (resistance + inductance * s) - back * in_rows(s, dt, resistance, inductance, delay, lag)


def in_rows(
    s: Complex128, dt: float, resistance: float, inductance: float, delay: float = 0.0, lag: float = 0.0
) -> Complex128:
    """Return the spectrum of a winding's current in its rows, read late, over that of the rows of its held voltage."""
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
    """Return the mean voltage (n) from each row to the next: as set, but with the bridge off what the motor gives."""
    ahead = np.concatenate([voltage[1:], voltage[-1:]])
    return np.where(is_open, 0.5 * (voltage + ahead), voltage)


def commanded(measured: Measurement) -> NDArray[np.bool_]:
    """Return where (n - 1) the voltage steps from a sample to the next by more than its meter's noise can."""
    return np.abs(np.diff(measured.voltage)) > _JUMPS * voltage_rms(measured.sensors)


def open_bridge(measured: Measurement) -> NDArray[np.bool_]:
    """Return where (n) no current has flown for some time: with the bridge off its losses are none."""
    if measured.current is None:
        return np.zeros(len(measured), np.bool_)
    width = max(3, round(_OPEN_FOR * measured.rate))
    rms = np.sqrt(np.convolve(measured.current**2, np.full(width, 1.0 / width), "same"))
    return rms < 2.0 * np.hypot(measured.sensors.current_noise, measured.sensors.current_step)


def trembling(angle: Float64, rate: float) -> float:
    """Return the rms of an angle's steps (rad) from row to row, the motion's left out, where it is at its calmest."""
    rows = max(round(_CALM_FOR * rate), 2)
    steps = np.diff(angle, 2) / np.sqrt(3.0)
    each = steps[: len(steps) // rows * rows].reshape(-1, rows)
    return float(np.sqrt(np.quantile(np.mean(each**2, axis=1), _CALMEST)))


def jitter(angle: Float64, rate: float, noise: float) -> float:
    """Return the rms in s by which an angle's samples are early or late; `noise`: what else the angle (rad) has, rms.

    An angle that is read at the wrong moment is wrong by its speed. Fourth differences leave nothing of a motion but
    what steps of the voltage do to it, and the median over short windows not even those.
    """
    rows = max(round(_SHORT * rate), 8)
    velocity = np.diff(angle)[1:-2] * rate
    fourth = np.diff(angle, 4) / np.sqrt(70.0)
    count = len(fourth) // rows
    speeds = np.mean(velocity[: count * rows].reshape(count, rows), axis=1)
    left = np.mean(fourth[: count * rows].reshape(count, rows) ** 2, axis=1) - noise**2
    fast = np.abs(speeds) > _TELLING * noise / _LIKELY_JITTER
    if np.count_nonzero(fast) < _ENOUGH:
        return 0.0
    return float(np.sqrt(max(float(np.median(left[fast] / speeds[fast] ** 2)), 0.0)))
