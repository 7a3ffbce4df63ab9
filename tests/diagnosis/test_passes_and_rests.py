"""Slow passes and rests: means over bins and windows of signals that are known."""

import math

import numpy as np
import pytest
from made_segments import held_in_bursts, segment

from etb_hil.diagnosis.motion.commands import reports
from etb_hil.diagnosis.motion.passes import slow_passes
from etb_hil.diagnosis.motion.rests import rests


def ramps(speeds, rate, value, low=0.2, high=1.2):
    """Return ramps up and down at speeds (rad/s), with commands each 10 ms and a column `value` of angle and speed."""
    angles, rates = [], []
    for speed in speeds:
        way = np.arange(low, high, speed / rate)
        angles += [way, way[::-1]]
        rates += [np.full(len(way), speed), np.full(len(way), -speed)]
    angle, velocity = np.concatenate(angles), np.concatenate(rates)
    time = np.arange(len(angle)) / rate
    command = held_in_bursts(angle, round(rate / 100))
    noise = np.random.default_rng(1).normal(0.0, 0.02, len(angle))  # a voltage that is a new one in each sample
    return segment("ramp", time, angle=angle, command_position=command, motor_voltage=noise, of=value(angle, velocity))


def test_bins_hold_the_mean_of_each_direction():
    found = slow_passes([ramps([0.4], 1000, lambda a, v: 2.0 * a + 0.1 * np.sign(v))], "of", math.radians(1.0))
    assert len(found) > 50
    assert found.value[0] == pytest.approx(2.0 * found.angle[0] + 0.1, abs=1e-9)
    assert found.value[1] == pytest.approx(2.0 * found.angle[1] - 0.1, abs=1e-9)


def test_only_the_slowest_of_several_speeds_counts():
    both = ramps([0.4, 0.8], 1000, lambda a, v: np.abs(v) + 0.0 * a)
    assert slow_passes([both], "of", 0.02).value == pytest.approx(0.4)
    fast = ramps([1.4], 1000, lambda a, v: v + 0.0 * a)
    assert len(slow_passes([fast], "of", 0.02)) == 0


def test_each_place_has_its_slowest_passes():
    """A slow ramp over a part of the way adds to the faster one over all of it."""
    whole = ramps([0.8], 1000, lambda a, v: np.abs(v) + 0.0 * a)
    part = ramps([0.3], 1000, lambda a, v: np.abs(v) + 0.0 * a, low=0.5, high=0.8)
    found = slow_passes([whole, part], "of", 0.02)
    is_slow = (found.angle > 0.55) & (found.angle < 0.75)
    assert found.value[is_slow] == pytest.approx(0.3)
    assert found.value[(found.angle < 0.5) | (found.angle > 0.8)] == pytest.approx(0.8)
    assert np.max(np.diff(found.angle[0])) < 0.05


def test_the_way_over_which_friction_turns_round_is_left_out():
    """Friction comes from its value in the other direction by a factor e each 0.02 rad."""

    def turning(angle, velocity):
        return np.where(velocity > 0.0, 1.0 - 2.0 * np.exp(-(angle - 0.2) / 0.02), -1.0)

    made = ramps([0.4], 1000, turning)
    assert slow_passes([made], "of", 0.02, 0.14).value[0] == pytest.approx(1.0, abs=3e-3)
    assert np.min(slow_passes([made], "of", 0.02).value[0]) < 0.9


def test_a_bin_that_a_pass_has_just_touched_is_left_out():
    found = slow_passes([ramps([0.4], 1000, lambda a, _: a)], "of", 0.02)
    assert np.max(found.error) < 2.0 * np.min(found.error)


def test_in_bursts_only_samples_with_a_value_of_their_own_count():
    """The plate's angle is sampled once in ten: between two of its samples it lags."""
    made = ramps([0.4], 20000, lambda a, _: a)
    columns = {role: held_in_bursts(c) if role in {"motor_voltage", "of"} else c for role, c in made.columns.items()}
    made = segment("ramp", made.time, **columns, difference=columns["of"] - columns["angle"])
    how = reports(made)
    assert (how.period, how.span) == (pytest.approx(5e-4), pytest.approx(4.5e-4))
    assert slow_passes([made], "difference", math.radians(1.0)).value == pytest.approx(0.0, abs=1e-12)


def test_a_rest_is_where_the_plate_is_held_and_does_not_move():
    time = np.arange(0.0, 1.0, 1e-3)
    moving = time < 0.4
    angle = np.where(moving, time, 0.4)
    command = np.where(moving, held_in_bursts(time), 0.4)
    made = segment(
        "hold", time, angle=angle, command_position=command, motor_current=np.full(1000, 1.5),
        motor_voltage=np.full(1000, 2.0), temperature=np.full(1000, 25.0),
    )  # fmt: skip
    found = list(rests([made]))
    assert 10 <= len(found) <= 12
    assert {(one.position, one.current, one.voltage, one.temperature) for one in found} == {(0.4, 1.5, 2.0, 25.0)}


def test_a_current_that_still_changes_is_no_rest():
    time = np.arange(0.0, 1.0, 1e-3)
    made = segment(
        "hold", time, angle=np.full(1000, 0.4), command_position=np.full(1000, 0.4),
        motor_current=np.where(time < 0.5, 20.0 * time, 10.0),
    )  # fmt: skip
    assert all(one.current == pytest.approx(10.0) for one in rests([made]))
