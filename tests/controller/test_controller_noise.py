import numpy as np
import pytest
from numba import njit

from etb_hil.controller.noise import CURRENT_AND_VOLTAGE, TRACKS, normal_pair

COUNT = 200_000


@njit
def _series(seed, channel, count):
    out = np.empty((count, 2))
    for counter in range(count):
        out[counter] = normal_pair(seed, counter, channel)
    return out


@pytest.mark.parametrize("channel", [CURRENT_AND_VOLTAGE, TRACKS])
def test_noise_is_standard_normal_and_white(channel):
    values = _series(7, channel, COUNT)
    sigma = 1.0 / np.sqrt(COUNT)
    for column in values.T:
        assert abs(column.mean()) < 5 * sigma
        assert abs(column.var() - 1.0) < 5 * np.sqrt(2.0) * sigma
        assert abs((column**4).mean() - 3.0) < 5 * np.sqrt(96.0) * sigma
        assert abs((column[1:] * column[:-1]).mean()) < 5 * sigma
    assert abs((values[:, 0] * values[:, 1]).mean()) < 5 * sigma


def test_channels_and_seeds_are_independent():
    one, other, seed = _series(7, CURRENT_AND_VOLTAGE, COUNT), _series(7, TRACKS, COUNT), _series(8, TRACKS, COUNT)
    for a, b in ((one, other), (other, seed)):
        assert np.abs((a * b).mean(axis=0)).max() < 5 / np.sqrt(COUNT)


def test_a_sample_has_one_noise_however_often_it_is_read():
    assert normal_pair(3, 1234, TRACKS) == normal_pair(3, 1234, TRACKS)
    assert normal_pair(3, 1234, TRACKS) != normal_pair(3, 1235, TRACKS)
