"""Torque, voltage and angle balances of a measurement, and their residuals.

No raw signal is differentiated: every signal passes one filter in the frequency domain and is divided there by the
noise of the data sheet, so that a true model leaves about 1 in every balance.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.side_by_side import cores
from etb_hil.discrepancy.fitting.cache import Cache
from etb_hil.discrepancy.fitting.inverse_model import InverseModel
from etb_hil.discrepancy.measured.bridge_opening import without_diodes
from etb_hil.discrepancy.measured.decimation import decimated
from etb_hil.discrepancy.measured.driving_voltage import with_its_mean, without_noise
from etb_hil.discrepancy.measured.measurement import Measurement, voltage_rms
from etb_hil.discrepancy.measured.regimes import Regimes
from etb_hil.discrepancy.measured.sampling import held, jitter, missed_by_samples, open_bridge, trembling, until_next
from etb_hil.discrepancy.measured.spectrum import Complex128, Spectrum
from etb_hil.plant.device_effects import largest_torque
from etb_hil.plant.drive_effects import THROTTLE_FRICTION
from etb_hil.plant.effects import readings
from etb_hil.plant.effects.effect import REFERENCE
from etb_hil.plant.effects.layout import extended
from etb_hil.plant.effects.port import Port
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import (
    BACK_EMF,
    INDUCTANCE,
    INERTIA,
    RESISTANCE,
    TORQUE_PER_AMPERE,
    Vector,
)
from etb_hil.recording.samples import Float64

CHANNELS = ("torque", "voltage", "angle")
# Low frequencies would else weigh more than bristles, seen through an encoder, can be trusted.
_TORQUE_NOISE_FLOOR = 3.0  # times the current's noise
# Unknown but small: time offsets of current, voltage and plate sensor, and the plate sensor's zero.
NUISANCES = ("current_time_offset", "voltage_time_offset", "plate_time_offset", "plate_zero")
_AT_SAMPLES = 0.03  # of a sample, that steps of the voltage may be off it
_TREMBLES = 0.01  # of T_c / sigma_0 from sample to sample


@dataclass(frozen=True, slots=True)
class _Truth:
    """Measured signals as they were before the sensors."""

    current: Float64
    current_spectrum: Complex128
    angle_spectrum: Complex128
    smooth_spectrum: Complex128
    angle: Float64
    velocity: Float64
    walk: InverseModel


@dataclass(frozen=True, slots=True)
class _Modelled:
    """In-band spectra: torque without inertia, voltage drop, plate angle and current."""

    torque: Complex128
    drop: Complex128
    place: Complex128
    current: Complex128


class Balances:
    """Whitened residuals of a measurement by extended parameters and nuisances.

    `share_of_steps` (3): the share of each balance's noise variance that is quantisation of the encoder.
    """

    def __init__(self, measured: Measurement, model: Model) -> None:
        self.measured = measured = decimated(without_diodes(measured, model))
        v = model.values
        self.gear = v.gear_ratio
        # Bounds of effects are a throttle's; another drive's forces are larger by as much as its friction is.
        self.load = 1.0 if measured.device.is_throttle else v.coulomb / THROTTLE_FRICTION
        self.largest = 0.0 if measured.device.is_throttle else largest_torque(model, measured.voltage)
        self.spectrum = spectrum = Spectrum(len(measured), measured.rate)
        self.is_open = open_bridge(measured)
        self._samples = spectrum.of(until_next(measured.voltage, self.is_open))
        self._voltage = self._samples * held(spectrum.s, measured.dt)
        self._plate = None if measured.plate is None else spectrum.of(measured.plate)
        self.driving = without_noise(measured.voltage, voltage_rms(measured.sensors), measured.rate)
        self.free_voltage = with_its_mean(self.driving, measured.voltage, measured.rate)
        self._is_calm = trembling(measured.angle, measured.rate) < _TREMBLES * v.coulomb / v.bristle_stiffness
        self.jitter = jitter(measured.angle, measured.rate, measured.angle_noise)
        self._empty_caches()
        base = v.vector()
        self._whiten, self.share_of_steps = _whitening(measured, model, spectrum)
        truth = self._truth(extended(base))
        self.regimes = Regimes.of(measured, model, spectrum, truth.angle, truth.velocity)
        self.has = (True, measured.current is not None and measured.device.has_winding, measured.plate is not None)
        self.samples = len(self.regimes.label)
        self.weights = self.regimes.start_weights(self.has)

    def _empty_caches(self) -> None:
        self._known: Cache[_Truth] = Cache()  # each is large, and few parameters are a sensor's
        self._integrated: Cache[_Modelled] = Cache(cores())
        self._places: Cache[Complex128] = Cache(cores())

    def shifted(self, shift: float) -> Balances:
        """Return these balances with a shift (rad, or m) added to the angle.

        Whitening, weights and regimes stay as they are: the drive has no stops.
        """
        found = copy(self)
        found.measured = replace(self.measured, angle=self.measured.angle + shift)
        found._empty_caches()  # noqa: SLF001 (of a copy)
        return found

    def residual(self, p: Vector, nuisance: Float64) -> Float64:
        """Return all balances (3 m) over their noise, weighted; zero where not judged."""
        return np.concatenate(self.channels(p, nuisance)) * self.weights

    def channels(self, p: Vector, nuisance: Float64) -> list[Float64]:
        """Return torque, voltage and angle balance (m each) over their noise."""
        spectrum = self.spectrum
        truth = self._truth(p)
        s = spectrum.s
        modelled = self._modelled(truth, p)
        offset_i, offset_u, offset_plate, zero = nuisance
        missed = self._missed(p, float(offset_u))
        current_spectrum = modelled.current + missed
        torque = modelled.torque + p[TORQUE_PER_AMPERE] * missed - p[INERTIA] * s * s * truth.angle_spectrum
        torque += offset_i * p[TORQUE_PER_AMPERE] * s * current_spectrum
        # In units of the measured current: a gain that shrinks all torques would shrink the noise with them.
        torque *= readings.current_scale(REFERENCE, p)
        found = [spectrum.back(torque * self._whiten[0])]
        if not self.has[1]:
            found.append(np.zeros(self.samples))
        else:
            voltage = self._voltage * np.exp(offset_u * s) - modelled.drop - p[RESISTANCE] * missed
            voltage -= p[INDUCTANCE] * s * current_spectrum + p[BACK_EMF] * s * truth.angle_spectrum
            voltage -= offset_i * (p[RESISTANCE] + p[INDUCTANCE] * s) * s * current_spectrum
            found.append(spectrum.back(voltage * self._whiten[1]))
        if self._plate is None:
            found.append(np.zeros(self.samples))
        else:
            angle = self._plate * (1.0 + offset_plate * s) - modelled.place
            angle[0] -= zero * spectrum.padded
            found.append(spectrum.back(angle * self._whiten[2]))
        return found

    def _missed(self, p: Vector, before: float) -> Complex128:
        """Return what the samples of the current miss, inside the band.

        `before` (s): by how much the voltage steps before its sample.
        """
        if self.measured.current is None or not self.measured.device.has_winding:
            return np.zeros(1, np.complex128)
        # A current has a knee at each step: a fit that found steps just before and just after their samples by turns
        # would stand there. What is nearer than an encoder's jitter is at the samples.
        before *= before**2 / (before**2 + (_AT_SAMPLES * self.measured.dt) ** 2)
        # Steps that come before their samples are seen as by a current that is read ahead of them.
        s, (delay, lag) = self.spectrum.s, readings.late_by(Port.CURRENT_LATENESS, p)
        missed = missed_by_samples(s, self.measured.dt, p[RESISTANCE], p[INDUCTANCE], delay - before, lag)
        return self._samples * np.exp(before * s) * missed

    def _modelled(self, truth: _Truth, p: Vector) -> _Modelled:
        """Return what is integrated along the motion, without inductance and inertia."""
        asked = p.copy()
        asked[INERTIA] = 0.0
        if self.measured.current is not None:
            asked[INDUCTANCE] = 0.0
        return self._integrated.of(asked.tobytes(), lambda: self._integrate(truth, p))

    def _integrate(self, truth: _Truth, p: Vector) -> _Modelled:
        current, current_spectrum = truth.current, truth.current_spectrum
        if self.measured.current is None:
            current, current_spectrum = self._current_from_voltage(truth, p)
        torque, voltage, is_lossy = truth.walk(current, p)
        drop = self.spectrum.of(voltage) if is_lossy else p[RESISTANCE] * current_spectrum
        return _Modelled(self.spectrum.of(torque), drop, self._place(truth, p), current_spectrum)

    def _place(self, truth: _Truth, p: Vector) -> Complex128:
        """Return the in-band spectrum of the plate's angle as its sensor reads it."""
        late = readings.lateness(Port.PLATE_LATENESS, self.spectrum.s, p)
        place, _ = truth.walk.plate(p)
        if place is truth.angle and not readings.has_plate_errors(p):
            return truth.smooth_spectrum if late is None else late * truth.smooth_spectrum
        key = readings.key(p) + truth.walk.plate_key(p)
        found = self._places.of(key, lambda: self.spectrum.of(readings.measured_plate(place, p)))
        return found if late is None else late * found

    def judged_groups(self) -> NDArray[np.int64]:
        """Return the group (3 m) of each sample, -1 where it cannot be judged."""
        there = np.repeat(np.array(self.has), self.samples)
        return np.where(there, self.regimes.groups(), -1)

    def whitening(self, channel: int) -> Float64:
        """Return the reciprocal noise of a balance by frequency inside the band."""
        return self._whiten[channel]

    def motion(self, p: Vector) -> tuple[Float64, Float64]:
        """Return smoothed angle and velocity (n) at the throttle shaft, sensors corrected."""
        truth = self._truth(p)
        return truth.angle, truth.velocity

    def current(self, p: Vector) -> Float64:
        """Return the current (n) before its sensor; NaN where none was measured."""
        return self._truth(p).current if self.measured.current is not None else np.full(len(self.measured), np.nan)

    def _current_from_voltage(self, truth: _Truth, p: Vector) -> tuple[Float64, Complex128]:
        s = self.spectrum.s
        inside = (self._voltage - p[BACK_EMF] * s * truth.angle_spectrum) / (p[RESISTANCE] + p[INDUCTANCE] * s)
        whole = np.zeros(self.spectrum.padded // 2 + 1, np.complex128)
        whole[: self.spectrum.bins] = inside
        return self.spectrum.signal(whole), inside

    def _truth(self, p: Vector) -> _Truth:
        return self._known.of(readings.key(p), lambda: self._before_sensors(p))

    def _before_sensors(self, p: Vector) -> _Truth:
        m, spectrum = self.measured, self.spectrum
        angle = readings.true_angle(m.angle * self.gear, p) / self.gear
        whole = spectrum.all_of(angle)
        delay, lag = readings.late_by(m.lateness_of_angle, p)
        if delay != 0.0 or lag != 0.0:
            s, time = spectrum.all_s, m.dt * np.arange(len(m))
            # Edges of an encoder that ring, or that a lag's inverse makes larger, would shake bristles: an angle goes
            # straight between samples, a lag is a delay at first, and what it is beside that is smooth.
            earlier = whole * np.exp(s * (delay + lag))
            whole = whole * np.exp(s * delay) * (1.0 + s * lag)
            angle = np.interp(time + delay + lag, time, angle) + spectrum.smoothed(whole - earlier)
        smooth, velocity, acceleration = spectrum.motion(angle, whole, is_calm=self._is_calm)
        inside = whole[: spectrum.bins]
        smooth_spectrum = spectrum.of(smooth)
        walk = InverseModel(smooth, velocity, acceleration, m.temperature, self.is_open, m.dt)
        if m.current is None:
            nothing = np.zeros(0)
            return _Truth(nothing, nothing.astype(complex), inside, smooth_spectrum, smooth, velocity, walk)
        current = readings.true_current(m.current, m.temperature, p)
        current_spectrum = spectrum.all_of(current)
        late = readings.lateness(Port.CURRENT_LATENESS, spectrum.all_s, p)
        if late is not None:
            # Beyond the band the inverse of a lag would only raise noise.
            late[spectrum.bins :] = 1.0
            current_spectrum = current_spectrum / late
            current = spectrum.signal(current_spectrum)
        return _Truth(current, current_spectrum[: spectrum.bins], inside, smooth_spectrum, smooth, velocity, walk)


def _whitening(measured: Measurement, model: Model, spectrum: Spectrum) -> tuple[list[Float64], Float64]:
    """Return each balance's reciprocal noise by frequency; the encoder's share (3).

    The band then holds a variance of one; in the angle balance the encoder's steps come on top.
    """
    v, sensors = model.values, measured.sensors
    s = spectrum.s
    step = 1.0 / np.sqrt(12.0)
    voltage_noise = np.hypot(sensors.voltage_noise, sensors.voltage_step * step) / np.sqrt(2.0)
    winding = np.abs(v.resistance + v.inductance * s)
    if measured.current is None:
        current_noise = voltage_noise / winding
    else:
        current_noise = np.full(len(s), np.hypot(sensors.current_noise, sensors.current_step * step))
    motion = np.abs(v.inertia * s * s + (v.bristle_damping + v.viscous) * s + v.bristle_stiffness)
    noise_floor = _TORQUE_NOISE_FLOOR * v.torque_per_ampere * current_noise
    by_steps = motion * measured.angle_noise, np.abs(v.back_emf * s) * measured.angle_noise
    torque = np.sqrt(noise_floor**2 + (v.torque_per_ampere * current_noise) ** 2 + by_steps[0] ** 2)
    voltage = np.sqrt(voltage_noise**2 + (winding * current_noise) ** 2 + by_steps[1] ** 2)
    plate = np.hypot(sensors.plate_noise, sensors.plate_range / 2**sensors.plate_bits * step)
    share = np.sqrt(np.sum(spectrum.low**2) / (0.5 * spectrum.padded))
    whiten = [1.0 / (share * noise) for noise in (torque, voltage, np.full(len(s), plate))]
    if measured.is_plates:
        return whiten, np.zeros(3)
    # At rest an angle is off by as much all the time: no band makes that less.
    steps = [
        float(np.average((of / n) ** 2, weights=spectrum.low**2))
        for of, n in zip(by_steps, (torque, voltage), strict=True)
    ]
    ratio = (measured.angle_noise / (share * plate)) ** 2
    return whiten, np.array([*steps, ratio / (1.0 + ratio)])
