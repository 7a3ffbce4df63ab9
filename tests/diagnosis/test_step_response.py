"""Delay, rise, settling and overshoot of responses that are known in closed form."""

import math

import numpy as np
import pytest
from made_segments import segment

from etb_hil.diagnosis.motion.encoder import Encoder
from etb_hil.diagnosis.motion.steps import step_responses

EXACT = Encoder(1e-9, 0.0, 18.0)
DEAD, LAG = 5e-3, 0.02  # s


def steps(levels, response, rate=1000.0, hold=0.3):
    """Return a segment of steps between levels (rad), each answered by `response` (share over s since the command)."""
    time = np.arange(0.0, hold * len(levels), 1.0 / rate)
    number = np.minimum((time / hold).astype(int), len(levels) - 1)
    since = time - number * hold
    start = np.array([levels[0], *levels[:-1]])[number]
    command = np.array(levels)[number]
    angle = start + (command - start) * response(since)
    return segment("step", time, angle=angle, command_position=command)


def first_order(t):
    return 1.0 - np.exp(-np.maximum(t - DEAD, 0.0) / LAG)


@pytest.mark.parametrize("rate", [1000.0, 20000.0])
@pytest.mark.parametrize(("levels", "group"), [((0.5, 0.57, 0.5), "small"), ((0.3, 1.0, 0.3), "large")])
def test_a_first_order_lag_behind_a_dead_time_is_measured_in_both_directions(levels, group, rate):
    opening, closing = step_responses([steps(levels, first_order, rate)], EXACT)
    assert (opening.group[0], closing.group[0]) == (f"{group}_opening", f"{group}_closing")
    for found in (opening, closing):
        # The command came between two samples: delay and settling are not known better than that.
        assert found.delay.value == pytest.approx(DEAD + LAG * math.log(1 / 0.9), abs=sum(found.delay.bounds))
        assert found.rise.value == pytest.approx(LAG * math.log(9.0), abs=2e-5)
        assert found.settling.value == pytest.approx(DEAD + LAG * math.log(1 / 0.05), abs=sum(found.settling.bounds))
        assert found.overshoot.value == pytest.approx(0.0, abs=1e-6)


def test_an_overshoot_is_the_share_beyond_the_final_angle_and_settling_waits_for_the_last_swing():
    damping, natural = 0.3, 120.0
    damped = natural * math.sqrt(1.0 - damping**2)

    def second_order(t):
        decay = np.exp(-damping * natural * t)
        return 1.0 - decay * (np.cos(damped * t) + damping * natural / damped * np.sin(damped * t))

    (found,) = step_responses([steps((0.3, 1.0), second_order, 20000.0, hold=0.5)], EXACT)
    assert found.overshoot.value == pytest.approx(math.exp(-damping * math.pi / math.sqrt(1.0 - damping**2)), abs=1e-4)
    t = np.linspace(0.0, 0.5, 500_001)
    settled = t[np.flatnonzero(np.abs(second_order(t) - 1.0) > 0.05)[-1]]
    assert found.settling.value == pytest.approx(settled, abs=1e-3)


def test_the_way_to_the_first_position_is_no_step():
    time = np.arange(0.0, 1.0, 1e-3)
    command = np.where(time < 0.5, np.round(0.2 + 0.6 * time, 2), 0.5)
    assert not list(step_responses([segment("step", time, angle=command, command_position=command)], EXACT))


def test_a_plate_that_does_not_follow_has_no_response():
    assert not list(step_responses([steps((0.3, 1.0), lambda t: 0.1 * first_order(t))], EXACT))


def test_missing_samples_leave_the_times_of_the_others_as_they_are():
    whole = steps((0.3, 1.0), first_order)
    columns = dict(whole.columns)
    columns["angle"] = columns["angle"].copy()
    columns["angle"][330:333] = np.nan
    (full,), (holed,) = (list(step_responses([one], EXACT)) for one in (whole, segment("step", whole.time, **columns)))
    assert holed.delay.value == full.delay.value
    assert holed.rise.value == pytest.approx(full.rise.value, abs=5e-5)


def test_an_encoder_that_is_off_centre_widens_what_is_read_with_it():
    off = Encoder(1e-9, 1e-3, 18.0)
    (exact,), (wide,) = (list(step_responses([steps((0.3, 1.0), first_order)], one)) for one in (EXACT, off))
    assert wide.rise.value == exact.rise.value
    speed = 0.7 * 0.1 / LAG  # rad/s at 90 % of the step
    assert wide.rise.error == pytest.approx(1e-3 * math.sqrt(1.0 + 0.1**2 + 0.9**2) / speed, rel=0.1)
    assert exact.rise.error == 0.0
