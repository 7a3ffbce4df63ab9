"""From measurements and grounds to a verdict: what outranks what, and each edge on both of its sides."""

import itertools
import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.base.outcome import UnitVerdict
from etb_hil.base.roles import ROLES
from etb_hil.diagnosis.exceedance import Exceedance
from etb_hil.diagnosis.grounds import Coverage, Excess, Grounds
from etb_hil.diagnosis.local_margin import Shortfall
from etb_hil.diagnosis.measurement_kind import Estimate, FailedEstimate
from etb_hil.diagnosis.measurement_registry import measurement_kinds
from etb_hil.diagnosis.measuring import Measured, stand
from etb_hil.diagnosis.places_seen import Unseen
from etb_hil.diagnosis.result import Reason
from etb_hil.diagnosis.verdict import conclude
from etb_hil.results.measurement import Measurement

PASS, FAIL, INCONCLUSIVE = UnitVerdict.PASS, UnitVerdict.FAIL, UnitVerdict.INCONCLUSIVE
KINDS = measurement_kinds()
GROUNDS = Grounds(
    coverage=Coverage(samples=10_000, lost=0, longest_gap=0.001, gap_in="ramp"),
    moved=1.4, windows=(300, 300), follows=1.0, seen=(0.2, 1.3), unseen=None,
    current_verified=True, highest_current=3.0, withholding=(), remarks=(), by_direction=0.0, pushed=None,
    excess=None, shortfall=None, unexplained=(), current_plausible=True, band=0.03, complete=True,
    limited={name: KINDS[name] for name in ("T_st", "T_c")}, phases=frozenset({"ramp"}),
    roles=frozenset(ROLES), has_curve=False,
)  # fmt: skip
EXCESS = Excess(torque=0.3, low=0.28, high=0.32, limit=0.26, angle=0.8, is_one_way=False, is_certain=True)
SHORT = Shortfall(margin=0.04, low=0.037, high=0.043, limit=0.05, angle=0.8, is_certain=True)


def measured(kind_id, verdict, *, value=0.2, half=0.01, high=0.26, **estimate):
    kind = KINDS[kind_id]
    found = Measurement(kind.id, kind.name, value, kind.unit, value - half, value + half, None, high, verdict)
    return Measured(kind, Estimate(value, value - half, value + half, **estimate), found)


def both(stiction=PASS, coulomb=PASS):
    return [measured("T_st", stiction), measured("T_c", coulomb)]


def episode(kind, milliseconds, peak, allowance=0.02, limit=0.26):
    return Exceedance(kind, 0, round(milliseconds * 1e6), peak, allowance, limit, 0.7, 0.1, 25.0, "ramp")


def said(found, **changed):
    """Return the verdict and the ids of the reasons, the deciding one first."""
    verdict, reasons = conclude(found, replace(GROUNDS, **changed))
    return verdict, [reason.id for reason in reasons]


@pytest.mark.parametrize(("stiction", "coulomb"), list(itertools.product((PASS, FAIL, INCONCLUSIVE), repeat=2)))
def test_fail_outranks_inconclusive_and_that_outranks_pass(stiction, coulomb):
    verdict, ids = said(both(stiction, coulomb))
    stands = (stiction, coulomb)
    assert verdict is (FAIL if FAIL in stands else INCONCLUSIVE if INCONCLUSIVE in stands else PASS)
    names = [n for n, v in zip(("T_st", "T_c"), stands, strict=True) if v is FAIL]
    doubts = [n for n, v in zip(("T_st", "T_c"), stands, strict=True) if v is INCONCLUSIVE]
    expected = [f"{n}_beyond_limit" for n in names] + [f"{n}_undecided" for n in doubts]
    assert ids == (expected or ["within_limits"])


def test_a_pass_says_every_value_and_where_the_plate_was_seen():
    _, reasons = conclude(both(), GROUNDS)
    assert f"{KINDS['T_st'].name} is 0.200 N·m" in reasons[0].text
    assert "seen from 11.5 deg to 74.5 deg" in reasons[0].text
    _, reasons = conclude(both(), replace(GROUNDS, seen=(math.nan, math.nan)))
    assert "seen from" not in reasons[0].text


