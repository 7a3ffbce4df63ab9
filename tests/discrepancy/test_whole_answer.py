"""The whole answer of one explanation: the picture that shows the cause, what it changes, the files that hold it."""

import json
import re
from dataclasses import replace
from html import escape

import browser
import jsonschema
import numpy as np
import pytest
from answers import plain, write_explanation
from synthetic import MODEL

from etb_hil.base.modes import Mode
from etb_hil.base.quantity import unit_of
from etb_hil.base.stock import find
from etb_hil.diagnosis.limits_file import load_limits
from etb_hil.discrepancy.answer.consequence import consequence
from etb_hil.discrepancy.answer.detection_limits import detection_limits
from etb_hil.discrepancy.answer.explanation import _size, causes, explanation
from etb_hil.discrepancy.answer.pictures import pictures
from etb_hil.discrepancy.answer.residual_curves import _coordinates
from etb_hil.discrepancy.explain import Answer, explain, write
from etb_hil.discrepancy.fitting.balances import CHANNELS
from etb_hil.discrepancy.fitting.free_run import SEGMENT_S
from etb_hil.discrepancy.fitting.intervals import Estimate
from etb_hil.discrepancy.plan.next_test import next_test
from etb_hil.discrepancy.plan.planned import PERIOD, Plan
from etb_hil.discrepancy.search.extended_model import calibrated_parameters, extended_model
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.model_text import model_text
from etb_hil.plant.parameters import load_model
from etb_hil.plant.physics import STOP_LOW
from etb_hil.plant.table_one import KINDS
from etb_hil.results.explanation_file import explanation_as_dict, explanation_from_dict, explanation_schema
from etb_hil.scenario.planning import plan_of
from etb_hil.scenario.scenario_file import load_scenario


@pytest.fixture(scope="module")
def answer(cogging_recording):
    return explain([cogging_recording], MODEL, limits=load_limits(find("limits", "default")))


def test_what_is_written_is_read_again_and_fits_its_schema(answer):
    written = json.loads(json.dumps(explanation_as_dict(answer.explanation)))
    assert written["causes"][0]["id"] == "cogging_torque"
    assert explanation_from_dict(written) == answer.explanation
    jsonschema.validate(written, explanation_schema())


def test_candidates_that_were_refused_say_why(answer):
    best = {one["selection_step"]: one for one in reversed(plain(answer)["candidates"])}
    for one in best.values():
        assert one["accepted"] == (not one["rejection"])


def test_a_judgement_that_fails_is_said_and_takes_nothing_with_it(answer, monkeypatch, tmp_path):
    def fails(*_):
        raise ZeroDivisionError("of odd data")

    monkeypatch.setattr("etb_hil.discrepancy.answer.consequence.Diagnosis", fails)
    limits = load_limits(find("limits", "default"))
    found = plain(consequence(answer.findings, limits, answer.findings.final.fit.whole))
    assert found["text"] == "the unit could not be judged: ZeroDivisionError: of odd data"
    assert found["reference"] is None
    page = write_explanation(plain(answer) | {"diagnosis": found}, None, tmp_path).read_text("utf-8")
    assert "The unit could not be judged" in page


def test_between_what_noise_leaves_is_said(answer, tmp_path):
    errors = plain(answer)["errors"]
    least, most = errors["noise_floor_range"]
    assert 0.0 < least < errors["holdout"]["free_run"]["throttle_angle"]["noise_floor"] < most
    page = write_explanation(plain(answer), None, tmp_path).read_text("utf-8")
    assert f"noise alone causes an error of {np.degrees(least):.3g} to {np.degrees(most):.3g} deg" in page


def test_where_most_of_an_error_stands_is_said_beside_what_noise_left_there(answer, tmp_path):
    worst = plain(answer)["errors"]["free_run_worst"]
    held_out = answer.holdout
    errors = held_out.segments[held_out.in_file]["throttle_angle"]
    k = int(np.argmax(errors))
    assert worst["error"] == errors[k] > worst["others"]
    assert worst["to_s"] - worst["from_s"] == SEGMENT_S
    assert worst["noise_floor_range"] == [held_out.drawn[:, k].min(), held_out.drawn[:, k].max()]
    for share, is_said in ((0.9, True), (0.1, False)):
        errors = plain(answer)["errors"] | {"free_run_worst": worst | {"share": share}}
        page = write_explanation(plain(answer) | {"errors": errors}, None, tmp_path).read_text("utf-8")
        assert (f"against {np.degrees(worst['others']):.3g} deg elsewhere" in page) == is_said


