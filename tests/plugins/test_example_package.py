"""The example package, installed into a fresh virtual environment: each of its parts does its work there."""

import json
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np
import pytest
import yaml
from independent_throttle import Unit, friction_check, sense
from throttle_as_model import bench_model

import etb_hil as etb
from etb_hil.base.stock import find
from etb_hil.canio.logs.reading import read_log
from etb_hil.plant.parameters import load_model

pytestmark = pytest.mark.slow

NUDGES = "  - {kind: nudges, id: nudging, between: [20 deg, 40 deg], size: 5 deg, hold: 0.2 s}\n"
LIMITS = """\
schema: etb_hil/limits/2
part_number: A-1
revision: "2"
limits:
  nudge_current: {max: 10 A, source: chosen}
marginal_band: 3 %
"""
ROOT = Path(etb.__file__).resolve().parents[1]
EXAMPLE = Path(__file__).resolve().parents[2] / "docs" / "examples" / "plugin"


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Return what runs Python in an environment that has the example, and what this environment has besides."""
    folder = tmp_path_factory.mktemp("environment")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)
    python = folder / "bin" / "python"
    (packages,) = (folder / "lib").glob("python*/site-packages")
    paths = [sysconfig.get_paths()["purelib"], str(ROOT)]
    (packages / "outer.pth").write_text("".join(f"import site; site.addsitedir({path!r})\n" for path in paths))
    source = shutil.copytree(EXAMPLE, folder / "source")
    pip = [sys.executable, "-m", "pip", "--python", python, "install", "-q", "--no-deps", "--no-build-isolation"]
    subprocess.run([*pip, "--no-index", "--disable-pip-version-check", source], check=True)

    def run(*words, cwd, code=0):
        done = subprocess.run([python, *words], capture_output=True, text=True, check=False, cwd=cwd)
        assert done.returncode == code, done.stdout + done.stderr
        return done.stdout

    return run


@pytest.fixture(scope="module")
def judged(installed, tmp_path_factory):
    """Return the folder in which a scenario with the package's phase was run, by its law, observer and measurement."""
    folder = tmp_path_factory.mktemp("judged")
    stock = find("scenario", "friction_check").read_text("utf-8")
    (folder / "nudging.yaml").write_text(f"{stock}\n{NUDGES}", "utf-8")
    bench = yaml.safe_load(find("bench", "virtual_classic").read_text("utf-8"))
    (folder / "bench.yaml").write_text(yaml.safe_dump({**bench, "law": "soft-pd"}, sort_keys=False), "utf-8")
    (folder / "limits.yaml").write_text(LIMITS, "utf-8")
    words = "run nudging.yaml --bench bench.yaml --limits limits.yaml --serial A1 --junit junit.xml --yes"
    installed("-m", "etb_hil", *words.split(" "), cwd=folder)
    return folder


def _session(folder):
    (session,) = (folder / "sessions").glob("*/session.json")
    return session.parent


def test_its_phase_runs_and_its_measurement_is_in_report_junit_and_history(installed, judged):
    results = json.loads((_session(judged) / "results.json").read_text("utf-8"))
    assert results["phases"][-1]["id"] == "nudging"
    (measured,) = [one for one in results["measurements"] if one["id"] == "nudge_current"]
    assert measured["verdict"] == "pass"
    assert "largest current of the nudges" in (_session(judged) / "report.html").read_text("utf-8")
    assert '<testcase name="nudge_current"' in (judged / "junit.xml").read_text("utf-8")
    installed("-m", "etb_hil", "history", "sessions", "--out", "history", cwd=judged)
    assert "nudge_current" in (judged / "history" / "history.csv").read_text("utf-8")


def test_results_name_the_package_with_version_and_hash_and_a_replay_without_it_misses_it(installed, judged):
    (plugin,) = json.loads((_session(judged) / "results.json").read_text("utf-8"))["plugins"]
    assert (plugin["name"], plugin["version"], len(plugin["sha256"])) == ("throttle-extras", "1.0", 64)
    assert len(plugin["parts"]) == 7
    assert "bit for bit" in installed("-m", "etb_hil", "replay", _session(judged), cwd=judged)
    with pytest.raises(etb.InputError, match=r"the plug-in throttle-extras 1\.0 took part in the run and is not here"):
        etb.Run.open(_session(judged))