def test_without_anything_judged_there_is_no_pass():
    free = [replace(one, measurement=replace(one.measurement, verdict=None)) for one in both()]
    assert said(free, limited={}) == (INCONCLUSIVE, [])
    assert said([], limited={}) == (INCONCLUSIVE, [])


def test_what_withholds_a_verdict_outranks_a_fail_of_the_model():
    wrong = Reason("model_contradicted", "the springs are others")
    for stiction in (PASS, FAIL, INCONCLUSIVE):
        assert said(both(stiction), withholding=[wrong]) == (INCONCLUSIVE, ["model_contradicted"])


def test_what_is_measured_without_the_model_fails_a_unit_all_the_same():
    wrong = Reason("model_contradicted", "the springs are others")
    free = next(kind.id for kind in KINDS.values() if kind.is_model_free)
    found = [*both(FAIL), measured(free, FAIL)]
    assert said(found, withholding=[wrong]) == (FAIL, [f"{free}_beyond_limit", "model_contradicted"])
    assert said([*both(FAIL), measured(free, PASS)], withholding=[wrong])[0] is INCONCLUSIVE
    lost = Coverage(samples=900, lost=100, longest_gap=0.001, gap_in="ramp")
    assert said(found, withholding=[wrong], coverage=lost)[0] is INCONCLUSIVE


def test_where_nothing_contradicts_the_model_every_limit_that_is_broken_is_said():
    free = next(kind.id for kind in KINDS.values() if kind.is_model_free)
    found = [*both(FAIL, INCONCLUSIVE), measured(free, FAIL)]
    assert said(found) == (FAIL, ["T_st_beyond_limit", f"{free}_beyond_limit", "T_c_undecided"])


@pytest.mark.parametrize(("lost", "withheld"), [(0, False), (500, False), (501, True), (9_000, True)])
def test_more_than_five_percent_lost_withholds_a_verdict(lost, withheld):
    coverage = Coverage(samples=10_000 - lost, lost=lost, longest_gap=0.001, gap_in="ramp")
    verdict, ids = said(both(FAIL), coverage=coverage)
    assert verdict is (INCONCLUSIVE if withheld else FAIL)
    assert ("samples_lost" in ids) == withheld
    assert "T_st_beyond_limit" in ids
    if withheld:
        _, reasons = conclude(both(), replace(GROUNDS, coverage=coverage))
        assert reasons[0].text == f"{lost / 10_000:.1%} of the samples are lost, more than 5%"


@pytest.mark.parametrize(("gap", "seen"), [(0.1, False), (0.11, True)])
def test_a_gap_longer_than_a_dash_is_a_doubt(gap, seen):
    coverage = Coverage(samples=10_000, lost=0, longest_gap=gap, gap_in="ramp")
    verdict, ids = said(both(), coverage=coverage)
    assert (verdict, ids) == ((INCONCLUSIVE, ["samples_missing"]) if seen else (PASS, ["within_limits"]))
    assert said(both(FAIL), coverage=coverage)[0] is FAIL


def test_a_run_that_ended_early_passes_nobody():
    assert said(both(), complete=False) == (INCONCLUSIVE, ["run_not_finished"])
    assert said(both(FAIL), complete=False)[0] is FAIL


def test_a_way_that_was_not_seen_passes_nobody():
    unseen = Unseen(start=0.4, end=0.7, share=0.2)
    assert said(both(), unseen=unseen) == (INCONCLUSIVE, ["places_not_seen"])
    assert said(both(FAIL), unseen=unseen)[0] is FAIL


def test_a_stop_of_the_model_that_the_plate_passed_is_named_beside_the_way_that_was_not_seen():
    unseen = Unseen(start=1.3, end=1.6, share=0.2, stop=1.4)
    _, (reason, *_) = conclude(both(), replace(GROUNDS, unseen=unseen))
    assert "it passed the model's stop at 80.2 deg" in reason.text
    _, (reason, *_) = conclude(both(), replace(GROUNDS, unseen=replace(unseen, stop=None)))
    assert "the model's stop" not in reason.text


def test_remarks_change_no_verdict_and_come_last():
    remark = Reason("hot", "the motor is warm")
    for stiction in (PASS, FAIL, INCONCLUSIVE):
        verdict, ids = said(both(stiction), remarks=[remark])
        assert verdict is stiction
        assert ids[-1] == "hot"
        assert len(ids) == 2


