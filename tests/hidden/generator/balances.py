"""Torque, voltage and angle balance of a measured table under known base parameters: what no term explains is left.

Every signal passes the same low-pass, derivatives are taken in the frequency domain, and the bristle moves with the
encoder's increments.
"""

import math

import numpy as np
from scipy.ndimage import maximum_filter1d

from generator import layout as at
from generator.compiled import compiled
from generator.springs import spring_torque, stop_torque

PASS, STOP = 60.0, 90.0  # Hz
OUTPUT_RATE = 250.0  # Hz
_ENDS = 0.3  # s that are dropped at both ends
_BRISTLE_BAND = 300.0  # Hz: smoothing of the encoder before the bristle sees it
CHANNELS = ("torque", "torque_at_stops", "voltage", "angle")
BREAKING_AWAY = "torque_breaking_away"


def balances(table, p, rate):
    """Residuals by channel (N·m, N·m, V, rad), at 250 Hz; the torque is split into off and at the stops.

    BREAKING_AWAY repeats the rows of the torque in which the plate leaves a rest: too few to show in the whole.
    """
    gear = p[at.N]
    angle = table["motor_angle"] / gear
    voltage, current = table["motor_voltage"], table["motor_current"]
    held = 0.5 * (voltage + np.concatenate([voltage[:1], voltage[:-1]]))
    inertia = gear * gear * p[at.J_MOTOR] + p[at.J_PLATE]
    spectrum = _Spectrum(angle.size, rate)
    smooth, velocity = spectrum.smoothed(angle)
    passive = np.empty(angle.size)
    _passive_torque(smooth, velocity, passive, 1.0 / rate, p, np.zeros((len(at.EFFECTS), at.ROW_WIDTH)))
    torque = spectrum.low(p[at.K] * gear * current - passive) - inertia * spectrum.low(angle, 2)
    residual_voltage = (
        spectrum.low(held - p[at.R] * current)
        - p[at.L] * spectrum.low(current, 1)
        - p[at.K] * gear * spectrum.low(angle, 1)
    )
    residual_angle = spectrum.low(table["throttle_angle"] - angle)
    off, stops = split_at_stops(torque, smooth, p, rate)
    kept = _kept(rate)
    return {
        "torque": off,
        "torque_at_stops": stops,
        BREAKING_AWAY: np.where(leaves_rest(velocity, rate)[kept], off, 0.0),
        "voltage": residual_voltage[kept],
        "angle": residual_angle[kept],
    }


def split_at_stops(torque, angle, p, rate):
    """Torque off the stops and torque at the stops, each zero where the other holds, at 250 Hz."""
    kept = _kept(rate)
    near = near_stops(angle, p, rate)[kept]
    return np.where(near, 0.0, torque[kept]), np.where(near, torque[kept], 0.0)


def low_passed(signals, rate):
    """The balances' low-pass on rows of signals, the voltage-like second one cut to 250 Hz."""
    spectrum = _Spectrum(signals.shape[1], rate)
    return spectrum.low(signals[0]), spectrum.low(signals[1])[_kept(rate)]


def _kept(rate):
    return slice(round(_ENDS * rate), -round(_ENDS * rate), round(rate / OUTPUT_RATE))


def near_stops(angle, p, rate):
    """Rows within 10 mrad of a stop or within 40 ms of such a row."""
    near = (angle > p[at.STOP_HIGH] - 0.01) | (angle < p[at.STOP_LOW] + 0.01)
    return maximum_filter1d(near, 2 * round(0.04 * rate) + 1)


def leaves_rest(velocity, rate):
    """Rows within 40 ms of the end of a rest of at least 60 ms."""
    moving = np.abs(velocity) > 0.04
    rested = ~maximum_filter1d(moving, round(0.06 * rate), origin=round(0.03 * rate) - 1)
    starts = moving[1:] & rested[:-1]
    return maximum_filter1d(np.concatenate([[False], starts]), 2 * round(0.04 * rate) + 1)


def root_mean_square(values):
    """Rms over the rows that belong to a channel (those that are not exactly zero)."""
    inside = values != 0.0
    return float(np.sqrt(np.mean(values[inside] ** 2))) if inside.any() else 0.0


class _Spectrum:
    """Derivatives and low-pass of long records, their trend taken off so that the ends meet."""

    def __init__(self, count, rate):
        self._count = count
        self._padded = 1 << (count - 1).bit_length()
        self._padded = self._padded if self._padded < 1.3 * count else _smooth_length(count)
        self._rate = rate
        frequency = np.fft.rfftfreq(self._padded, 1.0 / rate)
        self._s = 2j * np.pi * frequency
        x = np.clip((frequency - PASS) / (STOP - PASS), 0.0, 1.0)
        self._low = 0.5 + 0.5 * np.cos(np.pi * x)
        self._bristle = np.exp(-0.5 * (frequency / _BRISTLE_BAND) ** 2)

    def _transformed(self, values):
        bridge = np.linspace(values[-1], values[0], self._padded - self._count + 2)[1:-1]
        return np.fft.rfft(np.concatenate([values, bridge]))

    def low(self, values, order=0):
        """Low-passed values, or their derivative of an order."""
        return np.fft.irfft(self._transformed(values) * self._low * self._s**order, self._padded)[: self._count]

    def smoothed(self, angle):
        """Lightly smoothed angle and its velocity."""
        spectrum = self._transformed(angle) * self._bristle
        both = np.fft.irfft(np.stack([spectrum, spectrum * self._s]), self._padded)
        return both[0, : self._count], both[1, : self._count]


def _smooth_length(count):
    """A length of at least `count` whose factors are 2, 3 and 5."""
    length = count
    while True:
        rest = length
        for factor in (2, 3, 5):
            while rest % factor == 0:
                rest //= factor
        if rest == 1:
            return length
        length += 1


@compiled()
def _passive_torque(angle, velocity, out, dt, p, e):
    """Friction, springs and stops along a measured motion; the bristle follows the way covered, exactly."""
    nothing = e[0]
    z = 0.0
    for k in range(angle.size):
        w = velocity[k]
        x = w / p[at.STRIBECK]
        g = p[at.COULOMB] + (p[at.STICTION] - p[at.COULOMB]) * math.exp(-x * x)
        before = z
        if k * dt > 0.02:  # the first rows are smoothed over the record's edge
            way = angle[k] - angle[k - 1]
            rest = math.copysign(g / p[at.SIGMA0], way)
            z = rest + (z - rest) * math.exp(-p[at.SIGMA0] * abs(way) / g)
        friction = p[at.SIGMA0] * z + p[at.SIGMA1] * (z - before) / dt + p[at.VISCOUS] * w
        out[k] = friction + spring_torque(angle[k], nothing, p, e) + stop_torque(angle[k], w, p, e)
