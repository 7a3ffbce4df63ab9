"""Slow samples of a controlled unit: what was commanded between them is nobody's fault, and no number stands for it."""

from dataclasses import replace

import numpy as np
import pytest
from answers import plain, write_explanation
from explain_cases import hidden_case, recording_of

from etb_hil.discrepancy.answer.pictures import coarse_pictures
from etb_hil.discrepancy.explain import explain, write
from etb_hil.discrepancy.measured.angles import Angles
from etb_hil.discrepancy.slow.drive_samples import DriveSamples, drive_samples, is_held
from etb_hil.discrepancy.slow.sweeps import sweeps_of
from etb_hil.plant.parameter import Tolerance

EVERY = 25  # samples of 2 kHz
VOLTMETER = 0.02  # V


@pytest.fixture(scope="module")
def healthy():
    return hidden_case(228000)


def _slow(healthy, **columns):
    table = {role: values[::EVERY] for role, values in {**healthy.case.table, **columns}.items()}
    return recording_of(replace(healthy.case, table=table))


@pytest.fixture(scope="module")
def answer(healthy):
    """Of the model only friction is fitted, which is quick."""
    known = {
        name: p if name == "coulomb" else replace(p, tolerance=Tolerance(0.0, is_relative=True))
        for name, p in healthy.model.parameters.items()
    }
    return explain([_slow(healthy)], replace(healthy.model, parameters=known))


def _driven(drive, *, is_duty=False):
    samples = np.arange(len(drive))
    return DriveSamples(12_500_000 * samples, drive, is_duty, Angles(np.zeros(len(drive)), 1e-4, None))


def test_a_healthy_unit_whose_commands_are_missed_is_not_rejected(answer):
    found = plain(answer)
    assert found["verdict"] == "insufficient_data"
    reason = found["data_quality"][0]
    assert "at 80 Hz the voltage may change between samples" in reason
    assert "hold each step for several samples" in reason
    assert found["unexplained"] == {"where": [], "nonparametric_terms": [], "runs": [], "text": ""}


def test_no_number_is_fitted_in_place_of_missed_commands(answer, tmp_path):
    assert plain(answer)["calibrated"] == {}
    assert [path.name for path in write(answer, tmp_path)] == ["explanation.json"]


def test_its_page_rejects_nobody_and_draws_no_empty_plot(answer, tmp_path):
    gain = {**plain(answer)["gain"], "value": -0.91, "interval": [-6.15, 0.32]}
    series = coarse_pictures(answer.coarse)
    nowhere = np.full(len(series.runs.value), np.nan)
    series = replace(series, runs=replace(series.runs, breaks_away=nowhere, model_breaks_away=nowhere))
    page = write_explanation({**plain(answer), "gain": gain}, series, tmp_path).read_text("utf-8")
    assert "These data do not suffice to judge the model." in page
    assert "lacks an effect" not in page
    assert "breaks away at / V" not in page
    assert "error is 91 % larger (615 % larger to 32 % smaller) than the reference model" in page


def test_where_a_plate_breaks_away_it_is_drawn(answer, tmp_path):
    series = coarse_pictures(answer.coarse)
    somewhere = np.linspace(1.0, 2.0, len(series.runs.value))
    series = replace(series, runs=replace(series.runs, breaks_away=somewhere))
    assert "breaks away at / V" in write_explanation(plain(answer), series, tmp_path).read_text("utf-8")


@pytest.mark.parametrize("away", [0.14, -1.0])
def test_an_encoder_counts_from_the_plate_sensors_zero(healthy, away):
    gear = healthy.model.values.gear_ratio
    before = np.concatenate([one.angle for one in sweeps_of(_slow(healthy), healthy.model)])
    moved = _slow(healthy, motor_angle=healthy.case.table["motor_angle"] + gear * away)
    after = np.concatenate([one.angle for one in sweeps_of(moved, healthy.model)])
    np.testing.assert_allclose(after, before, atol=1e-3)
    flags = drive_samples(moved, healthy.model).angles.flags
    assert flags == (
        f"the zeros of encoder and plate sensor differ by {np.degrees(-away):.1f} deg: the encoder's was corrected",
    )


@pytest.mark.parametrize("samples", [3, 20])
@pytest.mark.parametrize("is_duty", [False, True])
def test_stairs_were_held(healthy, samples, is_duty):
    stairs = np.repeat(np.tile(np.linspace(0.0, 0.5, 26), 8), samples)
    noise = VOLTMETER * np.random.default_rng(1).standard_normal(len(stairs))
    drive = stairs if is_duty else 13.5 * stairs + noise
    assert is_held(_driven(drive, is_duty=is_duty), healthy.model.sensors)


@pytest.mark.parametrize("excitation", ["rich", "slow_sweep", "ramps_and_steps", "open_loop"])
@pytest.mark.parametrize("every", [11, 25, 100])
def test_what_a_controller_commands_was_not(excitation, every):
    hidden = hidden_case(228001, excitation=excitation)
    for role in ("motor_voltage", "motor_duty"):
        drive = hidden.case.table["motor_voltage"][::every]
        drive = np.round(drive / 13.5, 3) if role == "motor_duty" else drive
        assert not is_held(_driven(drive, is_duty=role == "motor_duty"), hidden.model.sensors)


def test_a_supplys_noise_is_no_condition(healthy):
    runs = sweeps_of(_slow(healthy), healthy.model)
    assert "supply_voltage" in healthy.recording.roles
    assert [run.role for run in runs] == [""] * 10


def test_a_drive_that_hardly_ever_changes_tells_nothing(healthy):
    assert not is_held(_driven(np.repeat([0.0, 3.0], 500)), healthy.model.sensors)
