"""Hypotheses about records of an independent throttle with a known fault: the true one is the likeliest."""

from dataclasses import replace

import numpy as np
import pytest
from independent_throttle import SAMPLE_S, Unit, friction_check, off_by_tolerances, sense
from throttle_as_model import bench_model

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.estimation.record import record
from etb_hil.hypotheses.comparison import are_numbers
from etb_hil.hypotheses.misfit import ANY, Misfit, misfit
from etb_hil.hypotheses.search import compared, searched
from etb_hil.hypotheses.step import Step
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import SampleBlock

RATE = 1000
FAULTS = {
    "break-away": ({"stiction": 0.5}, 1.0),
    "spring": ({"preload_open": 0.25}, 1.0),
    "motor": ({"torque_per_ampere": 0.3, "back_emf": 0.3}, 1.0),
    "winding": ({"resistance": 2.4}, 1.0),
    "sensor": ({}, 1.15),
    "everywhere": ({"coulomb": 0.29, "stiction": 0.35}, 1.0),
}


def _columns(unit, gain, seed):
    """Return time and columns of a friction check until the bridge opens, and the bench's model."""
    rng = np.random.default_rng(seed)
    truth, phases = friction_check(unit, creeps=())
    seen = sense(unit, truth, RATE, rng, current_offset=0.0)
    rows = slice(0, phases[-1][1] * RATE // round(1.0 / SAMPLE_S))
    columns = {
        "motor_current": gain * seen.current[rows],
        "motor_angle": seen.motor_angle[rows],
        "motor_voltage": seen.voltage[rows],
        "throttle_angle": seen.throttle_angle[rows],
    }
    return seen.time_ns[rows], columns, bench_model(off_by_tolerances(Unit(), rng))


def _record(kind=None, seed=71):
    by, gain = FAULTS.get(kind, ({}, 1.0))
    time_ns, columns, model = _columns(replace(Unit(), **by), gain, seed)
    made = record(
        time_ns * 1e-9,
        columns["motor_voltage"],
        model,
        current=columns["motor_current"],
        motor=columns["motor_angle"] / Unit().gear_ratio,
        plate=columns["throttle_angle"],
    )
    return made, model


def _compared(kind, *ids):
    made, model = _record(kind)
    return compared(made, model, [f"parameter:{id_}" if id_ in BASE else id_ for id_ in ids]).hypotheses


@pytest.fixture(scope="module")
def break_away():
    """Hypotheses about a unit that breaks away too hard, the likeliest first."""
    return _compared("break-away", "stiction", "friction_load", "presliding_hysteresis", "current_sensor_gain")


BASE = {"stiction", "coulomb", "preload_open", "preload_close", "torque_per_ampere", "resistance", "inertia"}


def test_a_healthy_unit_leaves_nothing():
    found = searched(*_record())
    assert misfit(found.calibrated).is_nothing
    assert (found.verdict, found.causes) == ("adequate", ())


def test_a_break_away_that_is_too_hard_excludes_all_others(break_away):
    _excludes_all_others("stiction", break_away)


@pytest.mark.study
@pytest.mark.parametrize(
    ("kind", "cause", "others"),
    [
        ("motor", "torque_per_ampere", ("supply_sag", "preload_open", "preload_close", "inertia")),
        ("spring", "preload_open", ("spring_preload_shift", "supply_sag", "aerodynamic_torque")),
        ("winding", "resistance", ("supply_sag", "hbridge_dead_time", "resistance_temperature")),
    ],
)
def test_a_number_that_is_wrong_excludes_all_others(kind, cause, others):
    _excludes_all_others(cause, _compared(kind, cause, *others))


def _excludes_all_others(cause, hypotheses):
    first, *rest = hypotheses
    assert rest
    assert first.ids == (f"parameter:{cause}",)
    assert first.misfit.total < 1.0 < first.without.total
    assert all(first.excludes(one) for one in rest)
    assert not any(one.excludes(first) for one in rest)


def test_what_gains_little_beside_a_cause_and_leaves_much_is_excluded_by_far(break_away):
    first = break_away[0]
    far = replace(first, ids=("friction_load",), evidence=0.3 * first.evidence, misfit=first.without)
    assert first.excludes_by_far(far)
    assert first.excludes(far)
    assert not first.excludes_by_far(replace(far, evidence=0.9 * first.evidence))
    assert not first.excludes_by_far(replace(far, misfit=Misfit(*[0.5] * len(far.misfit))))
    assert not replace(first, evidence=-100.0).excludes_by_far(replace(far, evidence=-99.0))


@pytest.mark.parametrize(("evidence", "is_there"), [(30.0, True), (20.0, True), (3.0, False)])
def test_what_is_as_likely_as_a_cause_is_in_its_group_though_it_gains_too_little_to_be_one(
    break_away, evidence, is_there
):
    first = break_away[0]
    cause = replace(first, evidence=31.0)
    other = replace(first, ids=("friction_load",), evidence=evidence)
    step = Step(first.without, (cause, other), ANY, is_material=True)
    assert (step.group == (other,)) is is_there


def test_what_is_compared_does_not_depend_on_how_many_cores_there_are(monkeypatch):
    made, model = _record("spring")
    short, ids = made.thinned(3000, 12), ["parameter:preload_open", "spring_preload_shift", "supply_sag"]
    answers = []
    for cores in (1, 2):
        monkeypatch.setattr("etb_hil.base.side_by_side.cores", lambda cores=cores: cores)
        found = compared(short, model, ids).hypotheses
        answers.append([(one.ids, one.evidence, one.misfit) for one in found])
    assert len(answers[0]) > 2
    assert answers[0] == answers[1]


def test_friction_that_rises_everywhere_is_both_numbers_together():
    first, *rest = _compared("everywhere", "presliding_hysteresis", "coulomb", "stiction")
    assert first.ids == ("parameter:coulomb", "parameter:stiction")
    alone = [one for one in rest if are_numbers(one.ids)]
    assert alone
    assert all(first.excludes(one) for one in alone)


@pytest.mark.parametrize(
    ("kind", "verdict", "named"),
    [pytest.param("break-away", "explained", "stiction", marks=pytest.mark.study), (None, "adequate", "")],
)
def test_what_a_search_leaves_open_is_decided(kind, verdict, named):
    by, gain = FAULTS.get(kind, ({}, 1.0))
    time_ns, columns, model = _columns(replace(Unit(), **by), gain, 72)
    recording = Recording("friction check", ClockGrade.TABLE)
    recording.append([SampleBlock("table", time_ns, time_ns, columns, np.zeros(len(time_ns), np.int64))])
    findings = search(model, [Balances(one, model) for one in measurements_of(recording, model)])
    causes = [(one.winner.id, one.ambiguity_group) for one in findings.accepted]
    assert findings.verdict == verdict
    assert causes == ([(f"parameter:{named}", [])] if named else [])
