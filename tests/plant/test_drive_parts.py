"""A drive's file made of parts: each drive, load and stop, and what does not go together."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from etb_hil.base.errors import InputError
from etb_hil.discrepancy.explain import explain
from etb_hil.plant.device import Driven
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import spring_torque, stop_torque
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import SampleBlock

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
FILES = sorted(EXAMPLES.glob("*.drive.yaml"))
STOPS = {
    "low": {"value": "-2 rad", "tolerance": "1 deg", "source": "drawn"},
    "high": {"value": "2.5 rad", "tolerance": "1 deg", "source": "drawn"},
    "stiffness": {"value": "50 N·m/rad", "tolerance": "50 %", "source": "chosen"},
    "damping": {"value": "0.1 N·m·s/rad", "tolerance": "50 %", "source": "chosen"},
}
SPRING = {
    "stiffness": {"value": "0.3 N·m/rad", "tolerance": "10 %", "source": "chosen"},
    "rest": {"value": "20 deg", "tolerance": "2 deg", "source": "chosen"},
}


def read(folder, name="pendulum", **changes):
    """Read an example with some of its parts changed, without those that are None."""
    content = yaml.safe_load((EXAMPLES / f"{name}.drive.yaml").read_text("utf-8"))
    content = {key: value for key, value in {**content, **changes}.items() if value is not None}
    path = folder / "drive.yaml"
    path.write_text(yaml.safe_dump(content, allow_unicode=True), "utf-8")
    return Model.load(path)


def refused(folder, name="pendulum", **changes):
    with pytest.raises(InputError) as caught:
        read(folder, name, **changes)
    (problem,) = caught.value.problems
    return problem


@pytest.mark.parametrize("path", FILES, ids=[path.name for path in FILES])
def test_every_example_is_read_back_from_what_it_writes(tmp_path, path):
    model = Model.load(path)
    model.write(tmp_path / "again.yaml")
    again = Model.load(tmp_path / "again.yaml")
    np.testing.assert_allclose(again.vector(), model.vector(), rtol=1e-8)
    assert (again.device, again.sensors) == (model.device, model.sensors)
    for name, parameter in model.parameters.items():
        assert again.parameters[name].half_width == pytest.approx(parameter.half_width, rel=1e-8), name


def test_stops_and_a_spring_are_read_back_and_act(tmp_path):
    model = read(tmp_path, load={"spring": SPRING}, stops=STOPS)
    assert model.device.has_spring
    assert model.device.has_stops
    model.write(tmp_path / "again.yaml")
    p = tuple(Model.load(tmp_path / "again.yaml").values.vector())
    for angle in (-1.9, 0.0, 2.4):
        assert spring_torque(angle, p) == pytest.approx(0.3 * (angle - np.radians(20.0)), abs=1e-6)
        assert stop_torque(angle, 0.0, p) == 0.0
    assert stop_torque(2.51, 0.0, p) == pytest.approx(0.5)
    assert stop_torque(-2.01, 0.0, p) == pytest.approx(-0.5)


def test_the_damping_of_bristles_is_stated_and_read_back(tmp_path):
    friction = yaml.safe_load((EXAMPLES / "pendulum.drive.yaml").read_text("utf-8"))["friction"]
    damping = {"value": "0.1 N·m·s/rad", "tolerance": "50 %", "source": "chosen"}
    model = read(tmp_path, friction={**friction, "bristle_damping": damping})
    assert read(tmp_path).values.bristle_damping == 0.0
    assert model.values.bristle_damping == pytest.approx(0.1)
    model.write(tmp_path / "again.yaml")
    again = Model.load(tmp_path / "again.yaml").parameters["bristle_damping"]
    assert (again.value, again.half_width) == pytest.approx((0.1, 0.05))
    problem = refused(tmp_path, friction={**friction, "bristle_damping": {**damping, "value": "-1 N·m·s/rad"}})
    assert (problem.place.key, problem.what) == ("friction.bristle_damping.value", "out of range")


def test_gravity_pulls_to_where_the_mass_hangs(tmp_path):
    model = read(tmp_path, load={"gravity": {"torque": "0.7 N·m", "hangs_at": "30 deg"}})
    (entry,) = model.effects
    (torque,) = CATALOGUE[entry.id].at(*CATALOGUE[entry.id].terms)
    sizes = [float(str(entry.strengths[name]).split()[0]) for name in ("sine", "cosine")]
    angles = np.radians([30.0, 120.0, -60.0, 75.0])
    np.testing.assert_allclose(
        [torque(one, *sizes) for one in angles], 0.7 * np.sin(angles - np.radians(30.0)), atol=1e-8
    )


@pytest.mark.parametrize(
    ("name", "driven", "values"),
    [
        ("dc_motor", Driven.VOLTAGE, (4.0, 1e-3, 0.043, 0.043)),
        ("brushless", Driven.CURRENT, (1.0, 1e-7, 0.036, 0.0)),
        ("emps", Driven.FORCE, (1.0, 1e-7, 1.0, 0.0)),
    ],
)
def test_what_drives_it_is_its_winding(name, driven, values):
    model = Model.load(EXAMPLES / f"{name}.drive.yaml")
    assert model.device.driven is driven
    v = model.values
    assert (v.resistance, v.inductance, v.torque_per_ampere, v.back_emf) == pytest.approx(values)


@pytest.mark.parametrize(
    ("changes", "key", "says"),
    [
        ({"driven_by": {}}, "driven_by", "driven by one thing"),
        ({"driven_by": {"torque": {"noise": "1 mN·m"}, "force": {"noise": "1 N"}}}, "driven_by", "driven by one thing"),
        ({"driven_by": {"force": {"noise": "1 N"}}}, "driven_by", "driven by one thing"),
        ({"stops": {**STOPS, "low": {**STOPS["high"]}}}, "stops.low.value", "no way between"),
        ({"position_step": "2 rad"}, "position_step", "out of range"),
        ({"load": {"gravity": {"torque": "-1 N·m", "hangs_at": "0 deg"}}}, "load.gravity.torque", "out of range"),
        ({"load": {"gravity": {"torque": "1 N", "hangs_at": "0 deg"}}}, "load.gravity.torque", "unit"),
        ({"load": {"spring": SPRING, "constant": SPRING["stiffness"] | {"value": "1 N·m"}}}, "load.constant", "rest"),
    ],
)
def test_what_does_not_go_together_is_refused_with_its_key(tmp_path, changes, key, says):
    problem = refused(tmp_path, **changes)
    assert problem.place.key == key
    assert problem.place.line
    assert says in problem.what


def test_no_gravity_turns_a_linear_axis(tmp_path):
    problem = refused(tmp_path, "emps", load={"gravity": {"torque": "1 N", "hangs_at": "0 m"}})
    assert problem.place.key == "load.gravity"
    assert "vertical axis" in problem.allowed


def recording(**columns):
    time_ns = np.arange(4000, dtype=np.int64) * 1_000_000
    found = Recording("made up", ClockGrade.TABLE)
    found.append([SampleBlock("table", time_ns, time_ns, columns, np.zeros(len(time_ns), np.int64))])
    return found


WAY = np.sin(np.arange(4000) / 200.0)


def test_a_current_whose_noise_nobody_stated_is_refused():
    motor = Model.load(EXAMPLES / "dc_motor.drive.yaml")
    answer = explain([recording(motor_voltage=WAY, motor_current=WAY, motor_angle=WAY)], motor).explanation
    assert answer.verdict == "insufficient_data"
    assert any("driven_by.voltage.current_noise" in str(one) for one in answer.data_quality)


@pytest.mark.parametrize(
    ("name", "columns"),
    [
        ("dc_motor", ("motor_voltage", "linear_position")),
        ("dc_motor", ("motor_voltage", "motor_angle", "throttle_angle")),
        ("brushless", ("motor_voltage", "motor_angle")),
        ("pendulum", ("motor_current", "drive_angle")),
        ("emps", ("drive_torque", "drive_angle")),
    ],
)
def test_a_record_of_another_machine_is_refused(name, columns):
    with pytest.raises(InputError, match="is not measured on a"):
        explain([recording(**dict.fromkeys(columns, WAY))], Model.load(EXAMPLES / f"{name}.drive.yaml"))
