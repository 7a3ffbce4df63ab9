"""Delay, rise, settling and overshoot of responses that are known in closed form."""

import math

import numpy as np
import pytest
from made_segments import segment

from etb_hil.diagnosis.half_width import TWO_SIDED_95, combined
from etb_hil.diagnosis.motion.encoder import Encoder
from etb_hil.diagnosis.motion.repeats import Reading, mean_with_interval
from etb_hil.diagnosis.motion.steps import step_responses
from etb_hil.diagnosis.segments import COMMAND_AGE, COMMAND_FRAME_AGE
from etb_hil.recording.report_time import ReportTime

EXACT = Encoder(18.0, 1e-9)
AT_ONCE = ReportTime(0.0, 0.0, 0.0)  # what is read from a file took no time on a bus
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
    opening, closing = step_responses([steps(levels, first_order, rate)], EXACT, AT_ONCE)
    assert (opening.group[0], closing.group[0]) == (f"{group}_opening", f"{group}_closing")
    for found in (opening, closing):
        # The command came with a sample, which is at the end of what is known of it: between that and the one before.
        known = sum(found.delay.bounds) + 2e-5
        assert found.delay.value == pytest.approx(DEAD + LAG * math.log(1 / 0.9), abs=known)
        assert found.rise.value == pytest.approx(LAG * math.log(9.0), abs=2e-5)
        assert found.settling.value == pytest.approx(DEAD + LAG * math.log(1 / 0.05), abs=known)
        assert found.overshoot.value == pytest.approx(0.0, abs=1e-6)


def test_an_overshoot_is_the_share_beyond_the_final_angle_and_settling_waits_for_the_last_swing():
    damping, natural = 0.3, 120.0
    damped = natural * math.sqrt(1.0 - damping**2)

    def second_order(t):
        decay = np.exp(-damping * natural * t)
        return 1.0 - decay * (np.cos(damped * t) + damping * natural / damped * np.sin(damped * t))

    (found,) = step_responses([steps((0.3, 1.0), second_order, 20000.0, hold=0.5)], EXACT, AT_ONCE)
    assert found.overshoot.value == pytest.approx(math.exp(-damping * math.pi / math.sqrt(1.0 - damping**2)), abs=1e-4)
    t = np.linspace(0.0, 0.5, 500_001)
    settled = t[np.flatnonzero(np.abs(second_order(t) - 1.0) > 0.05)[-1]]
    assert found.settling.value == pytest.approx(settled, abs=1e-3)


def test_the_way_to_the_first_position_is_no_step():
    time = np.arange(0.0, 1.0, 1e-3)
    command = np.where(time < 0.5, np.round(0.2 + 0.6 * time, 2), 0.5)
    assert not list(step_responses([segment("step", time, angle=command, command_position=command)], EXACT, AT_ONCE))


def test_a_plate_that_does_not_follow_has_no_response():
    assert not list(step_responses([steps((0.3, 1.0), lambda t: 0.1 * first_order(t))], EXACT, AT_ONCE))


def test_missing_samples_leave_the_times_of_the_others_as_they_are():
    whole = steps((0.3, 1.0), first_order)
    columns = dict(whole.columns)
    columns["angle"] = columns["angle"].copy()
    columns["angle"][330:333] = np.nan
    cut = segment("step", whole.time, **columns)
    full, holed = (next(step_responses([one], EXACT, AT_ONCE)) for one in (whole, cut))
    assert holed.delay.value == full.delay.value
    assert holed.rise.value == pytest.approx(full.rise.value, abs=5e-5)


def test_a_disc_off_centre_is_corrected_as_far_as_it_is_known():
    straight = steps((0.3, 1.0), first_order)
    angle = straight.columns["angle"]
    seen = segment("step", straight.time, **{**straight.columns, "angle": angle + 1e-3 * np.sin(18.0 * angle + 0.5)})
    disc = {"sine": 1e-3 * math.cos(0.5), "cosine": 1e-3 * math.sin(0.5)}
    known, unsure, unknown = (
        next(step_responses([seen], one, AT_ONCE))
        for one in (Encoder(18.0, 1e-9, **disc), Encoder(18.0, 1e-9, **disc, wave_error=1e-4), EXACT)
    )
    true = next(step_responses([straight], EXACT, AT_ONCE))
    assert known.rise.value == pytest.approx(true.rise.value, rel=2e-3)
    assert abs(unknown.rise.value - true.rise.value) > 10.0 * abs(known.rise.value - true.rise.value)
    assert widths(unsure.rise) > 5.0 * widths(known.rise)


def widths(reading):
    _, low, high = mean_with_interval([reading])
    return high - low


