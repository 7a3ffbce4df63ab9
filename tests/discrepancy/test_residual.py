"""An answer without a name says in a technician's words what most of the rest follows."""

import pytest
from answers import write_explanation
from synthetic import MODEL, measurement

from etb_hil.cli.main import main
from etb_hil.discrepancy.candidates.nonparametric import _bank
from etb_hil.discrepancy.explain import Answer
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.report import residual_text as words
from etb_hil.results.explanation_file import explanation_from_dict

UNIT = {"schema": "etb_hil/explanation/3", "verdict": "unexplained", "causes": [], "data_quality": [], "confounded": []}


def residual_text(found):
    return words.residual_text(explanation_from_dict(found))


def _found(balance, over, parity, share=0.967, **more):
    splines = [
        {"balance": balance, "over": over, "parity": parity, "explained_share": share},
        {"balance": "torque", "over": "angle", "parity": "even", "explained_share": 0.12},
    ]
    return UNIT | {"unexplained": {"where": [], "nonparametric_terms": splines}} | more


DRY = _found("torque", "time", "odd")
SAYS = "97 % of the residual looks like friction that changes as time goes on, against the motion whichever way."


def test_the_greediest_says_what_the_rest_follows():
    assert residual_text(DRY) == SAYS
    wrong = residual_text(_found("all", "base parameters beyond their tolerances", "neither"))
    assert wrong.endswith("wrong by more than their tolerances allow: is it the right model file?")
    even = _found("torque", "angle", "even")
    assert "a torque that changes with the angle, the same whichever way it moves" in residual_text(even)
    assert "a force that changes with the position" in residual_text(even | {"friction": {"coulomb": {"unit": "N"}}})


@pytest.mark.parametrize(
    "found",
    [
        UNIT,
        _found("torque", "time", "odd", 0.49),
        DRY | {"verdict": "explained"},
    ],
)
def test_where_nothing_takes_the_most_nothing_is_said(found):
    assert residual_text(found) == ""


def test_every_spline_of_a_search_has_its_words():
    for balance, over, parity in _bank(Balances(measurement(MODEL.vector(), seed=1), MODEL), MODEL.vector()):
        said = residual_text(_found(balance, over, parity))
        assert said.startswith("97 % of the residual looks like ")
        assert "{" not in said


CANDIDATE = {
    "selection_step": 1, "id": "supply_sag", "accepted": False, "rejection": "takes 1.0 %", "probability": 0.0,
    "residual_share": 0.99, "looks_like": "", "check": "",
}  # fmt: skip
LIMIT = {
    "limit": 0.5,
    "unit": "ohm",
    "parameter": "source_resistance",
    "judged": True,
    "within_bounds": True,
    "text": "",
}


def test_where_no_candidate_comes_near_no_test_is_asked_for(tmp_path):
    found = DRY | {"candidates": [CANDIDATE], "next_test": None}
    page = write_explanation(found, None, tmp_path).read_text("utf-8")
    assert "No stock test distinguishes further" in page
    assert "No stock test distinguishes further" not in write_explanation(DRY, None, tmp_path).read_text("utf-8")


def test_limits_beside_something_unexplained_exclude_nothing(tmp_path):
    found = DRY | {"detection_limits": {"supply_sag": LIMIT}}
    caution = "A listed effect may be a part of the unexplained residual."
    assert caution in write_explanation(found, None, tmp_path).read_text("utf-8")
    assert caution not in write_explanation(found | {"verdict": "adequate"}, None, tmp_path).read_text("utf-8")


def test_friction_of_a_diagnosis_stands_with_its_interval(tmp_path):
    numbers = {"T_c": {"value": 0.0798, "interval": [0.0, 0.172], "unit": "N·m"}}
    wide = {"reference": {"verdict": "pass", "measurements": numbers}, "text": "the verdict stays: pass"}
    friction = {"coulomb": dict.fromkeys(("reference", "calibrated", "extended"), 0.14) | {"unit": "N·m"}}
    page = write_explanation(DRY | {"diagnosis": wide, "friction": friction}, None, tmp_path).read_text("utf-8")
    assert "sliding friction 0.0798 N·m (95 %: 0 to 0.172); pass." in page


def test_report_and_terminal_say_it(tmp_path, monkeypatch, capsys):
    assert f"<p>{SAYS}</p>" in write_explanation(DRY, None, tmp_path).read_text("utf-8")
    samples = "".join(f"{0.001 * k},{k % 7},{20 + k % 11}\n" for k in range(200))
    (tmp_path / "data.csv").write_text(f"time_s,motor_voltage_V,throttle_angle_deg\n{samples}", "utf-8")
    monkeypatch.setattr("etb_hil.discrepancy.explain.explain", lambda *_, **__: Answer(explanation_from_dict(DRY)))
    out = tmp_path / "there"
    assert main(["explain", str(tmp_path / "data.csv"), "--model", "default", "--out", str(out)]) == 0
    said = capsys.readouterr().out.splitlines()
    assert (said[0], said[2]) == ("verdict: unexplained", f"  {SAYS}")
