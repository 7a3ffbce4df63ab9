"""Ctrl-C while explaining: what is known by then is kept, and nothing is claimed that was not looked for."""

import numpy as np
import pytest
from synthetic import MODEL, RATE, measurement

from etb_hil.discrepancy.explain import explain, write
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import SampleBlock
from etb_hil.report.explain_report import write_explanation


@pytest.fixture(scope="module")
def recording():
    p = MODEL.vector()
    p[CATALOGUE["cogging_torque"].indices[0]] = 0.03
    p[CATALOGUE["cogging_torque"].indices[2]] = 7.0
    m = measurement(p, seed=5)
    time_ns = np.round(np.arange(len(m)) / RATE * 1e9).astype(np.int64)
    columns = {
        "motor_voltage": m.voltage,
        "motor_current": m.current,
        "motor_angle": m.angle * MODEL.values.gear_ratio,
        "throttle_angle": m.plate,
        "temperature": m.temperature,
    }
    found = Recording("synthetic", ClockGrade.TABLE)
    found.append([SampleBlock("table", time_ns, time_ns, columns, np.zeros(len(time_ns), np.int64))])
    return found


def _interrupted_at(recording, word):
    def progress(what):
        if what.startswith(word):
            raise KeyboardInterrupt

    return explain([recording], MODEL, progress=progress)


def test_before_the_calibration_nothing_is_known(recording):
    answer = _interrupted_at(recording, "calibrating")
    assert answer.explanation["verdict"] == "insufficient_data"
    assert answer.explanation["interrupted"].startswith("calibrating")
    assert answer.explanation["data_quality"]


def test_in_the_search_the_calibration_is_kept_and_no_cause_is_named(recording, tmp_path):
    answer = _interrupted_at(recording, "trying stribeck_shape")
    found = answer.explanation
    assert found["verdict"] == "unexplained"
    assert found["causes"] == []
    assert found["interrupted"] == "trying stribeck_shape"
    assert found["calibrated"]["resistance"]["value"] == pytest.approx(MODEL.values.resistance, rel=0.02)
    assert found["unexplained"]["where"]
    assert {path.name for path in write(answer, tmp_path)} == {"explanation.json", "model.yaml"}
    assert "interrupted while trying stribeck shape" in write_explanation(found, None, tmp_path).read_text("utf-8")


def test_after_the_search_the_causes_are_kept(recording):
    answer = _interrupted_at(recording, "running the models freely")
    assert answer.explanation["verdict"] in ("explained", "ambiguous")
    assert [cause["effect"] for cause in answer.explanation["causes"]] == ["cogging_torque"]
    assert "errors" not in answer.explanation
    assert answer.explanation["interrupted"] == "running the models freely"
