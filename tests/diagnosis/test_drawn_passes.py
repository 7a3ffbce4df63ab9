"""Slow passes are recognised however commands arrive: late, rounded, lost, or at a rate of their own."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_segments import segment

from etb_hil.diagnosis.motion.passes import slow_passes
from etb_hil.scenario.trajectory import move

WIDTH = math.radians(1.0)
LOW, HIGH = math.radians(1.5), math.radians(82.0)
LOST_S = 0.05 + 0.06 + 0.03  # of time at either end: soft start, settling, late commands


def ramp(speeds, *, every, late, step, lost, offset, pause, seed):
    """Return a segment of ramps up and down at speeds (rad/s), as commands (one `every` s) came to the controller."""
    rng = np.random.default_rng(seed)
    ways = [move(*way, speed) for speed in speeds for way in ((LOW, HIGH), (HIGH, LOW))]
    asked, rate = [], []
    for way, speed in zip(ways, np.repeat(speeds, 2), strict=True):
        asked += [way.at(t).position for t in np.arange(0.0, way.duration, every)]
        asked += [way.end] * round(pause / every)
        rate += [speed] * (len(asked) - len(rate))
    sent = offset + np.arange(len(asked)) * every
    came = sent + rng.uniform(0.0, late * every, len(sent))
    here = rng.uniform(size=len(sent)) >= lost
    here[0] = True
    came, asked = came[here], np.round(np.array(asked)[here] / step) * step
    time = np.arange(came[0], came[-1], 1e-3)
    command = asked[np.searchsorted(came, time, side="right") - 1]
    angle = np.interp(time, came, asked)
    side = np.sign(np.gradient(angle))
    return segment("ramp", time, angle=angle, command_position=command, motor_voltage=rng.normal(size=len(time)),
                   of=3.0 * angle + 0.2 * side, speed=np.interp(time, sent, rate))  # fmt: skip


@given(
    speed=st.floats(0.2, 0.9),
    every=st.sampled_from([1e-3, 2e-3, 5e-3, 1e-2, 1.25e-2]),
    late=st.sampled_from([0.0, 0.05, 0.3, 0.6]),
    step=st.sampled_from([1e-9, 5e-5, 1e-4]),
    offset=st.floats(0.0, 1e-3),
    pause=st.sampled_from([0.0, 0.05, 0.5]),
    seed=st.integers(0, 2**31),
)
def test_both_passes_are_seen_over_the_whole_way(speed, every, late, step, offset, pause, seed):
    made = ramp([speed], every=every, late=late, step=step, lost=0.0, offset=offset, pause=pause, seed=seed)
    found = slow_passes([made], "of", WIDTH)
    lost = LOST_S * speed + WIDTH
    assert found.angle[0, 0] < LOW + lost
    assert found.angle[0, -1] > HIGH - lost
    assert np.max(np.diff(found.angle[0])) < 1.5 * WIDTH
    assert found.value[0] == pytest.approx(3.0 * found.angle[0] + 0.2, abs=0.1)
    assert found.value[1] == pytest.approx(3.0 * found.angle[1] - 0.2, abs=0.1)


@given(
    slow=st.floats(0.2, 0.5), factor=st.floats(1.3, 1.9), late=st.sampled_from([0.0, 0.3]), seed=st.integers(0, 2**31)
)
def test_the_slowest_passes_are_taken_alone(slow, factor, late, seed):
    setting = {"every": 1e-2, "late": late, "step": 5e-5, "lost": 0.0, "offset": 3e-4, "pause": 0.02}
    for order in ([slow, slow * factor], [slow * factor, slow]):
        found = slow_passes([ramp(order, **setting, seed=seed)], "speed", WIDTH)
        assert len(found) > 65
        assert found.value == pytest.approx(slow)


@given(speed=st.floats(0.2, 0.6), lost=st.floats(0.0, 0.01), seed=st.integers(0, 2**31))
def test_a_lost_command_costs_the_way_around_it(speed, lost, seed):
    setting = {"every": 1e-2, "late": 0.1, "step": 5e-5, "offset": 0.0, "pause": 0.1}
    all_of_it = slow_passes([ramp([speed], **setting, lost=0.0, seed=seed)], "of", WIDTH)
    found = slow_passes([ramp([speed], **setting, lost=lost, seed=seed)], "of", WIDTH)
    assert len(found) >= 0.8 * len(all_of_it)