def test_friction_at_one_place_fails_a_unit_whose_curve_passes():
    assert said(both(), excess=EXCESS) == (FAIL, ["T_st_exceeded"])
    assert said(both(INCONCLUSIVE), excess=EXCESS)[0] is FAIL
    assert said(both(FAIL), excess=EXCESS) == (FAIL, ["T_st_beyond_limit"])  # one fault, one reason
    _, reasons = conclude(both(), replace(GROUNDS, excess=EXCESS))
    assert f"(at least {EXCESS.low:.3f}; allowed up to {EXCESS.limit:.3f})" in reasons[0].text


@pytest.mark.parametrize("one_way", [False, True])
def test_friction_at_one_place_that_is_not_certain_is_a_doubt(one_way):
    excess = replace(EXCESS, is_certain=False, is_one_way=one_way)
    assert said(both(), excess=excess) == (INCONCLUSIVE, ["T_st_local_undecided"])
    assert said(both(INCONCLUSIVE), excess=excess) == (INCONCLUSIVE, ["T_st_undecided"])
    assert said(both(FAIL), excess=excess) == (FAIL, ["T_st_beyond_limit"])
    _, reasons = conclude(both(), replace(GROUNDS, excess=excess))
    assert ("one direction" if one_way else "both directions") in reasons[0].text
    assert f"({EXCESS.low:.3f} to {EXCESS.high:.3f}; allowed" in reasons[0].text


def with_margin(verdict):
    return [*both(), measured("return_margin", verdict)]


def test_a_spring_that_is_short_at_one_place_fails_a_unit_whose_margin_passes():
    assert said(with_margin(PASS), shortfall=SHORT) == (FAIL, ["return_margin_local"])
    assert said(with_margin(INCONCLUSIVE), shortfall=SHORT)[0] is FAIL
    assert said(with_margin(FAIL), shortfall=SHORT) == (FAIL, ["return_margin_beyond_limit"])  # one fault, one reason
    _, reasons = conclude(with_margin(PASS), replace(GROUNDS, shortfall=SHORT))
    assert "at 45.8 deg friction is locally higher" in reasons[0].text
    assert f"(at most {SHORT.high:.3f}; at least" in reasons[0].text


def test_a_spring_that_may_be_short_at_one_place_is_a_doubt():
    open_ = replace(SHORT, high=0.06, is_certain=False)
    assert said(with_margin(PASS), shortfall=open_) == (INCONCLUSIVE, ["return_margin_local_undecided"])
    assert said(with_margin(INCONCLUSIVE), shortfall=open_) == (INCONCLUSIVE, ["return_margin_undecided"])
    assert said(with_margin(FAIL), shortfall=open_) == (FAIL, ["return_margin_beyond_limit"])
    _, reasons = conclude(with_margin(PASS), replace(GROUNDS, shortfall=open_))
    assert f"({open_.low:.3f} to {open_.high:.3f}; at least" in reasons[0].text


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_friction_that_may_be_above_the_limit_in_one_direction_is_a_doubt(sign):
    """0.21 at most, 0.2522 allowed outside the band: 0.0422 more is what is open."""
    assert said(both(), by_direction=sign * 0.042) == (PASS, ["within_limits"])
    assert said(both(), by_direction=sign * 0.0423) == (INCONCLUSIVE, ["direction_undecided"])
    assert said(both(FAIL), by_direction=sign * 0.0423)[0] is FAIL
    _, reasons = conclude(both(INCONCLUSIVE), replace(GROUNDS, by_direction=sign * 0.0423))
    assert [r.id for r in reasons] == ["T_st_undecided", "direction_undecided"]
    assert "then T_c may be above the limit" in reasons[1].text  # T_st is undecided anyway
    assert ("higher opening" if sign > 0 else "higher closing") in reasons[1].text


def test_a_pass_next_to_the_limit_stays_one_where_both_directions_are_alike():
    near = [measured("T_st", PASS, value=0.245, half=0.005), measured("T_c", PASS)]
    assert said(near, by_direction=0.0, band=0.1)[0] is PASS


def test_a_direction_says_nothing_of_what_is_no_friction():
    found = [*both(), measured("return_time_open", PASS, value=0.2, half=0.01, high=0.21)]
    assert said(found, by_direction=0.02)[0] is PASS


