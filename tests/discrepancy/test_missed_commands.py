"""Samples of a voltage that somebody held are told from samples between which a controller commanded something else."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from answers import plain
from explain_cases import hidden_case, recording_of

from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.discrepancy.answer.insufficient_data import too_little_to_reject
from etb_hil.discrepancy.explain import explain
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.rerun import rerun
from etb_hil.discrepancy.measured.missed_commands import FAST, may_miss_commands, rate_of_voltage
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.device import THROTTLE, Device, Driven
from etb_hil.plant.effects.layout import row
from etb_hil.plant.parameters import load_model

DRIVE = Device(is_throttle=False, driven=Driven.FORCE)


def _measured(hertz, seed=214300, effects=(), view="full", **changed):
    """The record of a unit of the generator, whose controller commands a thousand times a second."""
    hidden = hidden_case(seed, effects, rate=hertz, seconds=20.0, view=view)
    (measured,) = measurements_of(hidden.recording, hidden.model)
    return replace(measured, **changed), hidden.model


@pytest.mark.parametrize("seed", [214300, 214304])
@pytest.mark.parametrize(("rate", "misses"), [(2000, False), (1000, False), (500, True), (250, True)])
def test_samples_that_come_more_seldom_than_commands_miss_some(rate, misses, seed):
    assert may_miss_commands(*_measured(rate, seed)) is misses


@pytest.mark.parametrize(("rate", "misses"), [(2000, False), (1000, False), (500, True)])
def test_a_step_of_a_coarse_encoder_is_no_command(rate, misses):
    assert may_miss_commands(*_measured(rate, view="encoder_only")) is misses


@pytest.mark.parametrize("hertz", [500, 250])
@pytest.mark.parametrize("degrees", [25.0, 70.0])
def test_slow_samples_of_as_slow_a_controller_miss_none(hertz, degrees):
    """Led along the same motion by a controller that commands once a sample, also while the winding warms up."""
    measured, model = _measured(hertz)
    measured = replace(measured, temperature=np.linspace(25.0, degrees, len(measured)))
    warm = Balances(measured, model)
    warms = model.vector()
    warms[row("resistance_temperature")] = 1.0
    assert not may_miss_commands(rerun(warm, warms, seed=1), model)


def test_a_fast_logs_commands_lie_where_they_like():
    """At 4 kHz samples are thinned for the balances, but not for this."""
    hidden = hidden_case(214304, rate=4000, seconds=20.0)
    later = {role: values[1:] for role, values in hidden.case.table.items()}
    hidden.case.table = {**later, "time": later["time"] - later["time"][0]}
    (measured,) = measurements_of(recording_of(hidden.case), hidden.model)
    assert not may_miss_commands(measured, hidden.model)


def _bursts(scenario, effect, folder):
    """A session of a unit with an effect on the stock bench whose samples come at 20 kHz, with one voltage for ten."""
    path, limits, unit = find("model", "default"), find("limits", "default"), folder / "unit.yaml"
    unit.write_text(path.read_text("utf-8").replace("effects: []", f"effects: [{effect}]"), "utf-8")
    files = JobFiles(find("scenario", scenario), find("bench", "virtual_fd"), path, limits, unit=unit)
    finished = execute(prepare(files), folder, "", 1)
    model = load_model(path)
    (measured,) = measurements_of(finished.analysis.recording, model)
    return measured, model


@pytest.mark.parametrize("scenario", ["multisine", "friction_check"])
def test_bursts_with_one_voltage_each_miss_none(scenario, tmp_path):
    measured, model = _bursts(scenario, "", tmp_path)
    assert measured.rate == pytest.approx(20000.0)
    assert rate_of_voltage(measured) == pytest.approx(2000.0)
    assert not may_miss_commands(measured, model)


@pytest.mark.study
@pytest.mark.parametrize(("name", "strengths"), [("gear_backlash", "play: 0.006 rad"), ("brush_drop", "drop: 0.8 V")])
def test_a_fault_that_was_recorded_in_bursts_is_in_the_class_that_is_named(name, strengths, tmp_path):
    measured, model = _bursts("isolability", f"{{id: {name}, strengths: {{{strengths}}}}}", tmp_path)
    findings = search(model, [Balances(measured, model)])
    assert too_little_to_reject(findings, [measured]) == []
    (found,) = findings.accepted
    assert name in (found.winner.id, *found.ambiguity_group)


@pytest.mark.parametrize("missed", [2, 4])
def test_where_bursts_miss_commands_their_voltages_rate_is_said(missed):
    """The samples of a unit, and between them more: each of current and motion, every so many of voltage."""
    measured, model = _measured(2000, 214304)
    samples = np.arange(10 * len(measured)) / 10
    own = np.arange(len(measured))
    fast = {name: np.interp(samples, own, getattr(measured, name)) for name in ("current", "angle", "temperature")}
    held = np.repeat(measured.voltage[:: 2 * missed], 20 * missed)[: len(samples)]
    bursts = replace(measured, rate=20000.0, voltage=held, is_good=np.ones(len(samples), np.bool_), plate=None, **fast)
    assert rate_of_voltage(bursts) == 2000.0
    assert may_miss_commands(bursts, model)


def test_a_voltage_that_is_read_late_is_one_that_is_held():
    measured, model = _measured(1000)
    samples = np.arange(len(measured))
    late = {name: np.interp(samples + 0.5, samples, getattr(measured, name)) for name in ("current", "angle")}
    assert not may_miss_commands(replace(measured, **late), model)


@pytest.mark.parametrize(
    ("effect", "seed"),
    [
        ("supply_sag", 214400),
        pytest.param("supply_sag", 219012, id="a supply that sags by a third"),
        ("hbridge_dead_time", 214400),
        ("measurement_delay", 214400),
        ("supply_ripple", 214400),
        pytest.param("current_sensor_curvature", 220303, id="a current's sensor whose scale bends"),
    ],
)
def test_what_is_wrong_with_bridge_supply_or_sensor_is_no_command(effect, seed):
    assert not may_miss_commands(*_measured(2000, seed, (effect,)))


def test_without_a_current_slow_samples_tell_nothing_of_commands():
    assert may_miss_commands(*_measured(500, current=None))
    assert not may_miss_commands(*_measured(1000, current=None))


@pytest.mark.parametrize("device", [THROTTLE, replace(DRIVE, driven=Driven.VOLTAGE)])
def test_without_a_current_the_rate_that_is_needed_is_said(device):
    measured, model = _measured(500, current=None, device=device)
    findings = SimpleNamespace(verdict="unexplained", balances=[Balances(measured, model)], model=model)
    (said,) = too_little_to_reject(findings, [measured])
    assert "at 500 Hz the voltage may change between samples: below 900 Hz a record without a current" in said
    assert said.endswith("record the current, too, or at 900 Hz or more")


def test_the_howto_states_the_rate_that_is_needed_without_a_current():
    text = (Path(__file__).parents[2] / "docs/howto/explain.md").read_text("utf-8")
    assert f"without a measured current needs {FAST:g} Hz or more" in " ".join(text.split())


def test_a_drive_is_given_what_its_samples_say():
    assert not may_miss_commands(*_measured(500, device=DRIVE))


@pytest.mark.study
@pytest.mark.slow
def test_a_healthy_unit_is_not_rejected_of_commands_that_no_sample_has():
    hidden = hidden_case(214302, rate=500, seconds=15.0)
    found = plain(explain([hidden.recording], hidden.model))
    assert found["verdict"] == "insufficient_data"
    assert found["causes"] == []
    assert "at 500 Hz the voltage may change between samples" in found["data_quality"][0]
    assert "in step with the controller's commands" in found["data_quality"][0]


@pytest.mark.slow
def test_an_interrupt_rejects_nobody_of_such_commands_either():
    hidden = hidden_case(214302, rate=500, seconds=15.0)

    def progress(what):
        if what.startswith("looking for a cause"):
            raise KeyboardInterrupt

    found = plain(explain([hidden.recording], hidden.model, progress=progress))
    assert found["verdict"] == "insufficient_data"
    assert "at 500 Hz the voltage may change between samples" in found["data_quality"][0]
    assert found["interrupted"].startswith("looking for a cause")
    assert found["stages"].startswith("done: reading the data")
