"""Delay, rise, settling and overshoot of responses that are known in closed form."""

import math

import numpy as np
import pytest
from made_segments import segment

from etb_hil.diagnosis.half_width import TWO_SIDED_95, combined
from etb_hil.diagnosis.motion.encoder import Encoder
from etb_hil.diagnosis.motion.repeats import Reading, mean_with_interval, reach
from etb_hil.diagnosis.motion.steps import Unread, step_responses
from etb_hil.diagnosis.segments import BUS_TIME, COMMAND_AGE, COMMAND_FRAME_AGE

EXACT = Encoder(18.0, 1e-9)
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
    assert (opening.group, closing.group) == (f"{group}_opening", f"{group}_closing")
    for found in (opening, closing):
        # The command came with a sample, which is at the end of what is known of it: between that and the one before.
        known = 0.5 * widths(found.delay) + 2e-5
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

    (found,) = step_responses([steps((0.3, 1.0), second_order, 20000.0, hold=0.5)], EXACT)
    assert found.overshoot.value == pytest.approx(math.exp(-damping * math.pi / math.sqrt(1.0 - damping**2)), abs=1e-4)
    t = np.linspace(0.0, 0.5, 500_001)
    settled = t[np.flatnonzero(np.abs(second_order(t) - 1.0) > 0.05)[-1]]
    assert found.settling.value == pytest.approx(settled, abs=1e-3)


def test_the_way_to_the_first_position_is_no_step():
    time = np.arange(0.0, 1.0, 1e-3)
    command = np.where(time < 0.5, np.round(0.2 + 0.6 * time, 2), 0.5)
    assert not list(step_responses([segment("step", time, angle=command, command_position=command)], EXACT))


@pytest.mark.parametrize("share", [0.1, 0.49, -0.6])
@pytest.mark.parametrize("levels", [(0.3, 1.0), (1.0, 0.3)])
def test_a_step_that_the_plate_does_not_follow_counts_and_says_how_far_it_went(levels, share):
    (found,) = step_responses([steps(levels, lambda t: share * first_order(t))], EXACT)
    assert isinstance(found, Unread)
    assert found.group == f"large_{'opening' if levels[1] > levels[0] else 'closing'}"
    assert found.least == pytest.approx(0.3, abs=2e-3)
    assert f"it went {math.degrees(0.7 * share):.1f} of 40.11 deg" in found.note


@pytest.mark.parametrize(("decay", "is_settled"), [(50.0, True), (15.0, True), (0.0, False)])
def test_a_plate_that_still_swings_as_the_time_ends_has_not_settled(decay, is_settled):
    swings = steps((0.3, 1.0), lambda t: 1.0 - np.exp(-decay * t) * np.cos(2.0 * math.pi * 50.0 * t))
    (found,) = step_responses([swings], EXACT)
    assert isinstance(found, Unread) is not is_settled
    if not is_settled:
        assert "had not settled within 0.30 s" in found.note
        assert found.least > 0.27


def test_missing_samples_leave_the_times_of_the_others_as_they_are():
    whole = steps((0.3, 1.0), first_order)
    columns = dict(whole.columns)
    columns["angle"] = columns["angle"].copy()
    columns["angle"][330:333] = np.nan
    cut = segment("step", whole.time, **columns)
    full, holed = (next(step_responses([one], EXACT)) for one in (whole, cut))
    assert holed.delay.value == full.delay.value
    assert holed.rise.value == pytest.approx(full.rise.value, abs=5e-5)


def test_a_disc_off_centre_is_corrected_as_far_as_it_is_known():
    straight = steps((0.3, 1.0), first_order)
    angle = straight.columns["angle"]
    seen = segment("step", straight.time, **{**straight.columns, "angle": angle + 1e-3 * np.sin(18.0 * angle + 0.5)})
    disc = {"sine": 1e-3 * math.cos(0.5), "cosine": 1e-3 * math.sin(0.5)}
    known, unsure, unknown = (
        next(step_responses([seen], one))
        for one in (Encoder(18.0, 1e-9, **disc), Encoder(18.0, 1e-9, **disc, wave_error=1e-4), EXACT)
    )
    true = next(step_responses([straight], EXACT))
    assert known.rise.value == pytest.approx(true.rise.value, rel=2e-3)
    assert abs(unknown.rise.value - true.rise.value) > 10.0 * abs(known.rise.value - true.rise.value)
    assert widths(unsure.rise) > 5.0 * widths(known.rise)


def widths(reading):
    _, low, high = mean_with_interval([reading])
    return high - low


def test_steps_of_the_encoder_widen_what_is_read_from_three_angles():
    step = 1e-4
    (found,) = step_responses([steps((0.3, 1.0), first_order)], Encoder(18.0, step / math.sqrt(12.0)))
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
        mean_with_interval([next(step_responses([made], Encoder(18.0, error))).settling]) for error in (2e-4, 1e-9)
    )
    assert coarse[2] - coarse[0] > 0.01 > fine[2] - fine[0]


