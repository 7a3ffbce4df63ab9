"""A step or a return that its samples do not show to the end passes no unit, and fails none by what is not known."""

import math
import re

import numpy as np
import pytest
from made_segments import segment
from pushed_rows import pushed_rows
from scipy import stats

from etb_hil.base.outcome import UnitVerdict
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limits import Limit, Limits
from etb_hil.diagnosis.motion.encoder import Encoder
from etb_hil.diagnosis.motion.repeats import Reading, earliest, error_of_means, mean_with_interval
from etb_hil.diagnosis.motion.steps import StepResponse, step_responses
from etb_hil.diagnosis.motion.unseen import COMMANDS_LOST, commands_lost, creep, gap, outside_until, shown, swing_reach
from etb_hil.diagnosis.segments import COMMAND_FRAME_AGE

FINE = np.linspace(0.0, 3.0, 3_000_001)
OF_STEPS = ("step_delay", "step_rise", "step_settling", "step_overshoot")
OF_RETURNS = ("return_time_open", "return_time_closed")


def swing(t, damping=0.35, natural=60.0):
    damped = natural * math.sqrt(1.0 - damping**2)
    decay = np.exp(-damping * natural * t)
    return 1.0 - decay * (np.cos(damped * t) + damping * natural / damped * np.sin(damped * t))


def tail(t, share=0.08, slow_s=0.5):
    """Come near at once, and the rest of the way slowly."""
    return 1.0 - (1.0 - share) * np.exp(-t / 0.008) - share * np.exp(-t / slow_s)


def settling_of(course):
    """Return when a response is within 5 % for good, in s."""
    return float(FINE[np.flatnonzero(np.abs(course(FINE) - 1.0) > 0.05)[-1]])


SETTLING = settling_of(swing)


def a_step(hold, lost=(0.0, 0.0), course=swing):
    """Return a step after 0.3 s that lasts `hold` s, without the samples of a time in s after the command."""
    time = np.arange(0.0, 0.3 + hold, 1e-3)
    since = time - 0.3
    angle = np.where(since < 0.0, 0.3, 0.3 + 0.7 * course(np.maximum(since, 0.0)))
    angle[(since >= lost[0]) & (since < lost[1])] = np.nan
    return segment("step", time, angle=angle, command_position=np.where(since < 0.0, 0.3, 1.0))


def response(hold, lost=(0.0, 0.0), course=swing):
    (found,) = step_responses([a_step(hold, lost, course)], Encoder(18.0, 1e-9))
    return found


COURSES = {
    f"damping {damping}, {natural} rad/s": lambda t, d=damping, n=natural: swing(t, d, n)
    for damping in (0.1, 0.18, 0.35, 0.6, 0.9)
    for natural in (46.0, 60.0, 150.0)
}


@pytest.mark.parametrize(("begin", "course"), [*enumerate(COURSES.values())], ids=COURSES.keys())
def test_a_step_that_the_next_command_cuts_short_says_what_is_true_or_nothing(begin, course):
    """Courses share the times at which they are cut short, or all of them would take minutes."""
    settled, peak = settling_of(course), float(np.max(course(FINE))) - 1.0
    read = 0
    for hold in np.arange(0.045 + 0.005 * (begin % 4), 1.2, 0.02):
        found = response(hold, course=course)
        if not isinstance(found, StepResponse):
            assert 0.0 <= found.least <= min(settled, hold)
            continue
        read += 1
        for name, truth, edge in (("settling", settled, 4e-4), ("overshoot", max(peak, 0.0), 2e-3)):
            _, low, high = mean_with_interval([getattr(found, name)])
            slack = edge + 0.05 * (high - low)  # of 95 % intervals
            assert low - slack <= truth <= high + slack, (name, hold, truth, low, high)
    assert read


@pytest.mark.parametrize("slow_s", [0.1, 0.2, 0.5])
@pytest.mark.parametrize("share", [0.02, 0.08, 0.2])
def test_a_plate_that_creeps_far_for_the_time_that_it_is_given_has_not_settled(share, slow_s):
    """Where it still goes by 5 % of the step in so much more time, its final angle is not known."""
    for hold in np.arange(0.15, 0.8, 0.02):
        goes_on = hold * share / slow_s * math.exp(-hold / slow_s)
        found = response(hold, course=lambda t: tail(t, share, slow_s))
        assert isinstance(found, StepResponse) or goes_on > 0.008, hold
        assert not isinstance(found, StepResponse) or goes_on < 0.026, hold


