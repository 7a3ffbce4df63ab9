"""Signals between their samples: a current after steps of its voltage, noise apart from edges, tremor at rest."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic import MODEL, RATE, measurement

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.measured.driving_voltage import with_its_mean, without_noise
from etb_hil.discrepancy.measured.sampling import held, jitter, missed_by_samples, trembling, until_next
from etb_hil.discrepancy.measured.spectrum import Spectrum

FINE = 64


def _winding(volts, dt, resistance, inductance):
    """Current of a winding under held voltages, on samples FINE times as dense: solved exactly, step by step."""
    keep = np.exp(-dt / FINE * resistance / inductance)
    current = np.empty(len(volts) * FINE)
    now = 0.0
    for k, target in enumerate(np.repeat(volts / resistance, FINE)):
        current[k] = now
        now = target + (now - target) * keep
    return current


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000), st.floats(1.0, 3.0), st.floats(0.5e-3, 3e-3), st.sampled_from([1000.0, 2000.0]))
def test_samples_and_what_they_miss_are_the_whole_current(seed, resistance, inductance, rate):
    rng = np.random.default_rng(seed)
    volts = np.repeat(rng.uniform(-12.0, 12.0, 200), 10)
    volts[:200] = volts[-200:] = 0.0  # nothing where the record is closed to a ring
    dt = 1.0 / rate
    fine = _winding(volts, dt, resistance, inductance)
    spectrum, dense = Spectrum(len(volts), rate), Spectrum(len(fine), rate * FINE)
    assert dense.padded == FINE * spectrum.padded
    whole = dense.all_of(fine)[: spectrum.bins] / FINE
    samples = spectrum.of(fine[::FINE])
    missed = spectrum.of(volts) * missed_by_samples(spectrum.s, dt, resistance, inductance)
    error, without = (np.linalg.norm(spectrum.low * (part - whole)) for part in (samples + missed, samples))
    assert error < 0.03 * without


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.5e-3, 3e-3), st.integers(-FINE, 3 * FINE), st.sampled_from([0.0, 4e-4]))
def test_samples_that_are_read_late_and_what_they_miss_are_the_whole_current(seed, inductance, late_by, lag):
    rng = np.random.default_rng(seed)
    volts = np.repeat(rng.uniform(-12.0, 12.0, 200), 10)
    volts[:200] = volts[-200:] = 0.0
    dt = 1.0 / 2000.0
    fine = _winding(volts, dt, 2.0, inductance)
    spectrum, dense = Spectrum(len(volts), 2000.0), Spectrum(len(fine), 2000.0 * FINE)
    delay = late_by * dt / FINE
    every = dense.all_of(fine)
    read = np.fft.irfft(every * np.exp(-dense.all_s * delay) / (1.0 + dense.all_s * lag), dense.padded)[: len(fine)]
    back = np.exp(spectrum.s * delay) * (1.0 + spectrum.s * lag)
    put_back = spectrum.of(read[::FINE]) * back
    driven = spectrum.of(volts)
    whole = every[: spectrum.bins] / FINE
    missed = driven * missed_by_samples(spectrum.s, dt, 2.0, inductance, delay, lag)
    at_once = driven * missed_by_samples(spectrum.s, dt, 2.0, inductance)
    error, without = (np.linalg.norm(spectrum.low * part) for part in (put_back + missed - whole, at_once))
    assert error < 0.03 * without


def test_a_held_voltage_is_late_by_half_a_sample():
    s = 2j * np.pi * np.array([0.0, 10.0])
    found = held(s, 1e-3)
    assert found[0] == pytest.approx(1.0)
    assert np.angle(found[1]) == pytest.approx(-2.0 * np.pi * 10.0 * 0.5e-3)


def test_only_with_the_bridge_open_is_a_voltage_no_step():
    volts = np.array([0.0, 2.0, 4.0, 6.0])
    open_ = np.array([False, True, True, False])
    np.testing.assert_array_equal(until_next(volts, open_), [0.0, 3.0, 5.0, 6.0])


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.005, 0.05), st.floats(-3.0, 3.0))
def test_a_voltage_loses_its_noise_and_keeps_its_steps_and_slopes(seed, noise, slope):
    rng = np.random.default_rng(seed)
    clean = np.where(np.arange(4000) < 2000, 1.0, 4.0) + slope * np.arange(4000) / 2000.0
    found = without_noise(clean + noise * rng.standard_normal(4000), noise, 2000.0)
    away = found - clean
    assert np.sqrt(np.mean(away[200:-200] ** 2)) < 0.6 * noise
    assert abs(np.mean(away[200:-200])) < 0.1 * noise
    assert np.abs(away[1995:2005]).max() < 5.0 * noise


def test_a_voltage_keeps_the_mean_of_steps_that_look_like_noise():
    """A controller's pulses at every count of an encoder are one-sided: what a filter takes of them is a torque."""
    rng = np.random.default_rng(4)
    pulses = np.where(rng.random(20_000) < 0.08, 0.06, 0.0)
    voltage = 1.0 + pulses + 0.02 * rng.standard_normal(20_000)
    smooth = without_noise(voltage, 0.02, RATE)
    whole = with_its_mean(smooth, voltage, RATE)
    second = np.ones(round(RATE)) / RATE
    lost, kept = (np.abs(np.convolve(found - voltage, second, "valid")).max() for found in (smooth, whole))
    assert kept < 0.25 * lost
    assert np.mean(np.abs(np.diff(whole))) < 0.1 * np.mean(np.abs(np.diff(voltage)))
    np.testing.assert_array_equal(with_its_mean(voltage, voltage, RATE), voltage)


