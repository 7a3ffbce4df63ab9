"""The example project, copied and run as its README says, and what the pytest plugin makes of benches that fail."""

import os
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

pytest_plugins = "pytester"

EXAMPLE = Path(__file__).resolve().parents[2] / "docs" / "examples" / "ci"


def test_the_example_project_runs_as_it_is_copied(tmp_path):
    folder = shutil.copytree(EXAMPLE, tmp_path / "ci")
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTEST", "COV"))}
    environment["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{environment['PATH']}"
    done = subprocess.run([folder / "pipeline.sh"], capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Baseline all 8 expectations met" in done.stdout
    (run,) = ET.parse(folder / "run.xml").getroot()  # noqa: S314 (our own)
    assert (run.get("failures"), run.get("errors")) == ("0", "0")
    assert "baseline T_st" in {case.get("name") for case in run.iter("testcase")}
    (tests,) = ET.parse(folder / "tests.xml").getroot()  # noqa: S314
    assert (tests.get("tests"), tests.get("failures"), tests.get("errors"), tests.get("skipped")) == (
        "3",
        "0",
        "0",
        "0",
    )
    told = {entry.get("name"): entry.get("value") for entry in tests.iter("property")}
    assert {"T_st", "bus_load_peak", "seed", "session"} <= told.keys()
    assert len(list(folder.glob("sessions/*/results.json"))) == 5  # one of the command, four of the tests


SICK = """
import pytest
from dataclasses import replace
from pathlib import Path
from etb_hil.base.outcome import BenchOutcome
from etb_hil.pytest_plugin import BenchRun, _properties
from etb_hil.results.measurement import Measurement, Measurements
from etb_hil.results.run_result import Bench, Bus, MessageStatistics, RunResult, Unit

def run_with(**bus):
    bench = Bench(BenchOutcome.OK, safe_state=True)
    return BenchRun(RunResult("r", Unit("pass"), bench, bus=Bus(**bus)), Path("session"))

def test_sick(etb_bench):
    messages = (MessageStatistics("Current", 9, lost=3, crc_failures=1),)
    etb_bench.runs.append(run_with(state="bus-off", error_frames=7, messages=messages))

def test_healthy_or_unknown(etb_bench):
    etb_bench.runs.append(run_with(state=None, error_frames=None, messages=(MessageStatistics("Current", 9),)))

def test_numbers_by_name(etb_bench):
    with pytest.raises(LookupError, match="has no number 'T_xy'"):
        run_with().number("T_xy")
    bound = Measurement("T_c", "sliding friction", None, "N·m", 0.0, 0.15, limit_high=0.2, verdict="pass")
    unknown = Measurement("T_st", "break-away friction", None, "N·m")
    results = replace(run_with().results, measurements=Measurements([bound, unknown]))
    with pytest.raises(LookupError, match="'T_c' was not measured in this run: it is known to be at most 0.150 N·m"):
        BenchRun(results, Path("session")).value("T_c")
    with pytest.raises(LookupError, match="'T_st' was not measured in this run$"):
        BenchRun(results, Path("session")).value("T_st")
    assert ("T_c", "at most 0.150 N·m") in _properties(BenchRun(results, Path("session")))

@pytest.mark.etb_scenario("friction_check", colour="red")
def test_unknown_setting(etb_run):
    pass
"""


def test_a_sick_bus_is_an_error_after_the_test_and_no_failure(pytester):
    pytester.makepyfile(SICK)
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider")
    result.assert_outcomes(passed=3, errors=2)
    said = result.stdout.str()
    assert "the bus was not healthy: session: 7 error frames, 3 frames of Current lost, 1 bad CRC in Current" in said
    assert ", the interface is bus-off" in said
    assert "etb-hil knows no colour of a run" in said


FAULT = """
import pytest
from etb_hil.base.errors import BenchFault

@pytest.mark.etb_scenario("held.yaml")
def test_never_judged(etb_run):
    raise AssertionError("the bench had failed")
"""
HELD = """schema: etb_hil/scenario/1
name: held
supply: [1 V, 2 V]
phases:
  - {id: zero, kind: current_zero, duration: 0.3 s}
  - {id: held, kind: hold, position: 30 deg, duration: 1 s}
"""


def test_a_bench_that_fails_before_the_test_is_an_error(pytester):
    pytester.makepyfile(FAULT)
    pytester.path.joinpath("held.yaml").write_text(HELD)
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider", "--etb-bench", "virtual_fd")
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["*outside 1 to 2 V*"])


def test_the_plugin_loads_nothing_heavy():
    loaded = "import sys, pytest, etb_hil.pytest_plugin; print(*sys.modules)"
    names = subprocess.run([sys.executable, "-c", loaded], capture_output=True, text=True, check=True).stdout.split()
    assert not {"numpy", "numba", "can", "cantools", "pydantic", "yaml", "matplotlib"} & set(names)
