"""What a model lacks may show in a few places only: the samples that are searched have them."""

from dataclasses import replace

import numpy as np
import pytest
from explain_cases import hidden_case

from etb_hil.discrepancy.measured.filter_record import as_record
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.estimation.record import joined
from etb_hil.hypotheses.constants import PARTS, SEARCHED
from etb_hil.hypotheses.informative_part import informative_part
from etb_hil.hypotheses.prepared import prepared
from etb_hil.hypotheses.search import searched


def _whole(hidden):
    return joined([as_record(one, hidden.model) for one in measurements_of(hidden.recording, hidden.model)])


@pytest.fixture(scope="module")
def healthy():
    hidden = hidden_case(979400, rate=1000)
    return _whole(hidden), hidden.model


def _numbered(record):
    """Return the record with the number of each sample as its temperature, in millionths of a degree."""
    return replace(record, temperature=25.0 + 1e-6 * np.arange(len(record)))


def _numbers(record):
    return np.round(1e6 * (record.temperature - 25.0)).astype(int)


def test_a_knock_between_the_samples_along_the_record_is_searched(healthy):
    whole, model = healthy
    whole = _numbered(whole)
    taken = np.isin(np.arange(len(whole)), _numbers(informative_part(whole, model)))
    knock = next(rows for rows in np.arange(len(whole)).reshape(-1, 250)[20:] if not taken[rows].any())[100:200]
    readings = whole.readings.copy()
    readings[knock, 0] += 0.5  # A
    found = informative_part(replace(whole, readings=readings), model)
    assert len(found) == SEARCHED
    assert np.isin(knock, _numbers(found)).all()


def test_of_a_healthy_record_the_samples_are_not_those_of_the_largest_noise(healthy):
    whole, model = healthy
    numbers = _numbers(informative_part(_numbered(whole), model))
    made = prepared(whole, model)
    record, fit = made.calibrated()
    squared = fit.filtered.whitened**2
    assert np.allclose(squared[numbers].mean(axis=0), squared.mean(axis=0), rtol=0.05)
    assert len(record) == len(whole)


def test_a_record_of_no_more_samples_is_searched_whole(healthy):
    whole, model = healthy
    short = whole.part(slice(0, SEARCHED))
    assert informative_part(short, model) is short


EVERY_CANDIDATE = pytest.param(None, marks=pytest.mark.study, id="every candidate")


@pytest.mark.parametrize("ids", [["end_stop_compliance", "parameter:stop_low", "parameter:stop_high"], EVERY_CANDIDATE])
def test_soft_stops_that_few_samples_meet_are_found_at_2_khz(ids):
    hidden = hidden_case(142000, ("end_stop_compliance",), "strong")
    found = searched(_whole(hidden), hidden.model, ids=ids)
    assert [step.best.ids for step in found.causes] == [("end_stop_compliance",)]


def test_a_stop_inside_its_tolerance_is_no_cause_beside_a_late_angle():
    """The calibrated model holds the stop on a hill, where the delay is not known yet."""
    hidden = hidden_case(142033, ("motor_angle_delay",), "strong")
    found = searched(_whole(hidden).thinned(SEARCHED // 2, PARTS), hidden.model)
    assert [step.best.ids for step in found.causes] == [("motor_angle_delay",)]
    assert found.verdict == "explained"


@pytest.mark.parametrize("ids", [["parameter:preload_close", "end_stop_compliance"], EVERY_CANDIDATE])
def test_a_cause_that_led_away_from_a_local_optimum_alone_is_none(ids):
    """Beside a spring's preload that is off, the first fit stays where a soft stop alone leads on."""
    hidden = hidden_case(166020, ("parameter:preload_close",), "strong")
    found = searched(_whole(hidden), hidden.model, ids=ids)
    assert [step.best.ids for step in found.causes] == [("parameter:preload_close",)]
