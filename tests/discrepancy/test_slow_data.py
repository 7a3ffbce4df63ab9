"""Data too slow for balances: fitted to some runs in free run, judged on the others, and no cause is named."""

from dataclasses import replace

import numpy as np
import pytest
from answers import plain, write_explanation
from synthetic import MODEL

from etb_hil.base.errors import InputError
from etb_hil.cli.main import main
from etb_hil.discrepancy.answer.pictures import coarse_pictures
from etb_hil.discrepancy.explain import explain, write
from etb_hil.discrepancy.slow.sweeps import is_slow, slow_remark, sweeps_of
from etb_hil.plant.parameter import Tolerance
from etb_hil.plant.parameters import load_model
from etb_hil.plant.physics import COULOMB, PRELOAD_OPEN, STICTION
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import SampleBlock

STEP_NS = 11_000_000
FREQUENCIES = (1000.0, 2000.0, 3000.0, 4000.0, 5000.0, 6000.0)
STRONGER = 1.15  # times the voltage at the lowest frequency
_FREE = {"coulomb": 0.3, "stiction": 0.3, "preload_open": 0.3}
SLOW_MODEL = replace(
    MODEL,
    parameters={
        name: replace(p, tolerance=Tolerance(_FREE.get(name, 0.0), is_relative=True))
        for name, p in MODEL.parameters.items()
    },
)


def recording(duty, frequency, angle):
    time_ns = np.arange(len(duty)) * STEP_NS
    columns = {"motor_duty": duty, "pwm_frequency": frequency, "throttle_angle": angle}
    found = Recording("slow", ClockGrade.TABLE)
    found.append([SampleBlock("table", time_ns, time_ns, columns, np.zeros(len(time_ns), np.int64))])
    return found


@pytest.fixture(scope="module")
def slow():
    """Staircases of duty under six PWM frequencies, upwards; at the lowest the drive is stronger than it says."""
    stairs = np.repeat(np.concatenate([np.zeros(1), np.linspace(0.05, 0.5, 12), np.zeros(3)]), 45)
    duty = np.tile(stairs, len(FREQUENCIES))
    frequency = np.repeat(FREQUENCIES, len(stairs))
    rest = np.full(len(duty), MODEL.values.limp_home)
    p = SLOW_MODEL.vector()
    p[COULOMB], p[STICTION], p[PRELOAD_OPEN] = 1.15 * p[COULOMB], 1.15 * p[STICTION], 0.9 * p[PRELOAD_OPEN]
    parts = [
        replace(sweep, voltage=sweep.voltage * (STRONGER if sweep.condition == FREQUENCIES[0] else 1.0)).simulated(p)
        for sweep in sweeps_of(recording(duty, frequency, rest), SLOW_MODEL)
    ]
    noise = 1e-3 * np.random.default_rng(1).standard_normal(len(duty))
    return recording(duty, frequency, np.concatenate(parts) + noise), p


@pytest.fixture(scope="module")
def answer(slow):
    return explain([slow[0]], SLOW_MODEL, fit_on=(3000.0, 5000.0))


def test_slow_data_are_told_from_fast_ones(slow, cogging_recording):
    assert is_slow(slow[0])
    assert not is_slow(cogging_recording)


def test_it_is_said_that_they_are_slow_and_when_it_may_be_the_times_unit(slow, cogging_recording):
    assert "90.9 samples a second: naming a cause needs 200 a second" in slow_remark(slow[0])
    assert "ms that are read as s" not in slow_remark(slow[0])
    assert slow_remark(cogging_recording) == ""
    block = cogging_recording.block("table")
    thousandfold = Recording("ms as s", ClockGrade.TABLE)
    thousandfold.append([replace(block, time_ns=1000 * block.time_ns, stamp_ns=1000 * block.stamp_ns)])
    assert "has 2 samples a second" in slow_remark(thousandfold)
    assert "check the time's unit" in slow_remark(thousandfold)


def test_the_command_says_so_before_the_long_work(tmp_path, monkeypatch, capsys):
    lines = ["time_s,motor_voltage_V,throttle_angle_deg"]
    lines += [f"{0.5 * k},{k % 7},{20 + k % 11}" for k in range(200)]
    (tmp_path / "data.csv").write_text("\n".join([*lines, ""]), "utf-8")

    def begins(*_, **__):
        assert "check the time's unit" in capsys.readouterr().err
        raise InputError("the long work began")

    monkeypatch.setattr("etb_hil.discrepancy.explain.explain", begins)
    main(["explain", str(tmp_path / "data.csv"), "--model", "default", "--out", str(tmp_path / "there")])
    assert "the long work began" in capsys.readouterr().err


def test_no_cause_is_named(answer):
    assert plain(answer)["verdict"] == "unexplained"
    assert plain(answer)["causes"] == []
    assert "too slowly" in plain(answer)["judged_by"]


def test_the_other_runs_are_predicted_but_for_the_one_that_differs(answer):
    r_squared = {run["value"]: run["r_squared"] for run in plain(answer)["runs"]}
    assert all(r_squared[value] > 0.99 for value in FREQUENCIES[1:])
    assert r_squared[FREQUENCIES[0]] < 0.95
    assert plain(answer)["unexplained"]["runs"][0]["value"] == FREQUENCIES[0]


def test_of_a_number_that_no_run_shows_nothing_is_claimed(answer):
    for name, one in plain(answer)["calibrated"].items():
        low, high = one["interval"]
        assert low <= one["value"] <= high
        assert high - low > 1e-6 * abs(one["value"]), name


def test_what_was_changed_is_fitted_again(answer, slow):
    found, p = plain(answer)["calibrated"], slow[1]
    assert found["preload_open"]["value"] == pytest.approx(p[PRELOAD_OPEN], rel=0.05)
    assert found["coulomb"]["value"] == pytest.approx(p[COULOMB], rel=0.1)


def test_frequency_and_time_are_owned_up_to_with_the_test_that_would_part_them(answer):
    assert set(plain(answer)["next_test"]["pair"]) == {"PWM frequency", "elapsed time"}
    assert "shuffle its order" in plain(answer)["next_test"]["text"]


def test_files_and_page_hold_it(answer, tmp_path):
    paths = write(answer, tmp_path)
    assert {path.name for path in paths} == {"explanation.json", "model.yaml"}
    assert load_model(tmp_path / "model.yaml").values.coulomb > MODEL.values.coulomb
    page = write_explanation(plain(answer), coarse_pictures(answer.coarse), tmp_path).read_text("utf-8")
    assert "too slowly to name causes" in page
    assert "pwm frequency 1000 Hz" in page


def test_runs_that_are_not_there_are_refused(slow):
    with pytest.raises(InputError, match="must name conditions of the data"):
        explain([slow[0]], SLOW_MODEL, fit_on=(1234.0,))


def test_fast_data_need_no_choice(cogging_recording):
    with pytest.raises(InputError, match="too slow"):
        explain([cogging_recording], MODEL, fit_on=(1.0,))
