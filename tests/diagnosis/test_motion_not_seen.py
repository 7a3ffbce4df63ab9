"""A step or a return that its samples do not show to the end passes no unit, and fails none by what is not known."""

import math
import re

import numpy as np
import pytest
from end_of_line_study import job_of, run
from made_segments import segment
from scipy import stats

from etb_hil.base.outcome import UnitVerdict
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limits import Limit, Limits
from etb_hil.diagnosis.motion.encoder import Encoder
from etb_hil.diagnosis.motion.repeats import Reading, earliest, error_of_means, mean_with_interval
from etb_hil.diagnosis.motion.steps import StepResponse, step_responses
from etb_hil.diagnosis.motion.unseen import gap, outside_until

DAMPING, NATURAL = 0.35, 60.0
DAMPED = NATURAL * math.sqrt(1.0 - DAMPING**2)
OVERSHOOT = math.exp(-DAMPING * math.pi / math.sqrt(1.0 - DAMPING**2))
OF_STEPS = ("step_delay", "step_rise", "step_settling", "step_overshoot")
OF_RETURNS = ("return_time_open", "return_time_closed")


def swing(t):
    decay = np.exp(-DAMPING * NATURAL * t)
    return 1.0 - decay * (np.cos(DAMPED * t) + DAMPING * NATURAL / DAMPED * np.sin(DAMPED * t))


FINE = np.linspace(0.0, 1.0, 1_000_001)
SETTLING = float(FINE[np.flatnonzero(np.abs(swing(FINE) - 1.0) > 0.05)[-1]])


def a_step(hold, lost=(0.0, 0.0)):
    """Return a step after 0.3 s that lasts `hold` s, without the samples of a time in s after the command."""
    time = np.arange(0.0, 0.3 + hold, 1e-3)
    since = time - 0.3
    angle = np.where(since < 0.0, 0.3, 0.3 + 0.7 * swing(np.maximum(since, 0.0)))
    angle[(since >= lost[0]) & (since < lost[1])] = np.nan
    return segment("step", time, angle=angle, command_position=np.where(since < 0.0, 0.3, 1.0))


def response(hold, lost=(0.0, 0.0)):
    (found,) = step_responses([a_step(hold, lost)], Encoder(18.0, 1e-9))
    return found


@pytest.mark.parametrize("hold", np.arange(0.045, 0.4, 0.01))
def test_a_step_that_the_next_command_cuts_short_says_what_is_true_or_nothing(hold):
    found = response(hold)
    if isinstance(found, StepResponse):
        assert found.overshoot.value == pytest.approx(OVERSHOOT, abs=0.02)
        assert found.settling.value == pytest.approx(SETTLING, abs=4e-3)
    else:
        assert 0.0 <= found.least <= min(SETTLING, hold)


def test_a_step_that_was_seen_for_long_enough_is_read():
    assert isinstance(response(0.3), StepResponse)
    assert not isinstance(response(0.1), StepResponse)


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
        ([1e-2] * 9 + [2.4e-2], 0.0),  # samples that are 10 ms apart
        ([1e-2] * 9 + [2.6e-2], 2.6e-2),
        ([2.0**-6] * 9 + [2.5 * 2.0**-6], 0.0),  # numbers that are exact in binary: on the edge it is read
        ([], 0.0),
    ],
)
def test_a_gap_is_longer_than_what_is_read_across(between, longest):
    time = np.concatenate([[0.0], np.cumsum(between)])
    assert gap(time, 0) == pytest.approx(longest, abs=1e-12)


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


@pytest.fixture(scope="module")
def pushed():
    """Return the steps and returns of an end-of-line run with their phases, with the zero before; and the model."""
    job, found = job_of(), []
    usual = Diagnosis.push
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            Diagnosis, "push", lambda self, rows, phase: found.append((rows, phase)) or usual(self, rows, phase)
        )
        run(job, job.unit, 5, piece_s=0.1)
    return [one for one in found if one[1].kind in {"current_zero", "step", "release"}], job.model


def judged(pushed, limits, keep=lambda since: since < math.inf):
    """Judge the samples of which `keep` says so, by the time in s since the last change of the command."""
    rows, model = pushed
    diagnosis = Diagnosis(model, Limits("A-1", "1", 0.0, limits))
    changed, before = 0, None
    for block, phase in rows:
        asked = np.stack([block.columns["command_mode"], np.nan_to_num(block.columns["command_position"])], axis=1)
        since = np.empty(len(block))
        for k, (one, time_ns) in enumerate(zip(asked.tolist(), block.time_ns.tolist(), strict=True)):
            changed, before = (changed, before) if one == before else (time_ns, one)
            since[k] = (time_ns - changed) * 1e-9
        diagnosis.push(block.select(np.flatnonzero((phase.kind == "current_zero") | keep(since))), phase)
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
    found = judged(pushed, limits, lambda since: (since < begin) | (since >= begin + length))
    assert not [name for name in limits if name in found and found[name].verdict is UnitVerdict.PASS]


@pytest.mark.parametrize("given", [0.06, 0.1, 0.15, 0.2, 0.25])
def test_a_healthy_unit_does_not_fail_as_it_is_given_little_time(pushed, whole, given):
    limits = {
        one.id: Limit(high=1.03 * one.high) for one in whole.values() if one.id.startswith((*OF_STEPS, *OF_RETURNS))
    }
    limits |= {"default_position": Limit(math.radians(7.0), math.radians(9.0))}
    limits |= {"default_position_spread": Limit(high=math.radians(0.25))}
    found = judged(pushed, limits, lambda since: since < given)
    assert not [name for name in limits if name in found and found[name].verdict is UnitVerdict.FAIL]
    for name in OF_RETURNS:
        assert found[name].verdict is not UnitVerdict.PASS or given > whole[name].value


def test_the_least_time_of_a_motion_fails_no_lower_limit(pushed):
    found = judged(pushed, {name: Limit(low=0.5) for name in OF_RETURNS}, lambda since: since < 0.15)
    assert {found[name].verdict for name in OF_RETURNS} == {UnitVerdict.INCONCLUSIVE}
