import numpy as np
import pytest
from numba import njit

from etb_hil.controller.noise import CURRENT, TRACK, TRACK_2, VOLTAGE, normal

COUNT = 200_000


@njit
def _series(seed, channel, count):
    out = np.empty(count)
    for counter in range(count):
        out[counter] = normal(seed, counter, channel)
    return out


@pytest.mark.parametrize("channel", [CURRENT, VOLTAGE, TRACK, TRACK_2])
def test_noise_is_standard_normal_and_white(channel):
    values = _series(7, channel, COUNT)
    sigma = 1.0 / np.sqrt(COUNT)
    assert abs(values.mean()) < 5 * sigma
    assert abs(values.var() - 1.0) < 5 * np.sqrt(2.0) * sigma
    assert abs((values**4).mean() - 3.0) < 5 * np.sqrt(96.0) * sigma
    assert abs((values[1:] * values[:-1]).mean()) < 5 * sigma


def test_channels_and_seeds_are_independent():
    current, track, track_2 = (_series(7, channel, COUNT) for channel in (CURRENT, TRACK, TRACK_2))
    other = _series(8, TRACK, COUNT)
    for a, b in ((current, track), (track, track_2), (track, other)):
        assert abs((a * b).mean()) < 5 / np.sqrt(COUNT)


def test_a_sample_has_one_noise_however_often_it_is_read():
    assert normal(3, 1234, TRACK) == normal(3, 1234, TRACK)
    assert normal(3, 1234, TRACK) != normal(3, 1235, TRACK)