NO_CURVE = {"windows": (1, 2), "follows": 1.0}
HELD = {"moved": 0.001, "unexplained": [episode("T_st", 30, 0.4)]}


def test_a_plate_that_is_held_fails_where_the_current_is_certain():
    assert said([], **HELD)[0] is FAIL
    assert said([], **HELD)[1][0] == "plate_stuck"
    for spoilt in ({"current_verified": False}, {"current_plausible": False}, {"current_plausible": None}):
        assert said([], **{**HELD, **spoilt})[0] is INCONCLUSIVE
    assert said([], **{**HELD, "limited": {}})[0] is INCONCLUSIVE


@pytest.mark.parametrize(("moved", "stuck"), [(0.2, True), (0.21, False)])
def test_a_plate_that_moved_by_more_than_0_2_rad_is_not_stuck(moved, stuck):
    assert (said([], **{**HELD, "moved": moved})[0] is FAIL) == stuck


@pytest.mark.parametrize(
    ("episodes", "stuck"),
    [
        ([("T_st", 20, 0.4)], True),
        ([("T_st", 19, 0.4)], False),
        ([("T_st", 10, 0.4), ("T_st", 10, 0.3)], True),  # together
        ([("T_c", 30, 0.4)], False),
        ([("T_st", 30, 0.287)], False),  # less 0.02, next to the limit: 0.2678
        ([("T_st", 30, 0.289)], True),
        ([], False),
    ],
)
def test_a_plate_is_stuck_where_it_held_for_long_against_more_than_the_limit(episodes, stuck):
    found = [episode(*one) for one in episodes]
    assert (said([], moved=0.001, unexplained=found)[0] is FAIL) == stuck


def test_live_friction_that_nothing_explains_is_a_doubt_from_20_ms_on():
    assert said(both(), unexplained=[episode("T_st", 19.9, 0.4)]) == (PASS, ["within_limits"])
    assert said(both(), unexplained=[episode("T_st", 20, 0.4)]) == (INCONCLUSIVE, ["T_st_unexplained"])
    assert said(both(), unexplained=[episode("T_c", 12, 0.4), episode("T_c", 8, 0.5)])[1] == ["T_c_unexplained"]
    assert said(both(), unexplained=[episode("T_c", 12, 0.4), episode("T_st", 12, 0.5)])[0] is PASS
    assert said(both(FAIL), unexplained=[episode("T_st", 30, 0.4)]) == (FAIL, ["T_st_beyond_limit"])


def test_a_limit_without_a_curve_names_why():
    assert said([], coverage=Coverage(0, 0, 0.0, "ramp"))[1] == ["no_samples"]
    assert said([], follows=0.89)[1] == ["too_few_windows"]
    assert said([], follows=0.9)[1] == ["too_little_motion"]
    assert said([], follows=0.5, moved=0.2)[1] == ["too_little_motion"]
    assert said([measured("T_st", PASS)], follows=0.9) == (INCONCLUSIVE, ["too_little_motion"])
    _, reasons = conclude([measured("T_st", PASS)], GROUNDS)
    assert "fitted for T_c:" in reasons[0].text
    assert "600 segments" in reasons[0].text
    assert "zero was never measured" not in reasons[0].text
    for follows in (0.5, 1.0):
        _, reasons = conclude([], replace(GROUNDS, current_verified=False, follows=follows))
        assert "zero was never measured" in reasons[0].text


def test_a_limit_whose_phase_the_run_has_must_be_measured():
    of_phase = next(kind for kind in KINDS.values() if kind.phases and "ramp" not in kind.phases)
    limited = {**GROUNDS.limited, of_phase.id: of_phase}
    verdict, ids = said(both(), limited=limited, phases=frozenset({"ramp", *of_phase.phases}))
    assert (verdict, ids) == (INCONCLUSIVE, [f"{of_phase.id}_not_measured"])
    verdict, ids = said(both(), limited=limited)
    assert (verdict, ids) == (PASS, ["within_limits", "limits_not_judged"])


STEP = KINDS["step_delay"]
STEPS = {"limited": {**GROUNDS.limited, STEP.id: STEP}, "phases": frozenset({"ramp", *STEP.phases})}