def test_errors_say_their_unit(answer):
    holdout = plain(answer)["errors"]["holdout"]
    for kind in ("one_step", "free_run"):
        assert {name: one["unit"] for name, one in holdout[kind].items()} == {
            "throttle_angle": "rad",
            "motor_current": "A",
        }


def test_errors_of_less_than_ten_milliradian_are_said_in_milliradian(answer, tmp_path):
    def table(extended):
        rms = {"reference": 0.0089, "calibrated": 0.004, "extended": extended}
        signals = {"throttle_angle": {"unit": "rad", **rms}, "motor_current": {"unit": "A", **rms}}
        errors = {"holdout": {"free_run": signals}}
        return write_explanation(plain(answer) | {"errors": errors}, None, tmp_path).read_text("utf-8")

    small, large = table(0.00035), table(0.011)
    assert ">0.0201 deg<" in small
    assert ">0.0089 A<" in small
    assert ">0.51 deg<" in large


def test_the_diagnosis_is_said_under_both_models(answer):
    diagnosis = plain(answer)["diagnosis"]
    for name in ("reference", "extended"):
        assert diagnosis[name]["verdict"] in ("pass", "fail", "inconclusive")
    assert diagnosis["extended"]["measurements"]["T_st"]["value"] == pytest.approx(MODEL.values.stiction, rel=0.1)


def test_the_report_shows_it_over_the_motors_turn(answer, tmp_path):
    series = pictures(answer.findings, answer.holdout)
    assert [left.over for left in series.left] == ["position", "motor turn"]
    page = write_explanation(plain(answer), series, tmp_path).read_text("utf-8")
    assert "<strong>Cogging torque.</strong>" in page
    assert "Friction of the models" in page
    assert "Torque residual over motor turn" in page
    assert not list(tmp_path.glob("*.png"))


def test_the_report_says_what_the_next_test_tells_and_what_it_does_not(answer, tmp_path):
    expected = {"value": 30.0, "unit": "1", "isolated": ["torque_ripple"], "not_isolated": ["parameter:coulomb"]}
    test = {"pair": ["cogging_torque", "torque_ripple"], "text": "weigh it", "scenario": "multisine"}
    found = plain(answer) | {"next_test": test | {"expected_separation": expected, "separation_here": None}}
    page = write_explanation(found, None, tmp_path).read_text("utf-8")
    assert "<li>Run multisine (next_test.yaml) on the same unit.</li>" in page
    assert "explain NEW OLD --same-unit" in page
    assert (
        "These steps distinguish cogging torque from torque ripple. Not distinguished: parametric fault of sliding "
        "friction. Weigh it." in page
    )


def test_the_extended_model_is_read_again(answer, tmp_path):
    write(answer, tmp_path)
    model = load_model(tmp_path / "model.yaml")
    assert [entry.id for entry in model.effects] == ["cogging_torque"]
    assert model.values.coulomb == pytest.approx(MODEL.values.coulomb, rel=0.05)


def test_the_numbers_of_the_model_file_stand_beside_those_with_intervals(answer, tmp_path):
    write(answer, tmp_path)
    effects = {entry.id: entry.strengths for entry in load_model(tmp_path / "model.yaml").effects}
    for cause in plain(answer)["causes"]:
        for name, number in cause["parameters"].items():
            assert float(str(effects[cause["id"]][name]).split()[0]) == pytest.approx(number["in_model"], rel=1e-4)
    base = plain(answer)["calibrated"]["slope_open"]["in_model"]
    assert load_model(tmp_path / "model.yaml").values.slope_open == pytest.approx(base, rel=1e-4)
    is_refitted = plain(answer)["model_file"]["values_from"] == "last fit in free run"
    assert is_refitted == answer.holdout.is_refitted


@pytest.fixture(scope="module")
def again(answer, cogging_recording):
    """Return the answer with the model as it was extended: nothing more is missing."""
    return explain([cogging_recording], extended_model(answer.findings))


def test_with_what_was_found_nothing_more_is_missing(again):
    assert plain(again)["verdict"] == "adequate"
    assert "cogging_torque" not in {one["id"] for one in plain(again)["candidates"]}
    assert [entry.id for entry in extended_model(again.findings).effects] == ["cogging_torque"]