def test_errors_that_repeats_share_do_not_average_and_own_ones_do():
    one = Reading(10.0, ((0.5, 0.5),), ((0.1, 0.1),), ((0.3, 0.3),))
    other = Reading(12.0, ((0.5, 0.5),), ((0.1, 0.1),), ((0.3, 0.3),))
    mean, low, high = mean_with_interval([one, other])
    assert mean == 11.0
    known = combined((0.5,), math.hypot(0.1, 0.3 / math.sqrt(2.0)) / TWO_SIDED_95)
    assert (low, high) == (pytest.approx(11.0 - known), pytest.approx(11.0 + known))


def test_an_error_that_moves_a_value_to_one_side_widens_that_side_alone():
    assert reach(10.0, (10.0, 14.0)) == (0.0, 4.0)
    assert reach(10.0, (9.0, 9.5)) == (1.0, 0.0)
    mean, low, high = mean_with_interval([Reading(10.0, own=(reach(10.0, (10.0, 14.0)),))])
    assert (mean, low, high) == (10.0, 10.0, pytest.approx(14.0))


def test_a_difference_has_the_errors_of_both_readings():
    found = Reading(3.0, ((0.1, 0.2),), ((0.3, 0.3),)).since(Reading(1.0, ((0.5, 0.5),), own=((0.7, 0.7),)))
    assert found == Reading(2.0, ((0.1, 0.2), (0.5, 0.5)), ((0.3, 0.3),), ((0.7, 0.7),))


def came_after(age, seen, on_bus):
    """Return the delay of a step whose command has these ages in s at the stamps of the samples' frames."""
    made = steps((0.3, 1.0), first_order)
    ages = {COMMAND_AGE: age(made.time), COMMAND_FRAME_AGE: seen(made.time), BUS_TIME: on_bus(made.time)}
    return next(step_responses([segment("step", made.time, **made.columns, **ages)], EXACT)).delay


def never(time):
    return np.full(len(time), np.nan)


def since_the_command(time):
    """Return the age of a command that came 0.3 ms before the frames of the first sample that holds it."""
    return np.where(time < 0.3, 0.1, time - 0.3 + 3e-4)


@pytest.mark.parametrize("on_bus", [1e-4, 2.5e-4])
def test_stamps_and_the_length_of_frames_say_when_a_command_came(on_bus):
    found = came_after(since_the_command, lambda t: np.full(len(t), 5e-3), lambda t: np.full(len(t), on_bus))
    assert found.value == pytest.approx(DEAD + LAG * math.log(1 / 0.9) + 3e-4 - on_bus, abs=5e-6)
    assert widths(found) < 1e-5


def test_a_sample_that_waited_for_the_frame_of_a_command_says_nothing():
    """Its frames came 0.2 ms later, as one sample in ten does where commands come at 100 Hz."""
    waited = lambda t: np.round(1e3 * t) % 10 == 0  # noqa: E731
    found = came_after(
        lambda t: since_the_command(t) + 2e-4 * waited(t),
        lambda t: np.where(waited(t), 5e-5, 5e-3),
        lambda t: np.full(len(t), 1e-4),
    )
    assert found.value == pytest.approx(DEAD + LAG * math.log(1 / 0.9) + 2e-4, abs=5e-6)
    assert widths(found) < 1e-5


def test_stamps_that_scatter_widen_the_interval_by_the_error_of_the_commands_stamp():
    scatter = np.random.default_rng(1).normal(0.0, 2e-5, 10_000)
    found = came_after(
        lambda t: since_the_command(t) + scatter[: len(t)],
        lambda t: np.full(len(t), 5e-3),
        lambda t: np.full(len(t), 1e-4),
    )
    assert 0.5 * widths(found) == pytest.approx(1.96 * 2e-5, rel=0.3)


def test_without_the_bus_a_command_is_known_by_the_most_that_frames_take_and_without_stamps_by_a_sample():
    stamped, unstamped = (came_after(age, never, never) for age in (since_the_command, never))
    passed = DEAD + LAG * math.log(1 / 0.9)
    assert stamped.value == pytest.approx(passed + 3e-4 - 0.27e-3, abs=5e-6)
    assert 0.5 * widths(stamped) == pytest.approx(0.95 * 0.27e-3, rel=0.01)
    assert unstamped.value == pytest.approx(passed + 0.5e-3 - 0.27e-3, abs=5e-6)
    assert 0.5 * widths(unstamped) == pytest.approx(combined((0.5e-3, 0.27e-3)), rel=0.01)


def test_a_swing_that_leaves_the_band_between_samples_counts():
    def away(t):
        return -np.exp(-25.0 * t) * np.cos(183.0 * t)

    fine, sampled = np.arange(0.0, 0.4, 1e-6), np.arange(0.0, 0.4, 1e-3)
    settled, seen = (t[np.flatnonzero(np.abs(away(t)) > 0.05)[-1]] for t in (fine, sampled))
    assert settled - seen > 0.01
    (found,) = step_responses([steps((0.3, 1.0), lambda t: 1.0 + away(t), hold=0.5)], EXACT)
    assert found.settling.value == pytest.approx(settled, abs=0.5 * widths(found.settling) + 1e-4)
