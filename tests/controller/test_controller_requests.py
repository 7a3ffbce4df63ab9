import numpy as np
import pytest
from controller_harness import BOTH, MS, drive, model, request

from etb_hil.controller.machine import Machine

UNIT = model("default")


def _ticks(rows, end_s):
    return drive(Machine(UNIT, UNIT, seed=1), rows, end_s).samples["tick"]


def test_nothing_is_measured_unasked():
    assert len(_ticks([], 0.1)) == 0


@pytest.mark.parametrize(("rate", "step"), [(1000.0, 20), (2000.0, 10), (500.0, 40), (100.0, 200), (20_000.0, 1)])
def test_samples_come_at_the_rate_asked_for(rate, step):
    ticks = _ticks([(0, request(rate=rate))], 0.5)
    assert np.array_equal(ticks, np.arange(0, 10_000, step))


def test_a_burst_is_every_tick_for_whole_frames_of_ten():
    ticks = _ticks([(5 * MS, request(burst=True, duration=0.0207))], 0.1)
    assert np.array_equal(ticks, np.arange(100, 100 + 420))


def test_a_duration_ends_the_measurement():
    assert np.array_equal(_ticks([(2 * MS, request(duration=0.05))], 0.2), np.arange(40, 40 + 1000, 20))


def test_a_request_without_signals_ends_the_measurement():
    ticks = _ticks([(0, request()), (50 * MS, request(signals=0))], 0.2)
    assert ticks[-1] == 49 * 20


def test_a_new_request_takes_the_place_of_the_one_before():
    samples = drive(
        Machine(UNIT, UNIT, seed=1), [(0, request()), (50 * MS, request(signals=1, rate=100.0))], 0.1
    ).samples
    assert np.array_equal(samples["tick"][50:], np.arange(1000, 2000, 200))
    assert set(samples["signals"][:50]) == {BOTH}
    assert set(samples["signals"][50:]) == {1}


def test_status_comes_a_hundred_times_a_second_with_the_supply():
    statuses = drive(Machine(UNIT, UNIT, seed=1), [], 1.0).statuses
    assert np.array_equal(statuses["tick"], np.arange(0, 20_000, 200))
    assert set(statuses["supply"]) == {UNIT.values.supply_voltage}