def test_steps_of_the_encoder_widen_what_is_read_from_three_angles():
    step = 1e-4
    (found,) = step_responses([steps((0.3, 1.0), first_order)], Encoder(18.0, step / math.sqrt(12.0)), AT_ONCE)
    speeds = [0.7 * (1.0 - share) / LAG for share in (0.1, 0.9)]
    errors = [
        step / math.sqrt(12.0) * math.sqrt(1.0 + (1.0 - share) ** 2 + share**2) / speed
        for share, speed in zip((0.1, 0.9), speeds, strict=True)
    ]
    assert widths(found.rise) == pytest.approx(2.0 * 1.96 * math.hypot(*errors), rel=0.1)
    # The overshoot is none, and cannot be below: it is read from the last angle and the highest one.
    assert found.overshoot.value == pytest.approx(0.0, abs=1e-6)
    assert widths(found.overshoot) > 1.96 * math.sqrt(2.0) * step / math.sqrt(12.0) / 0.7


def test_a_time_that_jumps_where_a_swing_just_reaches_the_band_has_both_in_its_interval():
    damping, natural = 0.2, 100.0
    damped = natural * math.sqrt(1.0 - damping**2)

    def second_order(t):
        decay = np.exp(-damping * natural * t)
        return 1.0 - decay * (np.cos(damped * t) + damping * natural / damped * np.sin(damped * t))

    swing = max(
        abs(float(second_order(np.array(math.pi * k / damped))) - 1.0) for k in range(1, 9)
        if abs(float(second_order(np.array(math.pi * k / damped))) - 1.0) < 0.05
    )  # fmt: skip
    scale = 0.0499 / swing  # a swing that stays just inside the band
    made = steps((0.3, 1.0), lambda t: 1.0 + scale * (second_order(t) - 1.0), hold=0.6)
    coarse, fine = (
        mean_with_interval([next(step_responses([made], Encoder(18.0, error), AT_ONCE)).settling])
        for error in (2e-4, 1e-9)
    )
    assert coarse[2] - coarse[0] > 0.01 > fine[2] - fine[0]


def test_errors_that_repeats_share_do_not_average_and_own_ones_do():
    one = Reading(10.0, (0.5,), ((9.9, 10.1),), ((9.7, 10.3),))
    other = Reading(12.0, (0.5,), ((11.9, 12.1),), ((11.7, 12.3),))
    mean, low, high = mean_with_interval([one, other])
    assert mean == 11.0
    reach = combined((0.5,), math.hypot(0.1, 0.3 / math.sqrt(2.0)) / TWO_SIDED_95)
    assert (low, high) == (pytest.approx(11.0 - reach), pytest.approx(11.0 + reach))


def test_reports_that_take_longer_make_the_command_earlier():
    made = steps((0.3, 1.0), first_order)
    at_once, late = (next(step_responses([made], EXACT, ReportTime(0.0, t, 0.0))).delay for t in (0.0, 4e-4))
    assert at_once.value - late.value == pytest.approx(2e-4)
    assert sorted(late.bounds) == pytest.approx([2e-4, 5e-4])


def test_the_stamp_of_a_command_says_when_between_two_samples_it_came():
    """It is 0.3 ms old as the sample's frame comes, which takes 0.1 to 0.2 ms, and 0.1 ms more behind another one."""
    made = steps((0.3, 1.0), first_order)
    ages = {COMMAND_AGE: np.where(made.time < 0.3, 0.1, made.time - 0.3 + 3e-4)}
    on_bus = ReportTime(1e-4, 2e-4, 1e-4)
    free, behind = (
        next(step_responses([segment("step", made.time, **made.columns, **ages, **seen)], EXACT, on_bus)).delay
        for seen in ({COMMAND_FRAME_AGE: np.full(len(made.time), age)} for age in (3e-4, 1e-4))
    )
    passed = DEAD + LAG * math.log(1 / 0.9)
    assert free.bounds == (pytest.approx(5e-5),)
    assert free.value == pytest.approx(passed + 3e-4 - 1.5e-4, abs=2e-5)
    assert behind.bounds == (pytest.approx(1e-4),)
    assert behind.value == pytest.approx(passed + 3e-4 - 2e-4, abs=2e-5)


def test_a_swing_that_leaves_the_band_between_samples_counts():
    def away(t):
        return -np.exp(-25.0 * t) * np.cos(183.0 * t)

    fine, sampled = np.arange(0.0, 0.4, 1e-6), np.arange(0.0, 0.4, 1e-3)
    settled, seen = (t[np.flatnonzero(np.abs(away(t)) > 0.05)[-1]] for t in (fine, sampled))
    assert settled - seen > 0.01
    (found,) = step_responses([steps((0.3, 1.0), lambda t: 1.0 + away(t), hold=0.5)], EXACT, AT_ONCE)
    assert found.settling.value == pytest.approx(settled, abs=sum(found.settling.bounds) + 1e-4)
