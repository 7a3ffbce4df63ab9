"""Ctrl-C while explaining: what is known by then is kept, and nothing is claimed that was not looked for."""

import pytest
from synthetic import MODEL

from etb_hil.discrepancy.explain import explain, write
from etb_hil.report.explain_report import write_explanation


def _interrupted_at(cogging_recording, word):
    def progress(what):
        if what.startswith(word):
            raise KeyboardInterrupt

    return explain([cogging_recording], MODEL, progress=progress)


def test_before_the_calibration_nothing_is_known(cogging_recording):
    answer = _interrupted_at(cogging_recording, "calibrating")
    assert answer.explanation["verdict"] == "insufficient_data"
    assert answer.explanation["interrupted"].startswith("calibrating")
    assert answer.explanation["data_quality"]


def test_in_the_search_the_calibration_is_kept_and_no_cause_is_named(cogging_recording, tmp_path):
    answer = _interrupted_at(cogging_recording, "trying stribeck_shape")
    found = answer.explanation
    assert found["verdict"] == "unexplained"
    assert found["causes"] == []
    assert found["interrupted"] == "trying stribeck_shape"
    assert found["calibrated"]["resistance"]["value"] == pytest.approx(MODEL.values.resistance, rel=0.02)
    assert found["unexplained"]["where"]
    assert {path.name for path in write(answer, tmp_path)} == {"explanation.json", "model.yaml"}
    assert "interrupted while trying stribeck shape" in write_explanation(found, None, tmp_path).read_text("utf-8")


def test_after_the_search_the_causes_are_kept(cogging_recording):
    answer = _interrupted_at(cogging_recording, "running the models freely")
    assert answer.explanation["verdict"] in ("explained", "ambiguous")
    assert [cause["effect"] for cause in answer.explanation["causes"]] == ["cogging_torque"]
    assert "errors" not in answer.explanation
    assert answer.explanation["interrupted"] == "running the models freely"


@pytest.mark.parametrize(
    "moment", ["fitting a last time, in free run", "fitting a last time, in free run, without each part"]
)
def test_in_the_last_fit_the_held_out_errors_are_kept(cogging_recording, tmp_path, moment):
    answer = _interrupted_at(cogging_recording, moment)
    found = answer.explanation
    errors = found["errors"]["holdout"]["free_run"]["throttle_angle"]
    assert set(errors) == {"nominal", "calibrated", "extended", "noise_floor"}
    assert found["gain"]["value"] == pytest.approx(1.0 - errors["extended"] / errors["calibrated"])
    assert found["gain"]["value"] > 0.3
    assert found["interrupted"].startswith(moment)
    assert found["model_file"]["numbers_of"] == "balances"
    for number in found["causes"][0]["parameters"].values():
        assert number["in_model"] == number["value"]
    assert {path.name for path in write(answer, tmp_path)} == {"explanation.json", "model.yaml"}
    assert "interrupted while fitting a last time, in free run" in write_explanation(found, None, tmp_path).read_text(
        "utf-8"
    )
