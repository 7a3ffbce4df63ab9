"""A plug-in that ends with `sys.exit()`: no command takes its exit code for an answer, and no result is lost."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import etb_hil
from etb_hil import plugins
from etb_hil.base.errors import InputError
from etb_hil.base.outcome import ExitCode, UnitVerdict
from etb_hil.base.stock import find

MEASUREMENT = """
from etb_hil.plugins.measurements import Estimate, MeasurementKind

class OwnError(BaseException):
    pass

def compute(run):
    raise HOW
    return Estimate(1.0)

MEASUREMENT = MeasurementKind(id="mine", name="mine", unit="A", compute=compute, order=400, source="chosen")
"""
OBSERVER = """
from etb_hil.plugins.observers import ObserverKind

class Leaves:
    def push(self, time_ns, current, angle):
        raise HOW

OBSERVER = ObserverKind("it leaves", lambda model, throttle, noise: Leaves())
"""
PHASE = """
from typing import Literal
from etb_hil.plugins.phases import Held, Mode, PhaseModel, SetPoint

class Later:
    duration = 0.5

    def at(self, t):
        if t > 0.2:
            raise HOW
        return SetPoint(Mode.POSITION, 0.3)

class Mine(PhaseModel):
    kind: Literal["mine"]

    def trajectory(self, start, throttle):
        BEGIN

PHASE = Mine
"""


def _run(tmp_path, text, *words):
    (tmp_path / "mine.py").write_text(text, "utf-8")
    command = [sys.executable, "-m", "etb_hil", "run", *words, "--unit", "faulty", "--plugin", "mine.py", "--yes"]
    path = str(Path(etb_hil.__file__).parents[1])
    return subprocess.run(
        command, capture_output=True, text=True, check=False, cwd=tmp_path, env={**os.environ, "PYTHONPATH": path}
    )


@pytest.mark.parametrize("how", ["SystemExit", "SystemExit(7)", "OwnError('mine')"])
def test_a_measurement_that_exits_costs_only_itself(how, brisk, tmp_path):
    (tmp_path / "mine.py").write_text(MEASUREMENT.replace("HOW", how), "utf-8")
    plugins.load(tmp_path / "mine.py")
    run = etb_hil.run(brisk, unit="faulty", folder=tmp_path)
    assert run.verdict is UnitVerdict.FAIL
    failed = run.measurements["mine"]
    assert failed.value is None
    assert how.partition("(")[0] in failed.note
    assert (run.folder / "results.json").is_file()


def test_the_command_keeps_its_verdict_where_a_measurement_exits(tmp_path):
    done = _run(tmp_path, MEASUREMENT.replace("HOW", "SystemExit"), "friction_check")
    assert done.returncode == ExitCode.UNIT_FAILED, done.stdout + done.stderr
    assert list(tmp_path.glob("sessions/2*/results.json"))
    assert list(tmp_path.glob("sessions/2*/report.html"))


def test_an_observer_that_exits_is_a_bench_fault(tmp_path):
    done = _run(tmp_path, OBSERVER.replace("HOW", "SystemExit"), "friction_check", "--observer", "mine")
    assert done.returncode == ExitCode.BENCH_FAULT, done.stdout + done.stderr
    assert "SystemExit" in done.stdout
    assert list(tmp_path.glob("sessions/2*/results.json"))


@pytest.mark.parametrize("begin", ["raise SystemExit", "return Later()"])
def test_a_phase_that_exits_is_refused_before_anything_moves(begin, tmp_path):
    (tmp_path / "mine.py").write_text(PHASE.replace("BEGIN", begin).replace("HOW", "SystemExit"), "utf-8")
    plugins.load(tmp_path / "mine.py")
    scenario = tmp_path / "mine.yaml"
    stock = find("scenario", "friction_check").read_text("utf-8")
    scenario.write_text(f"{stock}\n  - {{kind: mine, id: mine}}\n", "utf-8")
    with pytest.raises(InputError, match=r"mine\.py: .*its trajectory failed: SystemExit"):
        etb_hil.run(scenario, folder=tmp_path / "sessions")
    assert not (tmp_path / "sessions").exists()


@pytest.mark.parametrize(
    ("point", "says"),
    [
        ("SetPoint(Mode.POSITION, 'here')", "ValueError: could not convert"),
        ("SetPoint(Mode.POSITION, float('nan'))", r"position must be a finite number \(it is nan\)"),
        ("0.3", "it returned 0.3 in place of SetPoint"),
    ],
)
def test_a_set_point_that_is_none_is_refused_before_anything_moves(point, says, tmp_path):
    text = PHASE.replace("BEGIN", "return Later()").replace("raise HOW", f"return {point}")
    (tmp_path / "mine.py").write_text(text, "utf-8")
    plugins.load(tmp_path / "mine.py")
    scenario = tmp_path / "mine.yaml"
    stock = find("scenario", "friction_check").read_text("utf-8")
    scenario.write_text(f"{stock}\n  - {{kind: mine, id: mine}}\n", "utf-8")
    with pytest.raises(InputError, match=rf"mine\.py: .*its trajectory failed: .*{says}"):
        etb_hil.run(scenario, folder=tmp_path / "sessions")


def test_a_command_that_called_code_ends_has_no_pass(tmp_path):
    """Whatever reaches the command itself: here the part of Python that the command imports."""
    (tmp_path / "threadpoolctl.py").write_text("raise SystemExit(0)", "utf-8")
    command = [sys.executable, "-m", "etb_hil", "explain", str(tmp_path / "t.csv"), "--model", "default"]
    (tmp_path / "t.csv").write_text("time_s,motor_voltage_V,throttle_angle_rad\n0,1,0\n0.001,2,0\n", "utf-8")
    path = os.pathsep.join([str(tmp_path), str(Path(etb_hil.__file__).parents[1])])
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, cwd=tmp_path, env={**os.environ, "PYTHONPATH": path}
    )
    assert done.returncode == ExitCode.BAD_INPUT, done.stderr
    assert "`etb-hil explain` was ended by sys.exit(0)" in done.stderr
