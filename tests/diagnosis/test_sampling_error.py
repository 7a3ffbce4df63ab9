"""Intervals of a run whose signal is read a few times a second, from all readings and from half of them."""

import pytest

from etb_hil.base.outcome import UnitVerdict
from etb_hil.diagnosis.result import DiagnosisResult, Reason
from etb_hil.diagnosis.sampling_error import with_sampling_error
from etb_hil.results.measurement import Measurement, Measurements

PASS, INCONCLUSIVE = UnitVerdict.PASS, UnitVerdict.INCONCLUSIVE
BOUND, MEASURED = (None, 0.0), (0.13, 0.12)  # value and low


def judged(high, value=None, low=0.0):
    one = Measurement("T_c", "sliding friction", value, "N·m", low, high, None, 0.2, PASS)
    return DiagnosisResult(PASS, (Reason("within_limits", "said"),), Measurements([one]), (), 0, {})


def widened(all_read, half_read):
    """Return T_c with its sampling error, and the verdict and first reason of the run."""
    found = with_sampling_error(all_read, half_read, 0.03, "read twice a second")
    return found.measurements["T_c"], found.verdict, found.reasons[0].id


@pytest.mark.parametrize("half", [BOUND, MEASURED])
@pytest.mark.parametrize("high", [0.13, 0.17])
def test_a_bound_is_higher_by_what_half_of_the_readings_change_of_it(half, high):
    found, verdict, _ = widened(judged(0.15), judged(high, *half))
    assert (found.value, found.low, found.high) == (None, 0.0, pytest.approx(0.17))
    assert (found.is_bound, found.verdict, verdict) == (True, PASS, PASS)


def test_a_bound_that_its_sampling_error_lifts_to_the_limit_decides_nothing():
    found, verdict, reason = widened(judged(0.15), judged(0.2))
    assert (found.low, found.high, found.verdict) == (0.0, pytest.approx(0.2), INCONCLUSIVE)
    assert (verdict, reason) == (INCONCLUSIVE, "read_too_seldom")


def test_a_measured_value_that_half_of_the_readings_bound_keeps_its_value():
    found, verdict, _ = widened(judged(0.14, *MEASURED), judged(0.16))
    assert (found.value, found.low, found.high) == (0.13, 0.0, pytest.approx(0.16))
    assert verdict is PASS


def test_a_bound_that_half_of_the_readings_do_not_give_is_unknown():
    nothing = DiagnosisResult(INCONCLUSIVE, (Reason("too_few_windows", "said"),), Measurements(), (), 0, {})
    found, verdict, reason = widened(judged(0.15), nothing)
    assert (found.is_known, found.verdict) == (False, INCONCLUSIVE)
    assert (verdict, reason) == (INCONCLUSIVE, "read_too_seldom")
