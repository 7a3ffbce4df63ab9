"""A motion that was designed to tell effects apart does so; a textbook sweep does not."""

import pytest
from synthetic import MODEL, measurement, swept, textbook

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.filter_record import as_record
from etb_hil.discrepancy.plan.isolability import isolability_of
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.hypotheses.candidates import candidates
from etb_hil.hypotheses.information import information_of
from etb_hil.hypotheses.prepared import prepared
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.measured import measured_parameter


@pytest.fixture(scope="module")
def records():
    return [[measurement(MODEL.vector(), 1, angle)] for angle in (textbook(), swept())]


@pytest.fixture(scope="module")
def parts(records):
    return [isolability_of(MODEL, [record]) for record in records]


@pytest.mark.slow
def test_a_textbook_sweep_leaves_more_open(parts):
    slow, designed = parts
    assert {"end_stop_compliance", "limp_home_dead_zone"} <= set(slow.hidden)  # it meets no stop, and not limp-home
    assert designed.hidden == []
    assert len(designed.not_isolable) < len(slow.not_isolable)
    assert len(designed.not_isolable) <= 10


def test_of_what_a_throttle_cannot_have_nothing_is_said(parts):
    for part in parts:
        told = {*part.hidden, *(id_ for pair in part.not_isolable for id_ in pair[:2])}
        assert told
        assert not told & {"fan_drag", "gravity_load"}


@pytest.mark.study
def test_another_record_never_hides_what_the_first_one_shows(records, parts):
    assert set(isolability_of(MODEL, records).hidden) <= set(parts[1].hidden)


@pytest.mark.slow
def test_brush_drop_and_dead_time_cannot_be_told_apart_by_motion(parts):
    not_isolable = {frozenset(pair[:2]) for pair in parts[1].not_isolable}
    assert frozenset({"brush_drop", "hbridge_dead_time"}) in not_isolable


@pytest.mark.study
def test_play_and_a_soft_shaft_are_no_more_told_apart_than_a_name_tells_them(parts):
    both = {"gear_backlash", "shaft_compliance"}
    cosine = next(one[2] for one in parts[1].not_isolable if set(one[:2]) == both)
    assert cosine > 0.95

    p = MODEL.vector()
    p[list(CATALOGUE["gear_backlash"].indices)] = 0.004, 0.006
    (named,) = search(MODEL, [Balances(measurement(p, 1), MODEL)]).accepted
    assert both <= {named.winner.id, *named.ambiguity_group}


def smallest(model, ids):
    """Return the smallest strengths of effects that a textbook sweep shows."""
    made = prepared(as_record(measurement(MODEL.vector(), 1, textbook()), model), model)
    record, fit = made.calibrated()
    asked = [candidates(record, fit.parameters, [made.effects[id_]])[0] for id_ in ids]
    found = information_of(record, fit.parameters, fit.unknowns, asked)
    return [found.smallest(number, one.unknowns()[0].high) for number, one in enumerate(asked)]


@pytest.mark.study
def test_beside_a_number_that_was_measured_a_smaller_effect_shows():
    read = MODEL.knowing([measured_parameter(MODEL.parameters["resistance"], MODEL.values.resistance, 0.002)])
    ids = "supply_sag", "current_sensor_gain"
    for less, more in zip(smallest(read, ids), smallest(MODEL, ids), strict=True):
        assert less < 0.5 * more