@pytest.mark.parametrize("begin", np.arange(0.0, 0.25, 0.012))
def test_samples_that_are_lost_during_a_step_make_it_no_shorter(begin):
    found = response(0.5, (begin, begin + 0.037))
    assert re.search("no samples for 3[789] ms of the motion", found.note)
    assert 0.0 <= found.least <= SETTLING


def test_samples_that_are_lost_before_a_command_leave_its_instant_open():
    found = response(0.5, (-0.02, 0.0))
    assert "no samples for 21 ms" in found.note


@pytest.mark.parametrize(
    ("between", "longest"),
    [
        ([1e-3] * 9 + [4.9e-3], 0.0),  # read across
        ([1e-3] * 9 + [5.1e-3], 5.1e-3),
        ([1e-2] * 9, 1e-2),  # samples that are 10 ms apart show no motion
        ([], 0.0),
    ],
)
def test_a_gap_is_longer_than_what_is_read_across(between, longest):
    time = np.concatenate([[0.0], np.cumsum(between)])
    assert gap(time, 0) == pytest.approx(longest, abs=1e-12)


def test_a_gap_of_just_the_longest_that_is_read_across_is_read_across():
    assert gap(np.array([0.0, 0.25, 0.5]), 0, 0.25) == 0.0
    assert gap(np.array([0.0, 0.25, 0.5]), 0, 0.2) == 0.25


def test_a_gap_before_the_motion_does_not_count_but_the_one_at_its_first_sample_does():
    time = np.array([0.0, 0.05, 0.051, 0.052, 0.053, 0.054])
    assert gap(time, 1) == pytest.approx(0.05)
    assert gap(time, 2) == 0.0


def test_a_plate_is_outside_a_band_about_any_final_angle_while_it_still_moves_by_twice_the_band():
    time = np.arange(5.0)
    angle = np.array([0.0, 5.0, 2.0, 0.0, 0.5])
    assert outside_until(time, angle, 0, 0.9) == 2.0
    assert outside_until(time, angle, 3, 0.9) is None
    assert outside_until(time, angle, 0, 2.4) == 1.0
    assert outside_until(time, angle, 0, 2.5) is None


@pytest.mark.parametrize(("until", "seconds"), [(None, 0.0), (1.5, 0.4), (1.0, 0.0), (0.2, 0.0)])
def test_the_earliest_end_of_a_motion_counts_from_the_latest_instant_of_its_command(until, seconds):
    command = Reading(1.0, own=((0.1, 0.1),))
    assert earliest(until, command) == pytest.approx(seconds)


def test_an_error_that_one_of_two_repeats_lacks_moves_their_mean_half_as_far():
    sure, unsure = Reading(1.0), Reading(1.0, ((0.2, 0.6),))
    _, low, high = mean_with_interval([sure, unsure])
    assert (1.0 - low, high - 1.0) == (pytest.approx(0.95 * 0.1), pytest.approx(0.95 * 0.3))


def test_the_error_of_a_sum_of_means_is_that_of_students_t():
    """Of (1, 3) and (2, 4, 9) the scatter has 3 degrees of freedom and the variance (2 + 26) / 3."""
    error = math.sqrt(28.0 / 3.0 * (1.0 / 2.0 + 1.0 / 3.0))
    half_width = 1.96 * error_of_means([(1.0, 3.0), (2.0, 4.0, 9.0)])
    assert half_width == pytest.approx(stats.t.ppf(0.975, 3) * error, rel=1e-3)
    assert 1.96 * error_of_means([(1.0, 3.0)]) == pytest.approx(stats.t.ppf(0.975, 1) * 1.0, rel=1e-3)
    assert error_of_means([(1.0,), (2.0,)]) == 0.0


def test_repeats_some_of_which_have_a_command_with_a_stamp_have_a_mean():
    stamped, bare = Reading(1.0, ((0.1, 0.1),)), Reading(2.0, ((0.1, 0.1), (0.3, 0.3)))
    mean, low, high = mean_with_interval([stamped, bare])
    assert mean == 1.5
    assert low < 1.4
    assert high > 1.6
    assert mean_with_interval([bare, stamped]) == (mean, low, high)


def with_commands(pace_s, lost_at):
    """Return a step with commands of a steady pace from 0 s on, without those at some times in s."""
    made = a_step(0.5)
    sent = [at for at in np.arange(0.0, 0.8, pace_s) if not any(abs(at - one) < 1e-6 for one in lost_at)]
    newest = np.array(sent)[np.maximum(np.searchsorted(sent, made.time + 1e-9) - 1, 0)]
    return segment("step", made.time, **{**made.columns, COMMAND_FRAME_AGE: made.time - newest + 1e-4})


