"""What a model lacks may show in a few places only: the samples that are searched have them."""

from dataclasses import replace

import numpy as np
import pytest
from explain_cases import hidden_case

from etb_hil.discrepancy.measured.filter_record import as_record
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.estimation.record import joined
from etb_hil.hypotheses.constants import PARTS, SEARCHED
from etb_hil.hypotheses.search import searched
from etb_hil.hypotheses.telling import telling


def _whole(hidden):
    return joined([as_record(one, hidden.model) for one in measurements_of(hidden.recording, hidden.model)])


@pytest.fixture(scope="module")
def healthy():
    hidden = hidden_case(979400, rate=1000)
    return _whole(hidden), hidden.model


def test_a_knock_between_the_samples_along_the_record_is_searched(healthy):
    whole, model = healthy
    evenly = telling(whole, model).time
    readings = whole.readings.copy()
    at = next(
        k for k in range(5000, len(whole), 250) if whole.time[k] not in evenly and whole.time[k + 250] not in evenly
    )
    readings[at : at + 100, 0] += 0.5  # A, for a tenth of a second
    found = telling(replace(whole, readings=readings), model)
    assert len(found) <= SEARCHED
    knocked = np.isin(readings[at : at + 100, 0], found.readings[:, 0])
    assert knocked.all()


def test_a_record_of_no_more_samples_is_searched_whole(healthy):
    whole, model = healthy
    short = whole.part(slice(0, SEARCHED))
    assert telling(short, model) is short


def test_soft_stops_that_few_samples_meet_are_found_at_2_khz():
    hidden = hidden_case(142000, ("end_stop_compliance",), "strong")
    found = searched(_whole(hidden), hidden.model)
    assert [step.best.ids for step in found.causes] == [("end_stop_compliance",)]


def test_a_stop_inside_its_tolerance_is_no_cause_beside_a_late_angle():
    """The calibrated model holds the stop on a hill, where the delay is not known yet."""
    hidden = hidden_case(142033, ("motor_angle_delay",), "strong")
    found = searched(_whole(hidden).thinned(SEARCHED, PARTS), hidden.model)
    assert [step.best.ids for step in found.causes] == [("motor_angle_delay",)]
    assert found.verdict == "explained"