def test_a_limit_whose_signal_the_run_lacks_says_which():
    verdict, reasons = conclude(both(), replace(GROUNDS, **STEPS, roles=STEP.roles - {"command_mode"}))
    assert (verdict, [reason.id for reason in reasons]) == (INCONCLUSIVE, ["step_delay_without_signal"])
    meaning = ROLES["command_mode"].meaning
    assert reasons[0].text == f"{STEP.name} was not measured: the run has no samples of command_mode ({meaning})"


def test_a_limit_that_was_not_measured_with_all_its_signals_says_why():
    verdict, reasons = conclude(both(), replace(GROUNDS, **STEPS, roles=STEP.roles))
    assert (verdict, [reason.id for reason in reasons]) == (INCONCLUSIVE, ["step_delay_not_measured"])
    assert reasons[0].text.endswith("although the run has a phase for it (step)")
    _, reasons = conclude([measured("T_st", PASS)], replace(GROUNDS, has_curve=True))
    assert [reason.id for reason in reasons] == ["T_c_not_measured"]  # there is a curve, so it is not for want of one
    assert reasons[0].text.endswith("the motion of this run does not show it")
    lost = Measurement("omega_s", "Stribeck velocity", None, "rad/s", limit_high=9.0, note="there is no law")
    _, reasons = conclude([*both(), Measured(KINDS["omega_s"], Estimate(None), lost)], replace(GROUNDS, has_curve=True))
    assert reasons[0] == Reason("omega_s_not_measured", "Stribeck velocity was not measured: there is no law")
    failed = Measured(KINDS["omega_s"], FailedEstimate(None, note="the plug-in failed: IndexError"), lost)
    _, reasons = conclude([*both(), failed], replace(GROUNDS, has_curve=True))
    assert reasons[0].text == "Stribeck velocity was not measured: its plug-in failed"


def test_one_of_several_values_that_was_not_measured_is_a_doubt_whatever_the_others_say():
    passed = measured(STEP.id, PASS, suffix="_large_opening")
    passed = replace(passed, measurement=replace(passed.measurement, id="step_delay_large_opening"))
    lost = Measurement("step_delay_small_opening", "step delay", None, "s", limit_high=0.03)
    found = [*both(), passed, Measured(STEP, Estimate(None, suffix="_small_opening"), lost)]
    verdict, reasons = conclude(found, replace(GROUNDS, **STEPS, roles=STEP.roles))
    assert (verdict, [reason.id for reason in reasons]) == (INCONCLUSIVE, ["step_delay_small_opening_not_measured"])
    assert "small opening" in reasons[0].text
    assert said(found[:3], **STEPS) == (PASS, ["within_limits"])
    free = replace(found[3], measurement=replace(lost, limit_high=None))
    assert said([*found[:3], free], **STEPS) == (PASS, ["within_limits"])
    assert said(found, limited=STEPS["limited"])[0] is PASS  # a run without the phase


def test_a_value_without_an_interval_is_held_against_no_limit():
    (one, other) = both(INCONCLUSIVE, INCONCLUSIVE)
    one = replace(one, measurement=replace(one.measurement, low=None, high=None))
    verdict, reasons = conclude([one, other], GROUNDS)
    assert (verdict, [reason.id for reason in reasons]) == (INCONCLUSIVE, ["T_st_without_interval", "T_c_undecided"])
    assert "without an interval it is held against no limit" in reasons[0].text


def test_an_estimate_that_may_not_pass_says_so_itself():
    own = Reason("T_c_too_slow", "the plate was too slow for T_c")
    found = [measured("T_st", PASS), measured("T_c", INCONCLUSIVE, undecided=own)]
    assert said(found) == (INCONCLUSIVE, ["T_c_too_slow"])


def test_an_estimate_that_may_not_pass_never_passes():
    found = [measured("T_st", INCONCLUSIVE, may_pass=False), measured("T_c", PASS)]
    assert said(found) == (INCONCLUSIVE, ["T_st_undecided"])
    unseen = Unseen(start=0.4, end=0.7, share=0.2)
    assert said(found, unseen=unseen) == (INCONCLUSIVE, ["places_not_seen"])  # one cause, one reason
    own = Reason("T_st_late", "the plate was too late for T_st")
    late = [measured("T_st", INCONCLUSIVE, may_pass=False, undecided=own), measured("T_c", PASS)]
    assert said(late, unseen=unseen) == (INCONCLUSIVE, ["places_not_seen", "T_st_late"])
    assert said(both(INCONCLUSIVE), unseen=unseen) == (INCONCLUSIVE, ["places_not_seen", "T_st_undecided"])


