"""`etb-hil simulate`: tables that are read back, and that agree with the plant driven directly."""

import numpy as np
import pytest

from etb_hil.base.stock import find
from etb_hil.bench import simulation
from etb_hil.cli.main import main
from etb_hil.plant.integrator import CURRENT, THETA, advance_record, new_state
from etb_hil.plant.parameters import load_model
from etb_hil.recording.tables import read_table

MODEL = load_model(find("model", "default"))


SUPPLIED = """schema: etb_hil/scenario/1
name: Supplied
supply: [{}]
phases:
  - {{id: zero, kind: current_zero, duration: 0.3 s}}
  - {{id: held, kind: hold, position: 12 deg, duration: 0.2 s}}
"""


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


def test_the_housings_temperature_is_told(tmp_path):
    """By it `explain` obeys what a model file states of the resistance over the temperature."""
    temperature = read_table(simulated(tmp_path, "friction_check")).series("temperature").values
    assert temperature[0] == pytest.approx(20.0, abs=0.01)
    assert np.all(np.diff(temperature) > -1e-3)
    assert 20.01 < temperature[-1] < 25.0


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
    assert np.all(found.series("temperature").values == 20.0)


def test_a_recorded_voltages_temperature_is_the_housings(tmp_path):
    table = tmp_path / "v.csv"
    rows = [(0.001 * k, 3.0, "" if k in (0, 7) else 40.0 + 0.5 * k) for k in range(80)]
    head = "time_s,motor_voltage_V,temperature_degC\n"
    table.write_text(head + "".join(f"{t:.3f},{v},{degrees}\n" for t, v, degrees in rows))
    warm = read_table(simulated(tmp_path, "--voltage", str(table)))
    degrees = warm.series("temperature").values
    assert degrees == pytest.approx(40.0 + 0.5 * np.maximum(np.arange(80), 1))
    table.write_text("time_s,motor_voltage_V\n" + "".join(f"{t:.3f},{v}\n" for t, v, _ in rows))
    cold = read_table(simulated(tmp_path, "--voltage", str(table)))
    assert np.all(cold.series("temperature").values == 20.0)
    apart = [table.series("motor_current").values[:12].max() for table in (warm, cold)]
    assert apart[0] < 0.97 * apart[1]  # before the plate moves


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
        (("--out", "x.xlsx"), "must have a suffix of a table"),
        (("friction_check", "--voltage", "v.csv"), "give one of them"),
        (("--law", "magic"), "pd, pid, sliding-mode"),
        (("--rate", "1"), "--rate"),
        (("--rate", "0 Hz"), "--rate: no rate of samples (it is '0 Hz'); allowed: 1 Hz to 20 kHz"),
        (("--rate", "1 kHz", "supply.yaml"), "a bench would stop in 'held': supply at 13.5"),
        (("long.yaml",), "takes too long; allowed: up to 3600 s at this rate"),
        (("long.yaml", "--rate", "20 kHz"), "takes too long; allowed: up to 1000 s at this rate"),
        (("--voltage", "gap.csv"), "value missing"),
        (("--voltage", "angle.csv"), "angle.csv: the first throttle_angle is missing; give --start-angle"),
        (("--voltage", "angle.csv", "--start-angle", "100 deg"), "beyond the model's stops"),
        (("--out", "/no/such/folder/x.csv", "paper_step"), "cannot be written"),
    ],
)
def test_bad_input_is_named(tmp_path, monkeypatch, capsys, words, told):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "gap.csv").write_text("time_s,motor_voltage_V\n0,1\n0.001,\n0.002,1\n")
    (tmp_path / "angle.csv").write_text("time_s,motor_voltage_V,throttle_angle_deg\n0,1,nan\n0.001,1,8\n0.002,1,8\n")
    (tmp_path / "supply.yaml").write_text(SUPPLIED.format("20 V, 30 V"))
    (tmp_path / "long.yaml").write_text(SUPPLIED.format("10 V, 18 V").replace("0.2 s", "1000 h"))
    assert main(["simulate", *words]) == 2
    assert told in capsys.readouterr().err
    assert not (tmp_path / "simulation.csv").exists()


def test_a_simulation_that_waits_for_too_long_ends(tmp_path, monkeypatch):
    monkeypatch.setattr(simulation, "LONGEST_S", 2.0)
    scenario = tmp_path / "s.yaml"
    waits = "- {id: w, kind: wait, timeout: 9 h, until: {role: throttle_angle, above: 80 deg}}\n"
    scenario.write_text(f"schema: etb_hil/scenario/1\nname: s\nphases:\n{waits}")
    assert main(["simulate", str(scenario), "--out", str(tmp_path / "never.csv")]) == 2


def test_a_supply_inside_the_scenarios_window_ends_nothing(tmp_path):
    scenario = tmp_path / "supply.yaml"
    scenario.write_text(SUPPLIED.format("10 V, 18 V"))
    times = read_table(simulated(tmp_path, str(scenario))).series("motor_current").time_ns
    assert times[-1] * 1e-9 > 0.5
