"""What speaks against an answer that fits: numbers on their edges, impossible signs, causes that nothing needs."""

from types import SimpleNamespace

import numpy as np
import pytest
from explain_cases import hidden_case, recording_of
from explain_study import searched
from synthetic import MODEL

from etb_hil.discrepancy.candidates.nonparametric import beyond_tolerances
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.fit import Fit
from etb_hil.discrepancy.fitting.unknowns import base_unknowns, effect_unknowns, start
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.search import decision, rejection
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.layout import EXTENDED, row


def _on_edge(wanted, x):
    """Made-up columns, and the fit of numbers at `x` of which the record wants `wanted`, beside some noise."""
    unknowns = base_unknowns(MODEL)[: len(x)]
    rng = np.random.default_rng(3)
    columns = rng.normal(size=(400, len(x)))
    whole = start(MODEL)
    for unknown, value in zip(unknowns, x, strict=True):
        unknown.put(whole, value)
    residual = columns @ (np.asarray(x) - np.asarray(wanted)) + 0.1 * rng.normal(size=400)
    return columns, Fit(whole, residual, float(residual @ residual)), unknowns


@pytest.mark.parametrize(
    ("wanted", "x", "least", "most"),
    [
        pytest.param([0.2, 1.5, -0.3], [0.2, 1.02, -0.3], 0.9, 1.0, id="wants to leave"),
        pytest.param([0.2, 1.02, -0.3], [0.2, 1.02, -0.3], 0.0, 0.02, id="is there by chance"),
        pytest.param([0.2, 0.9, -0.3], [0.2, 1.02, -0.3], 0.0, 0.02, id="what goes inwards is inside"),
        pytest.param([0.2, 0.9, -0.3], [0.2, 0.8, -0.3], 0.0, 0.0, id="inside already"),
    ],
)
def test_the_rest_that_numbers_would_take_beyond_their_tolerances(wanted, x, least, most):
    share = beyond_tolerances(*_on_edge(wanted, x)).share
    assert least - 1e-9 <= share <= most


def _found(id_, strengths):
    effect = CATALOGUE[id_]
    whole = np.zeros(EXTENDED)
    whole[row(id_) : row(id_) + len(strengths)] = strengths
    winner = SimpleNamespace(candidate=SimpleNamespace(effect=effect), fit=SimpleNamespace(whole=whole), id=id_)
    return SimpleNamespace(winner=winner)


@pytest.mark.parametrize(
    ("id_", "strengths", "speaks"),
    [
        ("presliding_hysteresis", [-0.007], True),
        ("presliding_hysteresis", [0.007], False),
        ("end_stop_compliance", [0.01, -2.5], True),
        ("end_stop_compliance", [30.0, -2.5], False),  # the other stop is hard
        ("friction_temperature", [-0.2, 0.0], False),
        ("aerodynamic_torque", [-0.02], True),  # a flow closes the plate
    ],
)
def test_what_cannot_be_below_nothing_is_no_cause_there(id_, strengths, speaks):
    assert bool(rejection.has_impossible_sign(_found(id_, strengths), None)) is speaks


@pytest.mark.parametrize(
    ("delay", "lag", "speaks"),
    [
        pytest.param(-1.7e-4, 1e-6, True, id="before its cause: the angles are late"),
        pytest.param(-3.7e-4, 3.9e-4, True, id="undone again: one filter is on all channels"),
        pytest.param(1.3e-4, -1.3e-4, True, id="undone again, the other way round"),
        pytest.param(-5.1e-5, 8e-4, False, id="a filter"),
        pytest.param(4e-5, -1.6e-5, False, id="a little late"),
    ],
)
def test_a_current_that_is_no_later_is_not_late(delay, lag, speaks):
    assert bool(rejection.is_not_late(_found("measurement_delay", [delay, lag]), None)) is speaks
    assert not rejection.is_not_late(_found("supply_sag", [delay, lag]), None)


@pytest.mark.slow
def test_angles_that_are_late_make_no_current_early():
    hidden = hidden_case(220410, seconds=20.0)
    table = hidden.case.table
    for role in ("motor_angle", "throttle_angle"):
        table[role] = np.interp(table["time"] - 2e-4, table["time"], table[role])
    model = hidden.model
    findings = search(model, [Balances(m, model) for m in measurements_of(recording_of(hidden.case), model)])
    assert findings.selection_steps[0].winner.id == "measurement_delay"
    assert "the angles may be late" in findings.selection_steps[0].rejection
    assert not findings.accepted