@pytest.mark.parametrize("verdict", [PASS, INCONCLUSIVE])
def test_a_bound_is_judged_and_said_as_one(verdict):
    bounded = measured("T_c", verdict)
    bounded = replace(bounded, measurement=replace(bounded.measurement, value=None, low=0.0))
    found, reasons = conclude([measured("T_st", PASS), bounded], GROUNDS)
    assert (found, len(reasons)) == (verdict, 1)
    assert f"{KINDS['T_c'].name} is at most 0.210 N·m, allowed at most 0.260" in reasons[0].text


def test_a_limit_of_a_phase_that_was_measured_is_not_missing():
    of_phase = next(kind for kind in KINDS.values() if kind.phases and "ramp" not in kind.phases)
    found = [*both(), measured(of_phase.id, PASS, value=0.1)]
    run = {"limited": {**GROUNDS.limited, of_phase.id: of_phase}, "phases": frozenset({"ramp", *of_phase.phases})}
    assert said(found, **run) == (PASS, ["within_limits"])


def test_a_lower_limit_alone_is_no_limit_of_friction_by_direction():
    low = measured("T_st", PASS, high=None)
    assert said([low, measured("T_c", PASS)], by_direction=0.01)[0] is PASS
    unknown = replace(low, measurement=replace(low.measurement, limit_high=0.26, high=None))
    assert said([unknown, measured("T_c", PASS)], by_direction=0.01)[0] is PASS


@pytest.mark.parametrize(
    ("low", "high", "limit_low", "limit_high", "verdict"),
    [
        (0.2, 0.234, None, 0.25, PASS),
        (0.2, 0.234375, None, 0.25, INCONCLUSIVE),  # on the edge of the band, a sixteenth of the limit
        (0.2, 0.26, None, 0.25, INCONCLUSIVE),
        (0.265625, 0.3, None, 0.25, INCONCLUSIVE),
        (0.266, 0.3, None, 0.25, FAIL),
        (0.266, 0.3, 0.25, None, PASS),
        (0.265625, 0.3, 0.25, None, INCONCLUSIVE),
        (0.2, 0.234375, 0.25, None, INCONCLUSIVE),
        (0.2, 0.234, 0.25, None, FAIL),
        (-0.3, -0.266, None, -0.25, PASS),  # the band is a share of the limit's size
        (-0.3, -0.265, None, -0.25, INCONCLUSIVE),
        (-0.234, -0.2, None, -0.25, FAIL),
        (-0.3, -0.266, -0.25, None, FAIL),
        (-0.234, -0.2, -0.25, None, PASS),
        (0.2, 0.22, 0.1, 0.3, PASS),
        (0.2, 0.22, 0.1, 0.21, INCONCLUSIVE),
        (0.2, 0.22, 0.21, 0.3, INCONCLUSIVE),
        (0.2, 0.22, 0.3, 0.21, FAIL),
        (0.0, 0.01, 0.0, 0.3, INCONCLUSIVE),
        (-0.1, 0.0, None, 0.0, INCONCLUSIVE),
    ],
)
def test_an_interval_against_its_limits(low, high, limit_low, limit_high, verdict):
    assert stand(0.5 * (low + high), low, high, limit_low, limit_high, 0.0625) is verdict
    for outside in (low - 0.1, high + 0.1):  # an interval that does not hold its own value says nothing
        assert stand(outside, low, high, limit_low, limit_high, 0.0625) is INCONCLUSIVE
    for edge in (low, high):
        assert stand(edge, low, high, limit_low, limit_high, 0.0625) is verdict


@given(st.floats(-1, 1), st.floats(0, 0.5), st.floats(0.05, 1), st.floats(0, 0.3), st.floats(0, 0.2))
def test_a_wider_interval_or_band_never_turns_one_verdict_into_the_other(middle, half, limit, wider, band):
    near, far = ((middle - h, middle + h) for h in (half, half + wider))
    before, after = stand(middle, *near, None, limit, 0.0), stand(middle, *far, None, limit, band)
    assert after in (before, INCONCLUSIVE)