@pytest.mark.parametrize(("lost_at", "is_open"), [((), False), ((0.1,), False), ((0.4,), False), ((0.29,), True)])
def test_a_command_before_which_one_is_missing_may_have_come_before(lost_at, is_open):
    (found,) = step_responses([with_commands(0.01, lost_at)], Encoder(18.0, 1e-9))
    assert isinstance(found, StepResponse) is not is_open
    assert not is_open or (found.note, found.least) == (COMMANDS_LOST, 0.0)


def test_a_command_is_missing_where_the_last_one_is_older_than_one_and_a_half_paces():
    """The median age is half a pace: the pace is 1 s here, and the numbers are exact in binary."""
    ages = np.array([0.5, 0.5, 1.5, 1.5078125, 0.5, 0.5, 4.0])
    made = segment("step", np.arange(7.0), **{COMMAND_FRAME_AGE: ages})
    assert [commands_lost(made, index) for index in range(8)] == [False] * 4 + [True, False, False, False]
    late = segment("step", np.arange(5.0), **{COMMAND_FRAME_AGE: np.array([0.5, 4.0, 0.5, 0.5, 0.5])})
    assert [commands_lost(late, index) for index in range(4)] == [False, False, True, False]
    assert not commands_lost(segment("step", np.arange(7.0)), 3)  # without stamps nothing says so


def test_samples_without_an_angle_and_times_that_come_twice_are_left_out():
    made = segment("step", np.array([0.0, 1.0, 1.0, 2.0, 3.0]), angle=np.array([5.0, 6.0, 7.0, np.nan, 8.0]))
    assert [one.tolist() for one in shown(made, 0, 5)] == [[0.0, 1.0, 3.0], [5.0, 6.0, 8.0]]
    assert [one.tolist() for one in shown(made, 1, 2)] == [[1.0], [6.0]]


def test_a_plate_within_one_step_of_the_encoder_is_at_rest_and_one_within_two_is_not():
    error = 1.0 / math.sqrt(12.0)  # of a step of 1
    assert creep(np.array([0.0, 0.0, 0.5, 0.5, 1.0, 1.0]), error) == 0.0
    assert creep(np.array([0.0, 0.0, 1.0, 1.0, 2.0, 2.0]), error) == 3.0
    assert creep(np.array([0.0, 0.0, 2.0, 2.0, 2.0, 2.0]), error) == 0.0  # it stands still in the end


@pytest.mark.parametrize("seed", range(40))
def test_any_samples_that_are_left_of_a_step_are_read_or_not(seed):
    rng = np.random.default_rng(seed)
    made = a_step(float(rng.choice([0.045, 0.06, 0.3, 0.6])))
    angle = made.columns["angle"].copy()
    angle[rng.random(len(angle)) < rng.choice([0.05, 0.5, 0.9, 0.98])] = np.nan
    time = np.sort(np.concatenate([made.time[3:], rng.choice(made.time, 3)]))  # some times come twice
    for one in step_responses([segment("step", time, **{**made.columns, "angle": angle})], Encoder(18.0, 1e-9)):
        if isinstance(one, StepResponse):
            _, low, high = mean_with_interval([one.settling])
            assert low <= high
        else:
            assert 0.0 <= one.least <= 0.6


@pytest.mark.parametrize("part", [8, 3, 1])
def test_a_plate_that_creeps_is_not_at_rest(part):
    angle = np.linspace(0.0, 0.1, 30 * part)
    assert creep(angle, 1e-9) == pytest.approx(0.1, rel=0.05)
    assert swing_reach(angle, 0.1, 1e-9) == (0.0, 0.0)
    assert creep(angle, 0.1) == 0.0


def test_the_final_angle_of_a_swing_lies_between_its_ends():
    angle = np.array([0.0, 1.0, 4.0, 5.0, 3.0, 1.0])
    assert creep(angle, 1e-9) == 0.0
    assert swing_reach(angle, 2.0, 1e-9) == (2.0, 3.0)
    assert swing_reach(angle, 2.0, 1.0) == (0.0, 0.0)  # a step of the encoder is sqrt(12) of its errors


@pytest.fixture(scope="module")
def pushed():
    """Return the steps and returns of an end-of-line run with their phases, with the zero before; and the model."""
    found, model = pushed_rows()
    return [one for one in found if one[1].kind in {"current_zero", "step", "release"}], model