@pytest.mark.parametrize(
    ("id_", "order", "is_drive", "speaks"),
    [
        pytest.param("cogging_torque", 0.82, False, True, id="a gear's"),
        pytest.param("cogging_torque", 12.001, False, False, id="slots"),
        pytest.param("torque_ripple", 6.5, False, True, id="between two numbers of bars"),
        pytest.param("torque_ripple", 6.5, True, False, id="a drive's turn is another's"),
        pytest.param("friction_position_periodic", 0.26, False, False, id="bearings and teeth come as they like"),
    ],
)
def test_what_a_motor_does_comes_a_whole_number_of_times_a_turn(id_, order, is_drive, speaks):
    found = _found(id_, [])
    found.winner.unknowns = effect_unknowns(CATALOGUE[id_], [0.0] * len(CATALOGUE[id_].parameters), 1.0)
    (its,) = (u for u in found.winner.unknowns if u.name == f"{id_}.order")
    found.winner.fit.whole[its.place] = order
    findings = SimpleNamespace(balances=[SimpleNamespace(measured=SimpleNamespace(is_drive=is_drive))])
    assert bool(rejection.has_no_whole_order(found, findings)) is speaks


@pytest.mark.study
def test_springs_that_are_no_line_are_no_flow_that_opens_beside_others():
    """Their own term taken out, a flow that opens, a slope and a wave of 0.8 of a motor turn did it together."""
    findings = searched(hidden_case(219025, ("spring_nonlinear",)), ("spring_nonlinear",))
    assert findings.selection_steps[0].winner.id == "aerodynamic_torque"
    assert "its strength is negative" in findings.selection_steps[0].rejection
    assert findings.accepted == []
    assert findings.verdict == "unexplained"


@pytest.mark.parametrize(
    ("before", "after", "competitor", "speaks"),
    [
        pytest.param(2.5, 1.03, 1.2, False, id="nearly all that is over the floor"),
        pytest.param(2.5, 1.4, 1.6, True, id="three quarters of it, and another comes near"),
        pytest.param(2.5, 1.4, 2.2, False, id="three quarters of it, and no other comes near"),
        pytest.param(1.3, 1.03, 1.1, True, id="next to nothing beside the floor"),
    ],
)
def test_of_what_is_over_the_noise_floor_a_later_cause_that_is_imitated_takes_nearly_all(
    before, after, competitor, speaks
):
    winner, other = (SimpleNamespace(fit=SimpleNamespace(cost=9000.0 * level)) for level in (after, competitor))
    found = SimpleNamespace(
        ambiguity_group=["parameter:stiction"],
        winner=winner,
        refined=[winner, other],
        before_groups=np.full(9, before),
        after_groups=np.full(9, after),
        gain=1.0 - after / before,
    )
    findings = SimpleNamespace(accepted=[None], samples=np.full(9, 1000))
    assert bool(rejection.is_collinear_with_base(found, findings)) is speaks


@pytest.mark.parametrize(("earlier", "t", "speaks"), [(1, 1.6, False), (2, 1.6, True), (2, 4.1, False)])
def test_a_third_cause_holds_on_segments_that_its_fit_did_not_see(earlier, t, speaks):
    findings = SimpleNamespace(accepted=[None] * earlier)
    assert bool(rejection.is_third(SimpleNamespace(t=t), findings)) is speaks


@pytest.mark.study
def test_drag_of_the_air_that_two_effects_and_numbers_on_their_edges_imitate_is_unexplained():
    findings = searched(hidden_case(96018, ("air_drag",)))
    first, last = (decision.excess(g, findings.samples).sum() for g in (findings.first_groups, findings.final_groups))
    assert len(findings.accepted) > 1
    assert last < (1.0 - decision.EXPLAINED_SHARE) * first  # by what they take they would do
    assert findings.rest[0].over == "base parameters beyond their tolerances"
    assert findings.verdict == "unexplained"


@pytest.mark.study
def test_no_soft_stop_leads_the_calibration_over_a_hill():
    findings = searched(hidden_case(96113, ("current_sensor_curvature",), "medium"))
    assert "end_stop_compliance" not in [found.winner.id for found in findings.accepted]
    assert findings.first_groups[0] < decision.THRESHOLD[0]  # where the search begins now
    assert findings.verdict == "unexplained"


@pytest.mark.study
def test_what_brings_the_stops_to_a_third_of_what_rejects_nobody_is_no_cause():
    assert searched(hidden_case(95165)).verdict == "adequate"


@pytest.mark.slow
def test_a_soft_stop_that_brings_them_to_the_noise_floor_is():
    findings = searched(hidden_case(80107, ("end_stop_compliance",), "medium"))
    assert [found.winner.id for found in findings.accepted] == ["end_stop_compliance"]
    assert findings.first_groups[0] < decision.REJECTING[0]
    assert findings.verdict == "explained"
