"""What changes with time around the unit: housing temperature, running-in, debris, vibration."""

import numpy as np

from generator import layout as at
from generator.program import TICK


def surround(inputs, rng):
    """Fill the columns of `inputs` that are not commanded; every record warms or cools, whatever is hidden in it."""
    t = np.arange(len(inputs)) * TICK
    inputs[:, at.IN_TEMPERATURE] = _temperature(t, rng)
    inputs[:, at.IN_RUNNING_IN] = _running_in(t, rng)
    inputs[:, at.IN_BURSTS] = _bursts(t, rng)
    inputs[:, at.IN_VIBRATION] = _vibration(t, rng)
    return inputs


def _temperature(t, rng):
    share = t / t[-1]
    shape = rng.integers(3)
    if shape == 0:
        course = share
    elif shape == 1:
        course = 1.0 - np.exp(-share * rng.uniform(1.5, 4.0))
    else:
        turn = rng.uniform(0.3, 0.7)
        course = np.minimum(share / turn, (1.0 - share) / (1.0 - turn))
    return rng.uniform(15.0, 35.0) + rng.choice([-1.0, 1.0], p=[0.3, 0.7]) * rng.uniform(15.0, 40.0) * course


def _running_in(t, rng):
    """Friction that falls with use: fast at first, or in sudden small losses."""
    if rng.random() < 0.5:
        return -(1.0 - np.exp(-t / (t[-1] * rng.uniform(0.1, 0.3))))
    losses = np.sort(rng.uniform(0.0, t[-1], 6))
    return -np.searchsorted(losses, t) / 6.0


def _bursts(t, rng):
    """Debris passes: short spells of more friction at random times."""
    course = np.zeros_like(t)
    for start in rng.uniform(0.0, t[-1], max(4, int(t[-1] / 3.0))):
        length = rng.uniform(0.3, 1.5)
        inside = (t >= start) & (t < start + length)
        course[inside] = np.maximum(
            course[inside], rng.uniform(0.4, 1.0) * np.sin(np.pi * (t[inside] - start) / length)
        )
    return course


def _vibration(t, rng):
    """Torque from outside, rms one: a band of noise, or a tone that wanders."""
    if rng.random() < 0.5:
        spectrum = np.fft.rfft(rng.standard_normal(t.size))
        frequency = np.fft.rfftfreq(t.size, TICK)
        low = rng.uniform(3.0, 10.0)
        spectrum[(frequency < low) | (frequency > low * rng.uniform(2.0, 4.0))] = 0.0
        course = np.fft.irfft(spectrum, t.size)
    else:
        rate = 2.0 * np.pi * (rng.uniform(8.0, 20.0) + rng.uniform(3.0, 6.0) * np.sin(t * rng.uniform(0.2, 0.8)))
        course = np.sin(np.cumsum(rate) * TICK)
    return course / np.sqrt(np.mean(course**2))
