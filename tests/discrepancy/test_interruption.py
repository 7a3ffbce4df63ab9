"""Ctrl-C while explaining: what is known by then is kept, and nothing is claimed that was not looked for."""

import pytest
from answers import plain, write_explanation
from synthetic import MODEL

from etb_hil.base.outcome import ExitCode
from etb_hil.cli.main import main
from etb_hil.discrepancy.explain import explain, write
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.table_one import KINDS
from etb_hil.recording.recording import Recording


def _interrupts(*_, **__):
    raise KeyboardInterrupt


@pytest.fixture(scope="module")
def searched():
    return []


@pytest.fixture
def one_search(monkeypatch, searched):
    """Search once, with few candidates, for all tests that interrupt a later stage of the same explanation."""
    without = {*CATALOGUE, *(f"parameter:{name}" for name in KINDS)} - {"cogging_torque", "torque_ripple"}

    def first(*arguments, **options):
        if not searched:
            searched.append(search(*arguments, without=sorted(without), **options))
        return searched[0]

    monkeypatch.setattr("etb_hil.discrepancy.explain.search", first)


def _interrupted_at(cogging_recording, word):
    def progress(what):
        if what.startswith(word):
            raise KeyboardInterrupt

    return explain([cogging_recording], MODEL, progress=progress)


def test_before_the_calibration_nothing_is_known(cogging_recording):
    answer = _interrupted_at(cogging_recording, "calibrating")
    assert plain(answer)["verdict"] == "insufficient_data"
    assert plain(answer)["interrupted"].startswith("calibrating")
    assert plain(answer)["data_quality"]
    assert plain(answer)["stages"].startswith("done: reading the data; not done: calibrating, looking for causes")


def test_in_the_search_the_calibration_is_kept_and_no_cause_is_named(cogging_recording, tmp_path):
    answer = _interrupted_at(cogging_recording, "looking for a cause")
    found = plain(answer)
    assert found["verdict"] == "unexplained"
    assert found["causes"] == []
    assert found["interrupted"] == "looking for a cause"
    assert found["calibrated"]["resistance"]["value"] == pytest.approx(MODEL.values_at(25.0).resistance, rel=0.02)
    assert found["unexplained"]["where"]
    assert {path.name for path in write(answer, tmp_path)} == {"explanation.json", "model.yaml"}
    assert "interrupted while looking for a cause" in write_explanation(found, None, tmp_path).read_text("utf-8")


@pytest.mark.study
@pytest.mark.usefixtures("one_search")
def test_after_the_search_the_causes_are_kept(cogging_recording):
    answer = _interrupted_at(cogging_recording, "running the models freely")
    assert plain(answer)["verdict"] in ("explained", "ambiguous")
    assert [cause["id"] for cause in plain(answer)["causes"]] == ["cogging_torque"]
    assert plain(answer)["errors"] is None
    assert plain(answer)["interrupted"] == "running the models freely"


@pytest.mark.usefixtures("one_search")
@pytest.mark.parametrize(
    "moment",
    [
        "fitting a last time, in free run",
        pytest.param("fitting a last time, in free run, without each part", marks=pytest.mark.study),
    ],
)
def test_in_the_last_fit_the_held_out_errors_are_kept(cogging_recording, tmp_path, moment):
    answer = _interrupted_at(cogging_recording, moment)
    found = plain(answer)
    errors = found["errors"]["holdout"]["free_run"]["throttle_angle"]
    assert {name for name, one in errors.items() if one is None} == {"fitted_in_free_run"}
    assert found["gain"]["value"] == pytest.approx(1.0 - errors["extended"] / errors["calibrated"])
    assert found["gain"]["over_reference"]["value"] == pytest.approx(1.0 - errors["extended"] / errors["reference"])
    assert found["gain"]["value"] > 0.3
    assert found["interrupted"].startswith(moment)
    assert found["model_file"]["values_from"] == "balances"
    for number in found["causes"][0]["parameters"].values():
        assert number["in_model"] == number["value"]
    assert {path.name for path in write(answer, tmp_path)} == {"explanation.json", "model.yaml"}
    assert "interrupted while fitting a last time, in free run" in write_explanation(found, None, tmp_path).read_text(
        "utf-8"
    )


@pytest.mark.study
def test_behind_the_search_by_the_likelihood_the_causes_and_the_calibration_are_kept(cogging_recording, monkeypatch):
    monkeypatch.setattr("etb_hil.discrepancy.search.stepwise.consider_force_scale", _interrupts)
    found = plain(explain([cogging_recording], MODEL))
    assert [cause["id"] for cause in found["causes"]] == ["cogging_torque"]
    assert found["calibrated"]["resistance"]["value"] == pytest.approx(MODEL.values_at(25.0).resistance, rel=0.02)
    assert "done: reading the data, calibrating; not done: looking for causes" in found["stages"]


def test_right_after_the_calibration_its_numbers_are_kept_without_intervals(cogging_recording, monkeypatch, tmp_path):
    monkeypatch.setattr("etb_hil.discrepancy.search.stepwise.current_model_near", _interrupts)
    answer = explain([cogging_recording], MODEL)
    found = plain(answer)
    assert found["verdict"] == "insufficient_data"
    resistance = found["calibrated"]["resistance"]
    assert resistance["value"] == pytest.approx(MODEL.values_at(25.0).resistance, rel=0.02)
    assert resistance["interval"] is None
    assert found["interrupted"] == "simulating the residual of a true model"
    assert [path.name for path in write(answer, tmp_path)] == ["explanation.json"]
    page = write_explanation(found, None, tmp_path).read_text("utf-8")
    assert "interrupted before its interval was known" in page
    assert "Done: reading the data, calibrating; not done: looking for causes" in page


@pytest.mark.study
@pytest.mark.usefixtures("one_search")
def test_an_interrupt_while_the_answer_is_put_together_does_not_lose_it(cogging_recording):
    answer = _interrupted_at(cogging_recording, "putting the answer together")
    assert [cause["id"] for cause in plain(answer)["causes"]] == ["cogging_torque"]
    assert plain(answer)["errors"] is not None
    assert plain(answer)["interrupted"] == "putting the answer together"


def test_while_the_data_are_made_ready_it_is_said_that_nothing_was_done(cogging_recording, monkeypatch):
    monkeypatch.setattr("etb_hil.discrepancy.explain.measurements_of", _interrupts)
    found = plain(explain([cogging_recording], MODEL))
    assert found["verdict"] == "insufficient_data"
    assert found["stages"].startswith("not done: reading the data, calibrating, looking for causes")


def test_in_the_first_seconds_of_the_command_it_says_that_nothing_was_written(monkeypatch, tmp_path, capsys):
    # A method: a function's name, patched while others are first imported, would stay in them.
    monkeypatch.setattr(Recording, "append", _interrupts)
    (tmp_path / "data.csv").write_text("time_s,motor_voltage_V\n0,1\n0.001,2\n0.002,1\n", "utf-8")
    code = main(["explain", str(tmp_path / "data.csv"), "--model", "default", "--out", str(tmp_path / "there")])
    assert code == ExitCode.ABORTED
    assert "the data were being read; nothing was fitted and nothing was written" in capsys.readouterr().err
    assert not (tmp_path / "there").exists()