def judged(pushed, limits, keep=lambda since, _: since < math.inf):
    """Judge the samples of which `keep` says so.

    It is asked by the time in s since the last change of the command, and by the phase.
    """
    rows, model = pushed
    diagnosis = Diagnosis(model, Limits("A-1", "1", 0.0, limits))
    changed, before = 0, None
    for block, phase in rows:
        asked = np.stack([block.columns["command_mode"], np.nan_to_num(block.columns["command_position"])], axis=1)
        since = np.empty(len(block))
        for k, (one, time_ns) in enumerate(zip(asked.tolist(), block.time_ns.tolist(), strict=True)):
            changed, before = (changed, before) if one == before else (time_ns, one)
            since[k] = (time_ns - changed) * 1e-9
        kept = np.flatnonzero((phase.kind == "current_zero") | keep(since, phase))
        diagnosis.push(block.select(kept), phase)
    return diagnosis.finish().measurements


@pytest.fixture(scope="module")
def whole(pushed):
    return judged(pushed, {name: Limit(high=1e9) for name in (*OF_STEPS, *OF_RETURNS)})


@pytest.mark.parametrize("begin", [0.01, 0.05, 0.1, 0.15, 0.2])
@pytest.mark.parametrize("length", [0.02, 0.095])
def test_a_unit_that_fails_by_a_time_does_not_pass_as_its_samples_are_lost(pushed, whole, begin, length):
    limits = {
        one.id: Limit(high=0.97 * one.low) for one in whole.values() if one.id.startswith((*OF_STEPS, *OF_RETURNS))
    }
    assert len(limits) == 4 * len(OF_STEPS) + len(OF_RETURNS)
    found = judged(pushed, limits, lambda since, _: (since < begin) | (since >= begin + length))
    assert not [name for name in limits if name in found and found[name].verdict is UnitVerdict.PASS]


@pytest.mark.parametrize("given", [0.06, 0.1, 0.15, 0.2, 0.25])
def test_a_healthy_unit_does_not_fail_as_it_is_given_little_time(pushed, whole, given):
    limits = {
        one.id: Limit(high=1.03 * one.high) for one in whole.values() if one.id.startswith((*OF_STEPS, *OF_RETURNS))
    }
    limits |= {"default_position": Limit(math.radians(7.0), math.radians(9.0))}
    limits |= {"default_position_spread": Limit(high=math.radians(0.25))}
    found = judged(pushed, limits, lambda since, _: since < given)
    assert not [name for name in limits if name in found and found[name].verdict is UnitVerdict.FAIL]
    for name in OF_RETURNS:
        assert found[name].verdict is not UnitVerdict.PASS or given > whole[name].value


def test_the_least_time_of_a_motion_fails_no_lower_limit(pushed):
    found = judged(pushed, {name: Limit(low=0.5) for name in OF_RETURNS}, lambda since, _: since < 0.15)
    assert {found[name].verdict for name in OF_RETURNS} == {UnitVerdict.INCONCLUSIVE}


@pytest.mark.parametrize("begin", [0.002, 0.1])
def test_a_return_whose_samples_are_lost_passes_no_unit_by_the_others(pushed, begin):
    phases = list(dict.fromkeys(phase for _, phase in pushed[0] if phase.kind == "release"))
    for lost in phases[:2]:
        found = judged(
            pushed,
            {name: Limit(high=1e9) for name in OF_RETURNS},
            lambda since, phase, n=lost: (phase != n) | (since < begin),
        )
        verdicts = {name: found[name].verdict for name in OF_RETURNS if name in found}
        assert list(verdicts.values()).count(UnitVerdict.PASS) <= 1


@pytest.mark.parametrize("every", [5, 10, 20])
def test_samples_that_are_too_slow_for_a_motion_decide_nothing(pushed, whole, every):
    at_edge = {
        one.id: Limit(high=0.97 * one.low) for one in whole.values() if one.id.startswith((*OF_STEPS, *OF_RETURNS))
    }
    inside = {name: Limit(high=1.06 * limit.high) for name, limit in at_edge.items()}
    for limits, wrong in ((at_edge, UnitVerdict.PASS), (inside, UnitVerdict.FAIL)):
        found = judged(pushed, limits, lambda since, _: np.arange(len(since)) % every == 3)
        assert not [name for name in limits if name in found and found[name].verdict is wrong]
