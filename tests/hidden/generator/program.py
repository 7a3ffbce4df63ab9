"""A test programme under construction: references at control ticks, put together from moves."""

import numpy as np

from generator import layout as at

TICK = 1e-3


class Program:
    """References that grow move by move; angles in rad at the throttle shaft, times in s."""

    def __init__(self, start):
        self.angle = start
        self._parts = []

    @property
    def seconds(self):
        return TICK * sum(len(part) for part in self._parts)

    def _add(self, angle, voltage=0.0, mode=at.CLOSED_LOOP):
        angle = np.asarray(angle, float)
        part = np.zeros((angle.size, at.INPUTS))
        part[:, at.IN_ANGLE] = angle
        part[:, at.IN_VELOCITY] = np.gradient(angle, TICK) if angle.size > 1 else 0.0
        part[:, at.IN_VOLTAGE] = voltage
        part[:, at.IN_MODE] = mode
        self._parts.append(part)
        if angle.size:
            self.angle = float(angle[-1])

    def hold(self, seconds):
        self._add(np.full(round(seconds / TICK), self.angle))

    def ramp(self, to, speed):
        ticks = max(2, round(abs(to - self.angle) / speed / TICK))
        self._add(self.angle + (to - self.angle) * np.arange(1, ticks + 1) / ticks)

    def jump(self, to, seconds):
        """Set-point step: no velocity is fed forward, the limit of the voltage decides."""
        self.angle = to
        self.hold(seconds)

    def triangle(self, amplitude, frequency, seconds):
        """Small reversals about the present angle."""
        t = np.arange(1, round(seconds / TICK) + 1) * TICK
        wave = 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * frequency * t))
        centre = self.angle
        self._add(centre + amplitude * wave)
        self.angle = centre

    def multisine(self, rng, amplitude, highest, seconds):
        """Ten tones with random phases about the present angle, faded in and out; the fast ones also as voltage."""
        t = np.arange(1, round(seconds / TICK) + 1) * TICK
        tones = np.exp(np.linspace(np.log(0.4), np.log(highest), 10)) * rng.uniform(0.9, 1.1, 10)
        sizes = 1.0 / (1.0 + (tones / 3.0) ** 1.2)
        waves = np.sin(2.0 * np.pi * tones[:, None] * t + rng.uniform(0.0, 2.0 * np.pi, (10, 1)))
        fade = np.minimum(1.0, np.minimum(t, t[::-1]) / 0.2)
        centre = self.angle
        sum_angle = (sizes[:, None] * waves).sum(0)
        voltage = waves[6:].sum(0) * fade * rng.uniform(0.2, 0.6)
        self._add(centre + amplitude * fade * sum_angle / np.abs(sum_angle).max(), voltage)
        self.angle = centre

    def voltage(self, volts):
        """Open loop: the voltage as given, tick by tick; the plate goes where it goes."""
        self._add(np.full(len(volts), self.angle), np.asarray(volts), at.OPEN_LOOP)

    def off(self, seconds, comes_to):
        """Bridge off: the springs bring the plate to limp-home."""
        self.angle = comes_to
        self._add(np.full(round(seconds / TICK), comes_to), 0.0, at.BRIDGE_OFF)

    def inputs(self, seconds):
        """All ticks, cut or held to a length."""
        ticks = round(seconds / TICK)
        if self.seconds < seconds:
            self.hold(seconds - self.seconds + TICK)
        return np.ascontiguousarray(np.concatenate(self._parts)[:ticks])