@pytest.mark.study
def test_its_observer_is_chosen_by_name(installed, judged):
    words = ["replay", _session(judged), "--observer", "differences"]
    assert "break-away friction, live" in installed("-m", "etb_hil", *words, cwd=judged)  # which changed


@pytest.mark.study
def test_its_reader_opens_a_log(installed, judged):
    with (judged / "drive.frames").open("w") as file:
        for block in read_log(_session(judged) / "raw.blf"):
            for k in range(len(block)):
                data = block.data[k, : block.length[k]].tobytes().hex()
                file.write(json.dumps({"t": block.stamp_ns[k] * 1e-9, "id": int(block.ident[k]), "data": data}) + "\n")
    words = ["plot", "drive.frames", "--bench", "bench.yaml", "--out", "drive.png"]
    installed("-m", "etb_hil", *words, cwd=judged)
    assert (judged / "drive.png").stat().st_size > 10_000


def test_its_effect_is_simulated(installed, tmp_path):
    stock, heavy = find("model", "default").read_text("utf-8"), "{id: gravity_torque, strengths: {moment: 0.06 N·m}}"
    assert "\neffects: []" in stock
    (tmp_path / "heavy.yaml").write_text(stock.replace("\neffects: []", f"\neffects: [{heavy}]"), "utf-8")
    angles = []
    for unit in ("default", "heavy.yaml"):
        words = ["simulate", "paper_step", "--unit", unit, "--out", "simulated.csv"]
        installed("-m", "etb_hil", *words, cwd=tmp_path)
        angles.append((tmp_path / "simulated.csv").read_text("utf-8"))
    assert angles[0] != angles[1]
    with pytest.raises(etb.InputError, match="gravity_torque"):
        load_model(tmp_path / "heavy.yaml")


@pytest.mark.study
def test_its_effect_is_simulated_and_named_in_data_of_another_simulation(installed, tmp_path):
    unit = Unit(weight=0.06, weight_angle=0.3)
    truth, _ = friction_check(unit)
    seen = sense(unit, truth, 1000, np.random.default_rng(5), current_offset=0.0)
    columns = {
        "time_s": seen.time_ns * 1e-9,
        "motor_voltage_V": seen.voltage,
        "motor_current_A": seen.current,
        "motor_angle_rad": seen.motor_angle,
        "throttle_angle_rad": seen.throttle_angle,
    }
    table = np.column_stack([*columns.values()])
    np.savetxt(tmp_path / "measured.csv", table, "%.9g", ",", header=",".join(columns), comments="")
    bench_model(Unit()).write(tmp_path / "model.yaml")
    words = ["explain", "measured.csv", "--model", "model.yaml", "--out", "answer"]
    installed("-m", "etb_hil", *words, cwd=tmp_path)
    answer = json.loads((tmp_path / "answer" / "explanation.json").read_text("utf-8"))
    (cause,) = answer["causes"]
    assert cause["id"] == "gravity_torque"
    assert cause["parameters"]["moment"]["value"] == pytest.approx(0.06, rel=0.2)
    words = ["simulate", "friction_check", "--unit", "answer/model.yaml", "--out", "simulated.csv"]
    installed("-m", "etb_hil", *words, cwd=tmp_path)
    assert "gravity_torque" in (tmp_path / "answer" / "model.yaml").read_text("utf-8")
    with pytest.raises(etb.InputError, match="gravity_torque"):
        load_model(tmp_path / "answer" / "model.yaml")


@pytest.mark.study
def test_the_package_keeps_the_contracts_by_its_own_tests(installed):
    environment = EXAMPLE / "test_parts.py"
    installed("-m", "pytest", "-q", "-p", "no:cacheprovider", environment, cwd=EXAMPLE)
