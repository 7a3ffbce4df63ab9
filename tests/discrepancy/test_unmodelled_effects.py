"""What together does nearly what something unknown does is no explanation: by rule, and on files where it was one."""

from types import SimpleNamespace

import numpy as np
import pytest
from explain_cases import hidden_case
from explain_study import searched
from synthetic import MODEL, measurement

from etb_hil.discrepancy.candidates.nonparametric import NonparametricTerm, nonparametric_terms
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.search import decision, rejection
from etb_hil.discrepancy.search.friction_drift import wears
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.layout import EXTENDED, row

ROWS = np.array([400, 1800, 5500, 400, 3900, 5500, 400, 3900, 5500])


def _round(id_, before, after, competitor=10.0, ambiguity_group=()):
    effect = CATALOGUE.get(id_)
    costs = [1.0, competitor]
    refined = [
        SimpleNamespace(id=id_, candidate=SimpleNamespace(effect=effect), fit=SimpleNamespace(cost=c)) for c in costs
    ]
    return SimpleNamespace(
        winner=refined[0],
        refined=refined,
        before_groups=np.array(before),
        after_groups=np.array(after),
        ambiguity_group=list(ambiguity_group),
        rejection="",
    )


def _groups(torque=1.0, voltage=1.0):
    return [1.0, torque, torque, 1.0, voltage, voltage, 1.0, 1.0, 1.0]


def _findings(accepted, first, final):
    return SimpleNamespace(
        accepted=accepted, selection_steps=accepted, samples=ROWS, rest=[], is_interrupted=False,
        first_groups=np.array(first), final_groups=np.array(final),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("is_later", "after", "competitor", "speaks"),
    [
        pytest.param(True, 5.0, 1.05, True, id="a part, as others would"),
        pytest.param(True, 5.0, 1.6, False, id="a part, as nobody else"),
        pytest.param(True, 1.5, 1.05, False, id="most of it"),
        pytest.param(False, 5.0, 1.05, False, id="the first cause"),
    ],
)
def test_a_later_cause_is_not_one_of_several_that_take_a_part(is_later, after, competitor, speaks):
    found = _round("friction_temperature", _groups(7.0), _groups(after), competitor)
    findings = SimpleNamespace(accepted=[found] if is_later else [], samples=ROWS)
    assert bool(rejection.is_one_of_several(found, findings)) is speaks


@pytest.mark.parametrize(
    ("touched", "after", "speaks"),
    [
        pytest.param(26.0, 0.9, False, id="where no cause was before it"),
        pytest.param(12.0, 0.9, True, id="where an earlier one took most"),
        pytest.param(60.0, 0.9, True, id="where an earlier one bent it"),
        pytest.param(26.0, 6.0, True, id="and it leaves more than the floor"),
    ],
)
def test_a_later_cause_takes_little_only_where_an_earlier_one_may_have_left_it(touched, after, speaks):
    def on_a_stop(torque, elsewhere=1.0):
        return np.array([torque, elsewhere, elsewhere, *[1.0] * 6])

    earlier = _round("spring_nonlinear", on_a_stop(27.0, 90.0), on_a_stop(touched))
    later = _round("end_stop_compliance", on_a_stop(11.0), on_a_stop(after))
    later.gain, later.healthy_gain, later.t = 0.15, 0.01, 1.1
    later.winner.candidate.frees = ""
    findings = SimpleNamespace(accepted=[earlier], samples=ROWS)
    assert bool(rejection._explains_too_little(later, findings)) is speaks


@pytest.mark.parametrize(("doubt", "expected"), [("", "explained"), ("another takes nearly as much", "unexplained")])
def test_what_was_taken_in_with_a_doubt_is_named_without_confidence(doubt, expected):
    before, after = _groups(12.0), _groups(1.2)
    causes = [_round("friction_asymmetry", before, _groups(6.0)), _round("cogging_torque", _groups(6.0), after)]
    causes[1].rejection = doubt
    assert decision.verdict(_findings(causes, before, after)) == expected


@pytest.mark.parametrize(
    ("voltage", "speaks"),
    [
        pytest.param(1.005, True, id="up"),
        pytest.param(0.995, False, id="down"),
        pytest.param(1.0, False, id="unmeasured"),
    ],
)
def test_magnets_that_weaken_bring_the_voltage_down(voltage, speaks):
    found = _round("magnet_temperature", _groups(11.0), _groups(2.0, voltage))
    assert bool(rejection._lacks_its_back_emf(found, SimpleNamespace(samples=ROWS))) is speaks


@pytest.mark.parametrize(
    ("torque", "expected"),
    [
        pytest.param((2.35, 2.19), "unexplained", id="hardly touched"),
        pytest.param((9.0, 2.19), "explained", id="what a shape leaves"),
        pytest.param((2.35, 1.5), "explained", id="inside its band"),
    ],
)
def test_a_group_that_the_causes_hardly_touch_is_not_left_by_their_shapes(torque, expected):
    before, after = ([1.0, 1.0, one, 1.0, u, u, 1.0, 1.0, 1.0] for one, u in zip(torque, (50.0, 1.1), strict=True))
    assert decision.verdict(_findings([_round("supply_sag", before, after)], before, after)) == expected