def test_where_there_are_no_causes_nothing_is_shown_with_them(answer, again, tmp_path):
    for one, count in ((answer, 2), (again, 1)):
        series = pictures(one.findings, one.holdout)
        assert (series.after is not None) == (count == 2)
        assert {len(left.forward) for left in series.left} == {len(left.back) for left in series.left} == {count}
        page = write_explanation(plain(one), series, tmp_path).read_text("utf-8")
        assert ("residual over position, extended model" in page) == (count == 2)
        assert "calibrated model" in page
        assert "Friction of the models" in page


def test_an_adequate_model_that_errs_in_free_run_beyond_what_noise_leaves_says_so(again, answer, tmp_path):
    calibrated = plain(again)["errors"]["holdout"]["free_run"]["throttle_angle"]["calibrated"]

    def errors(of, most):
        holdout = replace(of.holdout, drawn=np.outer([0.3 * most, most], np.ones(of.holdout.drawn.shape[1])))
        return plain(explanation(of.findings, holdout))["errors"]

    assert errors(again, 1.01 * calibrated)["text"] == ""
    assert errors(answer, 1e-9)["text"] == ""  # it is not adequate, and says what is missing
    found = errors(again, 0.5 * calibrated)
    error = f"{np.degrees(calibrated):.3g} deg"
    assert f"in free run the calibrated model errs by {error}, more than noise" in found["text"]
    assert f"({np.degrees(0.15 * calibrated):.3g} to {np.degrees(0.5 * calibrated):.3g} deg)" in found["text"]
    page = write_explanation(plain(again) | {"errors": found}, None, tmp_path).read_text("utf-8")
    assert "The balances show no missing effect, but in free run" in page


def test_a_stop_just_below_the_sensors_zero_is_a_model_all_the_same(tmp_path):
    p = MODEL.vector()
    p[STOP_LOW] = -0.002
    model = replace(MODEL, parameters=calibrated_parameters(MODEL, p))
    path = tmp_path / "model.yaml"
    path.write_text(model_text(model, "calibrated"), "utf-8")
    assert load_model(path).values.stop_low == pytest.approx(-0.002)


def still(name, seconds=6.0):
    count = round(seconds / PERIOD)
    held = np.full(count, MODEL.values.limp_home)
    return Plan(name, np.full(count, int(Mode.POSITION)), held, np.zeros(count), np.zeros(count))


def test_the_next_test_is_the_plan_whose_record_leaves_least_open(answer):
    first = answer.findings.accepted[0]
    others = ["torque_ripple", "friction_temperature"]
    open_answer = replace(answer.findings, selection_steps=[replace(first, ambiguity_group=others)])
    scenario = load_scenario(find("scenario", "multisine")).content
    moves = plan_of("multisine", scenario, MODEL.values)
    test = plain(next_test(open_answer, [still("rest"), moves]))
    assert test["scenario"] == "multisine"
    assert test["pair"][0] == "cogging_torque"
    expected = test["expected_separation"]
    assert expected["isolated"] == ["torque_ripple"]
    assert expected["not_isolated"] == ["friction_temperature"]  # at one temperature nothing excludes it
    assert expected["value"] > 10.0


def test_where_no_plan_tells_the_class_apart_a_hand_has_to(answer):
    first = answer.findings.accepted[0]
    open_answer = replace(answer.findings, selection_steps=[replace(first, ambiguity_group=["torque_ripple"])])
    test = plain(next_test(open_answer, [still("rest")]))
    assert test["scenario"] is None
    assert test["text"]