@settings(max_examples=20, deadline=None)
@given(st.lists(st.floats(-12.0, 12.0), min_size=2, max_size=200))
def test_a_voltage_without_noise_stays_as_it_is(volts):
    samples = np.repeat(np.array(volts), 20)
    np.testing.assert_array_equal(without_noise(samples, 0.02, 2000.0), samples)


def test_an_encoder_is_calm_at_rest_and_in_slow_motion_and_a_noisy_sensor_is_not():
    rng = np.random.default_rng(3)
    count = 2e-5
    moving = np.floor(0.05 * np.arange(8000) / RATE / count) * count
    assert trembling(moving, RATE) < count
    assert trembling(np.zeros(8000), RATE) == 0.0
    # The calmest of many moments is somewhat calmer than the mean.
    assert 0.7 < trembling(2e-4 * rng.standard_normal(8000), RATE) / (2e-4 * np.sqrt(2.0)) < 1.0


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000), st.floats(1e-6, 2e-5), st.floats(3.5, 8.0))
def test_samples_that_are_early_and_late_are_told_from_counts(seed, rms, speed):
    rng = np.random.default_rng(seed)
    t = np.arange(40_000) / RATE
    read_at = t + rms * rng.standard_normal(len(t))
    count = 2e-5
    travel = np.abs((speed * read_at) % 2.8 - 1.4) + 0.05 * np.sin(2.0 * np.pi * 7.0 * read_at)
    found = jitter(np.floor(travel / count) * count, RATE, count / np.sqrt(12.0))
    if speed * rms > 0.3 * count:
        assert found == pytest.approx(rms, rel=0.2)
    assert found < 1.2 * np.hypot(rms, 0.3 * count / speed)


def test_a_plate_that_never_moves_fast_says_nothing_of_its_clock():
    assert jitter(1e-3 * np.sin(np.arange(8000) / RATE), RATE, 6e-6) == 0.0


def test_clocks_are_not_moved_by_what_samples_miss():
    """With samples taken for the current itself the voltage's moves by 0.07 of a sample."""
    found = [calibrate(MODEL, [Balances(measurement(MODEL.vector(), seed), MODEL)]) for seed in (11, 12, 13, 14)]
    numbers = [{u.name: u.x_of(one.fit.whole) for u in one.unknowns} for one in found]
    assert abs(np.mean([x["voltage_time_offset"] for x in numbers])) < 0.02  # of a sample; noise moves each by 0.03
    assert all(abs(x[name]) < 1.0 for x in numbers for name in ("viscous", "stribeck_velocity"))