@pytest.mark.parametrize(
    ("over", "parity", "expected"), [("angle", "even", "explained"), ("velocity", "odd", "unexplained")]
)
def test_what_is_left_over_the_angle_is_still_the_springs(over, parity, expected):
    before, after = _groups(60.0), _groups(3.5)
    findings = _findings([_round("spring_nonlinear", before, after)], before, after)
    findings.rest = [NonparametricTerm("torque", over, parity, 0.9)]
    assert decision.verdict(findings) == expected


@pytest.mark.parametrize(
    ("id_", "ambiguity_group", "curve", "expected"),
    [
        ("parameter:viscous", [], 0.04, "unexplained"),
        ("parameter:viscous", [], 0.01, "explained"),
        ("parameter:viscous", ["stribeck_shape"], 0.04, "ambiguous"),  # whose curve it may be
        ("iron_loss", [], 0.04, "explained"),
    ],
)
def test_wrong_numbers_alone_leave_no_curve(id_, ambiguity_group, curve, expected):
    before, after = _groups(12.0), _groups(1.2)
    findings = _findings([_round(id_, before, after, ambiguity_group=ambiguity_group)], before, after)
    findings.curve = curve
    assert decision.verdict(findings) == expected


def test_a_curve_is_looked_for_in_the_samples_that_count():
    balances = Balances(measurement(MODEL.vector(), seed=3), MODEL)
    found = calibrate(MODEL, [balances])
    velocity = balances.spectrum.picked(balances.motion(found.fit.whole[:EXTENDED])[1])
    curve = np.zeros(3 * balances.samples)
    curve[: balances.samples] = np.abs(velocity) > np.median(np.abs(velocity))
    left = found.fit.residual + 3.0 * curve

    def most(counts):
        taken = nonparametric_terms([balances], found.fit.whole[:EXTENDED], found.jacobian, left, counts)
        return max(spline.share for spline in taken)

    assert most(curve == 0.0) < 0.1 < most(None)


@pytest.mark.parametrize(
    ("course", "per_30_kelvin", "is_wear"),
    [
        pytest.param(np.linspace(34.0, -2.0, 200), 0.05, True, id="falls as it cools"),
        pytest.param(np.linspace(34.0, -2.0, 200), -0.05, False, id="rises as it cools"),
        pytest.param(np.linspace(15.0, 50.0, 200), -0.05, False, id="falls as it warms"),
        pytest.param(np.linspace(15.0, 50.0, 200), 0.05, False, id="rises as it warms"),
        pytest.param(30.0 - 15.0 * np.bartlett(200), 0.05, False, id="the temperature comes back"),
    ],
)
def test_friction_that_falls_as_it_cools_may_be_wear(course, per_30_kelvin, is_wear):
    one = SimpleNamespace(measured=SimpleNamespace(temperature=course), spectrum=SimpleNamespace(picked=lambda x: x))
    stated, whole = np.zeros(EXTENDED), np.zeros(EXTENDED)
    whole[row("friction_temperature")] = per_30_kelvin
    assert wears(whole, stated, [one]) is is_wear

    stated[row("friction_temperature")] = -0.2  # what the model file says of heat is no wear
    whole[row("friction_temperature")] += -0.2
    assert wears(whole, stated, [one]) is is_wear


@pytest.mark.study
@pytest.mark.parametrize(
    ("seed", "hidden", "level", "without"),
    [
        pytest.param(147012, "stribeck_shape", "strong", ("stribeck_shape",), id="three strangers"),
        pytest.param(131110, "air_drag", "medium", (), id="a number beside a curve"),
        pytest.param(132050, "current_sensor_curvature", "medium", (), id="one who touched only half"),
        pytest.param(131086, "spring_thermal_drift", "medium", (), id="a spring and no magnets"),
        pytest.param(132014, "running_in", "medium", (), id="wear and no grease"),
    ],
)
def test_what_is_no_candidate_is_unexplained(seed, hidden, level, without):
    assert searched(hidden_case(seed, (hidden,), level), without).verdict == "unexplained"


@pytest.mark.study
def test_a_part_of_a_wave_is_also_friction_at_one_place_where_that_leaves_little_more():
    findings = searched(hidden_case(196004, ("friction_load",)), ("friction_load",))
    first, wave = findings.accepted
    assert wave.winner.id == "friction_position_periodic"
    assert wave.ambiguity_group == ["friction_position_local"]
    assert first.ambiguity_group
    assert findings.verdict == "ambiguous"


@pytest.mark.study
def test_a_part_of_a_wave_that_nothing_else_comes_near_is_one():
    findings = searched(hidden_case(218092, ("friction_position_periodic",)))
    (wave,) = findings.accepted
    order = next(u for u in wave.winner.unknowns if u.name == "friction_position_periodic.order")
    seen = max(np.ptp(b.measured.angle) * b.gear for b in findings.balances) / (2.0 * np.pi)
    assert wave.winner.fit.whole[order.place] * seen < 0.95
    assert wave.ambiguity_group == []
    assert findings.verdict == "explained"
