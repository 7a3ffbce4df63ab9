"""What the stick-slip observer wins by knowing how a plate moves, and that it needs no law of friction for it."""

from dataclasses import replace

import numpy as np
import pytest
from independent_throttle import Unit, simulate
from throttle_as_model import parameters

from etb_hil.observer.angle import AngleObserver
from etb_hil.observer.estimate import SensorNoise
from etb_hil.observer.stick_slip import StickSlipObserver

STEP, NOISE = np.radians(90.0) / 4096, np.radians(0.01)
COARSE = SensorNoise.of_steps(STEP, 0.0, NOISE)  # 12 bits over 90 degrees


def _run(unit, *sines):
    time = np.arange(0.0, 3.0, 1e-3)
    position, velocity = np.full(len(time), 0.8), np.zeros(len(time))
    for amplitude, frequency in sines:
        angular = 2.0 * np.pi * frequency
        position += amplitude * np.sin(angular * time)
        velocity += amplitude * angular * np.cos(angular * time)
    return simulate(unit, position, velocity, np.full(len(time), 2))


def _estimate(observer, truth, seed=4):
    angle = truth.angle[::20]
    angle = np.round((angle + NOISE * np.random.default_rng(seed).standard_normal(len(angle))) / STEP) * STEP
    return observer.push(np.round(truth.time[::20] * 1e9).astype(np.int64), truth.current[::20].copy(), angle)


def _error(observer, truth):
    return np.sqrt(np.mean((_estimate(observer, truth).friction - truth.friction[::20])[500:] ** 2))


LUGRE = Unit(stop_low=-10.0, stop_high=10.0)
BUMPY = replace(LUGRE, bump=0.25, bump_angle=0.85, bump_width=0.05)
SOFT = replace(LUGRE, bristle_stiffness=30.0)  # T_c over 0.3 degrees


SLOW, FAST = [(0.3, 0.5)], [(0.2, 0.5), (0.12, 4.0)]


@pytest.mark.parametrize(
    ("unit", "sines", "share"),
    [
        (LUGRE, SLOW, 0.6),
        (LUGRE, FAST, 0.9),
        (BUMPY, SLOW, 0.6),
        (BUMPY, FAST, 0.9),
        (SOFT, SLOW, 0.6),
        (SOFT, FAST, 1.0),
    ],
)
def test_less_than_what_is_ready_for_a_reversal_at_any_time_leaves(unit, sines, share):
    """Soft bristles turn round more slowly than is expected of them: then nothing is won in fast motion."""
    truth = _run(unit, *sines)
    known = parameters(unit)
    assert _error(StickSlipObserver(known, COARSE), truth) < share * _error(AngleObserver(known, COARSE), truth)


def test_the_friction_that_the_model_states_hardly_matters():
    truth = _run(LUGRE, *FAST)
    known = parameters(LUGRE)
    other = replace(known, stiction=0.5 * known.stiction, coulomb=0.1, bristle_stiffness=1.0, stribeck_velocity=1.0)
    assert _error(StickSlipObserver(other, COARSE), truth) == pytest.approx(
        _error(StickSlipObserver(known, COARSE), truth), rel=0.05
    )


def test_a_plate_at_rest_is_held_by_what_is_applied():
    """Torque to and fro below break-away: friction follows it without the filter's delay, noise or not."""
    unit = replace(LUGRE, stiction=0.5, coulomb=0.45)
    time = np.arange(0.0, 2.0, 1e-3)
    truth = simulate(unit, 0.8 + 0.01 * np.sin(9.0 * time), 0.09 * np.cos(9.0 * time), np.full(len(time), 2))
    assert np.ptp(truth.friction[10000:]) > 0.05
    held, followed = (_error(kind(parameters(unit), COARSE), truth) for kind in (StickSlipObserver, AngleObserver))
    assert held < 0.5 * followed
