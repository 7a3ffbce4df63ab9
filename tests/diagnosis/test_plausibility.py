"""The current's zero, held against itself wherever the bridge is commanded off."""

import numpy as np
import pytest

from etb_hil.base.modes import Mode
from etb_hil.base.stock import find
from etb_hil.diagnosis.plausibility import OFF_CURRENT, Plausibility
from etb_hil.plant.parameters import load_model
from etb_hil.recording.samples import SampleBlock


def rows(start, current, mode, rng):
    count = 500
    time_ns = start + np.arange(count) * 1_000_000
    columns = {
        "motor_current": current + rng.normal(0.0, 0.005, count),
        "motor_angle": np.full(count, 2.5),
        "command_mode": np.full(count, float(mode)),
    }
    return SampleBlock("joined", time_ns, time_ns + 200_000, columns, np.zeros(count, np.int64))


def doubts(*stretches):
    rng, watch = np.random.default_rng(1), Plausibility(load_model(find("model", "default")))
    for number, (current, mode) in enumerate(stretches):
        watch.push(rows(number * 500_000_000, current, mode, rng), number, moving=False)
    return [doubt.id for doubt in watch.doubts()]


@pytest.mark.parametrize("moved", [1.5 * OFF_CURRENT, -1.5 * OFF_CURRENT])
def test_a_zero_that_moves_is_seen_with_the_bridge_commanded_off(moved):
    assert doubts((0.0, Mode.OFF), (moved, Mode.OFF)) == ["current_zero_moves"]


def test_a_current_that_the_bridge_drives_is_no_zero():
    assert doubts((0.0, Mode.OFF), (0.8, Mode.POSITION), (0.01, Mode.OFF)) == []


def test_where_commands_are_not_recorded_nothing_is_said():
    assert doubts((0.0, np.nan), (1.0, np.nan)) == []
