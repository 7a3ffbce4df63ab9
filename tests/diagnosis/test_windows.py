"""Newton's law over windows, against motions whose torque is known in closed form."""

import numpy as np
import pytest

from etb_hil.diagnosis.ticks import TICK, TickMaker
from etb_hil.diagnosis.windows import (
    NARROW,
    WIDE,
    bend,
    place_windows,
    sliding,
    window_means,
)


def ticks_of(time, angle, lost=()):
    maker = TickMaker()
    keep = np.setdiff1d(np.arange(len(time)), lost)
    time_ns = np.round(time * 1e9).astype(np.int64)[keep]
    nothing = np.full(len(keep), np.nan)
    maker.push(time_ns, angle[keep], np.zeros(len(keep)), nothing, nothing, nothing, nothing, 1)
    return maker.ticks()


both_shapes = pytest.mark.parametrize("shape", [NARROW, WIDE], ids=["narrow", "wide"])


@both_shapes
def test_weights_answer_to_powers_of_time(shape):
    t = np.arange(-shape.half, shape.half + 1) * TICK
    assert shape.mean.sum() == pytest.approx(1.0)
    assert shape.torque.sum() == pytest.approx(1.0)
    assert shape.rate @ np.ones_like(t) == pytest.approx(0.0, abs=1e-9)
    assert shape.rate @ t == pytest.approx(1.0)
    assert shape.acceleration @ t == pytest.approx(0.0, abs=1e-9)
    assert shape.acceleration @ (t * t) == pytest.approx(2.0)


@both_shapes
@pytest.mark.parametrize("frequency", [2.0, 10.0, 30.0])
def test_inertia_torque_equals_the_torque_under_the_same_window(frequency, shape):
    omega = 2.0 * np.pi * frequency
    time = np.arange(0.0, 0.5, TICK)
    angle = np.sin(omega * time)
    ticks = ticks_of(time, angle)
    windows = place_windows(ticks, np.ones(len(ticks), np.int64), shape)
    acceleration = -omega * omega * angle
    bend(acceleration, 1.0 / 12.0, 0.0, ticks.samples)
    measured = window_means(ticks.angle, shape.acceleration, windows)
    assert measured == pytest.approx(window_means(acceleration, shape.mean, windows), abs=1e-4 * omega * omega)


@both_shapes
def test_no_window_spans_a_gap(shape):
    time = np.arange(0.0, 0.3, TICK)
    ticks = ticks_of(time, time, lost=[100, 101, 200])
    windows = place_windows(ticks, np.ones(len(ticks), np.int64), shape)
    assert len(windows)
    for centre in windows.centre:
        spanned = ticks.time[centre - shape.half : centre + shape.half + 1]
        assert np.diff(spanned) == pytest.approx(TICK)


def test_tick_with_half_its_samples_counts_as_a_gap():
    time = np.arange(0.0, 0.2, TICK / 20)
    ticks = ticks_of(time, time, lost=np.arange(2000, 2010))
    windows = place_windows(ticks, np.ones(len(ticks), np.int64))
    spans = [(c - NARROW.half, c + NARROW.half) for c in windows.centre]
    assert spans
    assert not any(first <= 100 <= last for first, last in spans)


def test_ticks_are_means():
    time = np.arange(0.0, 0.01, TICK / 20)
    ticks = ticks_of(time, time * 3.0)
    assert ticks.time == pytest.approx(np.arange(10) * TICK + 0.475 * TICK)
    assert ticks.angle == pytest.approx(3.0 * ticks.time)
    assert np.all(ticks.samples == 20)


def test_windows_slide_from_35_mrad_after_a_turn_to_the_next_turn():
    time = np.arange(0.0, 2.0, TICK)
    angle = 0.4 - np.abs(0.4 - 0.4 * time)  # 0.4 rad at 0.4 rad/s, and back
    ticks = ticks_of(time, angle)
    windows = place_windows(ticks, np.ones(len(ticks), np.int64))
    slides = sliding(ticks, windows)
    first, last = (ticks.time[windows.centre + side * NARROW.half] for side in (-1, 1))
    bend = 0.035 / 0.4
    inside = ((first > bend) & (last < 1.0)) | (first > 1.0 + bend)
    touched = (first < bend) | ((last > 1.0 + 2.5 * TICK) & (first < 1.0 + bend))
    assert np.all(slides[inside])
    assert not np.any(slides[touched])


def test_steps_of_a_coarse_angle_are_no_turns():
    time = np.arange(0.0, 2.0, TICK)
    step = 0.77e-3
    noisy = step * np.round(0.4 * time / step + np.random.default_rng(3).normal(0.0, 0.1, len(time)))
    ticks = ticks_of(time, noisy)
    windows = place_windows(ticks, np.ones(len(ticks), np.int64))
    assert np.all(sliding(ticks, windows)[ticks.time[windows.centre - NARROW.half] > 0.1])