def test_what_an_earlier_answer_left_is_not_taken_for_this_ones(answer, tmp_path):
    write(answer, tmp_path)
    (tmp_path / "next_test.yaml").write_text("of other data", "utf-8")
    write(Answer(replace(answer.explanation, next_test=None)), tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["explanation.json"]


def test_an_earlier_answers_pictures_go_and_other_files_stay(answer, tmp_path):
    series = pictures(answer.findings, answer.holdout)
    old = {
        f"{a}_over_{b.replace(' ', '_')}.png"
        for a in CHANNELS
        for b in _coordinates(answer.findings.balances[0], answer.findings.final.fit.whole)
    }
    for name in (*old, "over_runs.png", "my_own.png"):
        (tmp_path / name).write_bytes(b"of other data")
    write_explanation(plain(answer), series, tmp_path)
    assert [path.name for path in tmp_path.glob("*.png")] == ["my_own.png"]
    write_explanation(plain(answer), series, tmp_path, pictures=True)
    drawn = {"before_and_after.png", "torque_over_position.png", "torque_over_motor_turn.png"}
    assert {path.name for path in tmp_path.glob("*.png")} == {*drawn, "my_own.png"}
    assert all((tmp_path / name).stat().st_size > 10_000 for name in drawn)


def test_every_number_has_a_unit_and_no_more_digits_than_are_known(answer, tmp_path):
    found = plain(answer)
    assert {one["unit"] for one in found["calibrated"].values()} <= {unit_of(kind.dimension) for kind in KINDS.values()}
    cause = found["causes"][0]
    size = cause["parameters"]["sine"] | {"value": 0.0301234, "interval": [0.0300234, 0.0302234], "in_model": 0.0302}
    page = write_explanation(found | {"causes": [cause | {"parameters": {"sine": size}}]}, None, tmp_path)
    assert "sine: 0.03012 N·m (0.03002 to 0.03022)" in page.read_text("utf-8")


def test_what_data_cannot_show_is_no_detection_limit(answer, tmp_path):
    limit = {"parameter": "preload", "limit": None, "unit": "N·m", "within_bounds": False, "judged": True, "text": "no"}
    limits = {"spring_preload_shift": limit, "magnet_temperature": limit | {"judged": False, "text": "no heat"}}
    limits["friction_load"] = limit | {"within_bounds": True, "text": "a cause"}
    page = write_explanation(plain(answer) | {"detection_limits": limits}, None, tmp_path).read_text("utf-8")
    assert "These data cannot detect: spring preload shift." in page
    assert "Not judged: magnet temperature (no heat)." in page
    assert "None" not in page


def test_each_effect_has_a_limit_or_why_there_is_none(answer):
    found = plain(answer)["detection_limits"]
    assert set(found) == set(CATALOGUE)
    for one in found.values():
        assert one["limit"] is not None or one["text"]
    assert found["cogging_torque"]["text"] == "a cause"
    assert found["cogging_torque"]["limit"] < 0.03


def test_what_a_cause_cannot_be_told_from_is_said_and_not_called_hidden(answer, monkeypatch):
    (cause,) = answer.findings.accepted
    monkeypatch.setattr(cause, "ambiguity_group", ["torque_ripple"])
    found = plain(detection_limits(answer.findings))
    assert found["torque_ripple"]["text"] == "not isolable from the cause cogging_torque"
    assert found["torque_ripple"]["within_bounds"]
    assert found["cogging_torque"]["within_bounds"]


def test_members_of_an_ambiguity_group_have_no_probability(answer, monkeypatch):
    (cause,) = answer.findings.accepted
    assert causes(answer.findings)[0].probability > 0.5
    monkeypatch.setattr(cause, "ambiguity_group", ["torque_ripple"])
    assert causes(answer.findings)[0].probability is None


def test_what_data_do_not_tell_of_a_cause_is_said(answer, tmp_path):
    cause = plain(answer)["causes"][0]
    assert all(size["flags"] == [] for size in cause["parameters"].values())
    estimate = Estimate("cogging_torque.sine", 3, 0.03, -0.5, 0.5, on_bound=False, is_identifiable=False)
    size = plain(_size(estimate, "N·m", np.zeros(9)))
    assert size["flags"] == ["not identifiable from these data"]
    found = plain(answer) | {"causes": [cause | {"parameters": {"sine": size}}]}
    page = write_explanation(found, None, tmp_path).read_text("utf-8")
    assert "sine: 0.03 N·m (-0.5 to 0.5), not identifiable from these data" in page


PHONE = """<iframe srcdoc="{page}" style="width: 420px; height: 3000px"></iframe><script>
addEventListener("load", () => {{
  const tables = [...document.querySelector("iframe").contentDocument.querySelectorAll("section")]
  document.body.textContent = tables.map(one => one.scrollWidth - one.clientWidth).join(" ")
}})</script>"""


@pytest.mark.skipif(browser.EXECUTABLE is None, reason="no Chromium on this machine")
def test_on_a_telephone_no_table_is_cut(answer, tmp_path):
    page = write_explanation(plain(answer), None, tmp_path).read_text("utf-8")
    phone = tmp_path / "phone.html"
    phone.write_text(f"<!DOCTYPE html><body>{PHONE.format(page=escape(page))}</body>", "utf-8")
    over = re.search(r"<body[^>]*>([-\d ]*)</body>", browser.dom(phone, tmp_path))[1]
    assert len(over.split()) >= 5
    assert set(over.split()) == {"0"}
