"""`etb-hil simulate`: tables that are read back, and that agree with the plant driven directly."""

import numpy as np
import pytest

from etb_hil.base.stock import find
from etb_hil.cli.main import main
from etb_hil.plant.integrator import CURRENT, THETA, advance_record, new_state
from etb_hil.plant.parameters import load_model
from etb_hil.recording.tables import read_table

MODEL = load_model(find("model", "default"))


def simulated(tmp_path, *words, name="out.csv"):
    out = tmp_path / name
    assert main(["simulate", *words, "--out", str(out)]) == 0
    return out


def test_a_scenario_becomes_a_table_with_roles_as_columns(tmp_path):
    recording = read_table(simulated(tmp_path, "reversals_at_limp_home", "--rate", "2 kHz"))
    current, angle = recording.series("motor_current"), recording.series("throttle_angle")
    assert np.all(np.diff(current.time_ns) == 500_000)
    wanted = recording.series("command_position").values
    driven = np.isfinite(wanted) & (np.abs(np.gradient(np.nan_to_num(wanted))) < 1e-4)
    assert np.median(np.abs(angle.values[driven] - wanted[driven])) < np.radians(1.0)
    assert 0.1 < np.max(np.abs(current.values)) < 8.0


def test_conditions_end_phases_and_prompts_are_passed_over(tmp_path):
    scenario = tmp_path / "s.yaml"
    scenario.write_text(
        "schema: etb_hil/scenario/1\nname: s\nphases:\n- {id: ask, kind: prompt, text: Ready}\n"
        "- {id: up, kind: ramp, between: [10 deg, 70 deg], speed: 1 rad/s,"
        " until: {role: throttle_angle, rises_above: 40 deg}}\n"
    )
    angle = read_table(simulated(tmp_path, str(scenario))).series("throttle_angle").values
    assert np.degrees(angle[-1]) == pytest.approx(40.0, abs=1.0)
    scenario.write_text(scenario.read_text().replace("40 deg", "80 deg"))
    assert main(["simulate", str(scenario), "--out", str(tmp_path / "never.csv")]) == 2
    assert not (tmp_path / "never.csv").exists()


def test_a_recorded_voltage_drives_the_plant_alone(tmp_path):
    voltage = np.repeat(np.linspace(0.0, 6.0, 40), 5)
    table = tmp_path / "v.csv"
    rows = "".join(f"{index * 0.001:.3f},{value:.9g}\n" for index, value in enumerate(voltage))
    table.write_text("time_s,motor_voltage_V\n" + rows)
    found = read_table(simulated(tmp_path, "--voltage", str(table), "--start-angle", "20 deg"))
    state, record = new_state(np.radians(20)), np.empty((20 * len(voltage), 4))
    advance_record(state, MODEL.values_at(20.0).vector(), voltage, 20, record)
    at = 20 * np.arange(1, len(voltage)) - 1
    assert found.series("throttle_angle").values[1:] == pytest.approx(record[at, THETA], rel=1e-8)
    assert found.series("motor_current").values[1:] == pytest.approx(record[at, CURRENT], rel=1e-8, abs=1e-12)
    assert np.degrees(found.series("throttle_angle").values[-1]) > 30


def test_parquet_holds_the_same(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    words = ("reversals_at_limp_home", "--law", "pid", "--unit", "dv_e5", "--model", "dv_e5")
    table = parquet.read_table(simulated(tmp_path, *words, name="out.parquet")).to_pydict()
    csv = read_table(simulated(tmp_path, *words))
    assert table["motor_current_A"] == pytest.approx(csv.series("motor_current").values, abs=1e-8)
    assert table["time_s"] == pytest.approx(csv.series("motor_current").time_ns * 1e-9)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--out", "x.xlsx"), "no table that can be written"),
        (("friction_check", "--voltage", "v.csv"), "give one of them"),
        (("--law", "magic"), "pd, pid, sliding-mode"),
        (("--rate", "1"), "--rate"),
        (("--voltage", "gap.csv"), "value missing"),
        (("--out", "/no/such/folder/x.csv", "paper_step"), "cannot be written"),
    ],
)
def test_bad_input_is_named(tmp_path, monkeypatch, capsys, words, told):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "gap.csv").write_text("time_s,motor_voltage_V\n0,1\n0.001,\n0.002,1\n")
    assert main(["simulate", *words]) == 2
    assert told in capsys.readouterr().err
