"""Drive files: what cannot be is refused with its place, and a drive is never taken for a throttle."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.cli.main import main
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limits_file import load_limits
from etb_hil.discrepancy.answer.drive_names import as_in_its_file
from etb_hil.discrepancy.answer.quality import _other_unit
from etb_hil.discrepancy.explain import explain
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.plant.drive_file import load_plant
from etb_hil.plant.drive_text import drive_text
from etb_hil.plant.model_file import EffectEntry
from etb_hil.plant.parameters import load_model
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import SampleBlock
from etb_hil.results.explained.causes import Cause
from etb_hil.results.explained.models import CalibratedParameter
from etb_hil.results.explanation import ExplanationResult

EXAMPLE = Path(__file__).parent / "flat.drive.yaml"
SESSION = Path(__file__).parents[1] / "releases" / "0.1.0" / "session"
ENTRIES = {"inertia": "kg", "viscous": "N·s/m", "coulomb": "N", "constant_load": "N"}
LENGTHS = {
    "presliding": "m",
    "settled_speed": "m/s",
    "travel_per_turn": "m",
    "position_step": "m",
    "drive_noise": "N",
}


def changed(folder, key, text):
    """Write the example with another value of a key, and return the path and the key's line."""
    lines = EXAMPLE.read_text("utf-8").splitlines()
    (at,) = (index for index, line in enumerate(lines) if line.startswith(f"{key}:"))
    lines[at] = re.sub(r"value: [^,]*", f"value: {text}", lines[at]) if key in ENTRIES else f"{key}: {text}"
    path = folder / "changed.drive.yaml"
    path.write_text("\n".join(lines), "utf-8")
    return path, at + 1


def test_an_answer_calls_parameters_as_the_drives_file_does():
    """What a throttle's model file calls a preload is a drive's constant load; a throttle keeps its names."""
    cause = Cause("parameter:motor_inertia", 0.5, ("parameter:preload_open", "iron_loss"), {}, 1.0)
    load = CalibratedParameter("N·m", nominal=0.9, value=1.0, interval=None, tolerance=0.3)
    answer = ExplanationResult(
        "ambiguous", causes=(cause,), calibrated={"preload_open": load}, interrupted="trying parameter:preload_open"
    )
    drives = as_in_its_file(answer, load_plant(EXAMPLE))
    assert [(one.id, one.not_isolable_from) for one in drives.causes] == [
        ("parameter:inertia", ("parameter:constant_load", "iron_loss"))
    ]
    assert drives.calibrated == {"constant_load": load}
    assert drives.interrupted == "trying parameter:constant_load"
    assert as_in_its_file(answer, load_model(find("model", "default"))) == answer


def refused(path):
    with pytest.raises(InputError) as caught:
        load_plant(path)
    (problem,) = caught.value.problems
    return problem


def _recording(**columns):
    time_ns = np.arange(4000, dtype=np.int64) * 1_000_000
    recording = Recording("made up", ClockGrade.TABLE)
    recording.append([SampleBlock("table", time_ns, time_ns, columns, np.zeros(len(time_ns), np.int64))])
    return recording


IMPOSSIBLE = [(key, number) for key in {**ENTRIES, **LENGTHS} for number in ("-1", "0", "1e308", "-1e308")]
POSSIBLE = {("viscous", "0"), ("constant_load", "0"), ("constant_load", "-1")}


@pytest.mark.parametrize(("key", "number"), [case for case in IMPOSSIBLE if case not in POSSIBLE])
def test_what_no_drive_can_have_is_refused_with_place_value_and_range(tmp_path, key, number):
    unit = {**ENTRIES, **LENGTHS}[key]
    path, line = changed(tmp_path, key, f"{number} {unit}")
    problem = refused(path)
    assert problem.place.file == path
    assert problem.place.line == line
    assert problem.place.key == (f"{key}.value" if key in ENTRIES else key)
    assert problem.value == f"{number} {unit}"
    assert problem.allowed.endswith(f" {unit}")
    assert problem.remedy


@pytest.mark.parametrize(("key", "number"), sorted(POSSIBLE))
def test_no_damping_and_a_load_either_way_are_drives(tmp_path, key, number):
    model = load_plant(changed(tmp_path, key, f"{number} {ENTRIES[key]}")[0])
    name = {"viscous": "viscous", "constant_load": "preload_open"}[key]
    assert model.parameters[name].value == float(number)


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(sorted({**ENTRIES, **LENGTHS})), st.floats(allow_nan=False, allow_infinity=False).map("{:g}".format)
)
def test_a_drive_file_gives_a_finite_model_or_is_refused(tmp_path_factory, key, number):
    path, _ = changed(tmp_path_factory.mktemp("drive"), key, f"{number} {({**ENTRIES, **LENGTHS})[key]}")
    try:
        model = load_plant(path)
    except InputError:
        return
    assert np.isfinite(model.vector()).all()
    assert model.sensors.motor_counts_per_turn >= 4


def test_a_position_step_longer_than_a_quarter_turn_is_refused(tmp_path):
    problem = refused(changed(tmp_path, "position_step", "1 mm")[0])
    assert problem.place.key == "position_step"
    assert problem.allowed == "up to 0.000625 m, a quarter of travel_per_turn"


@pytest.mark.parametrize(("tolerance", "allowed"), [("-30 %", "0 to 1000 %"), ("-1 kg", "0 to 1e+06 kg")])
def test_a_negative_tolerance_is_refused(tmp_path, tolerance, allowed):
    path = tmp_path / "drive.yaml"
    path.write_text(EXAMPLE.read_text("utf-8").replace("90 kg, tolerance: 30 %", f"90 kg, tolerance: {tolerance}"))
    problem = refused(path)
    assert problem.place.key == "inertia.tolerance"
    assert problem.allowed == allowed


@pytest.mark.parametrize("schema", ["etb_hil/drive/1", "'etb_hil/drive/1'", '"etb_hil/drive/1"   # a drive'])
def test_the_schema_is_found_however_it_is_written(tmp_path, schema):
    path = tmp_path / "drive.yaml"
    path.write_text(EXAMPLE.read_text("utf-8").replace("schema: etb_hil/drive/1", f"schema: {schema}"))
    model = load_plant(path)
    assert not model.device.is_throttle


def test_another_version_of_the_drive_file_is_told_which_one_is_read(tmp_path):
    path = tmp_path / "drive.yaml"
    path.write_text(EXAMPLE.read_text("utf-8").replace("etb_hil/drive/1", "etb_hil/drive/9"))
    assert refused(path).allowed == "etb_hil/drive/2, etb_hil/drive/1"


@pytest.mark.parametrize(
    "content",
    [
        "schema: etb_hil/drive/1\nname: Drosselklappe für Prüfstand\n".encode("latin-1"),
        EXAMPLE.read_text("utf-8").encode("utf-16"),
        bytes(range(256)),
    ],
    ids=["latin-1", "utf-16", "binary"],
)
def test_a_model_that_is_no_utf8_is_refused_and_no_traceback(tmp_path, capsys, content):
    path = tmp_path / "model.yaml"
    path.write_bytes(content)
    assert main(["explain", str(SESSION), "--model", str(path), "--out", str(tmp_path / "out")]) == 2
    assert "is not UTF-8 text; save it as UTF-8" in capsys.readouterr().err


def test_a_drives_model_is_refused_for_a_throttles_session(tmp_path, capsys):
    assert main(["explain", str(SESSION), "--model", str(EXAMPLE), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert "the model 'EMPS' is one's" in said
    assert "--model default" in said
    assert not (tmp_path / "out").exists()


def test_a_throttles_model_is_refused_for_a_drives_recording():
    throttle = load_model(find("model", "default"))
    assert throttle.device.is_throttle
    with pytest.raises(InputError, match=r"made up is measured on a drive.*etb_hil/drive/2"):
        explain([_recording(drive_force=np.zeros(4000), linear_position=np.zeros(4000))], throttle)


ROTARY = {"kg,": "kg·m²,", "N·s/m": "N·m·s/rad", "N,": "N·m,", "N\n": "N·m\n", "m/s": "rad/s", "mm": "mrad"}


@pytest.fixture
def rotary(tmp_path):
    """Write the example as a rotary drive of the same numbers."""
    text = EXAMPLE.read_text("utf-8").replace("motion: linear", "motion: rotary")
    head, values = text.split("inertia:", 1)
    for old, new in ROTARY.items():
        values = re.sub(rf"(?<=\d ){re.escape(old)}", new, values)
    path = tmp_path / "rotary.drive.yaml"
    path.write_text(f"{head}inertia:{values}", "utf-8")
    return path


def test_friction_that_breaks_away_is_that_of_sliding_unless_it_is_stated(tmp_path):
    model = load_plant(EXAMPLE)
    assert (model.values.stiction, model.tolerance("stiction")) == (20.0, pytest.approx(12.0))
    path = tmp_path / "drive.yaml"
    path.write_text(
        EXAMPLE.read_text("utf-8") + "stiction: {value: 28 N, tolerance: 2 N, source: spring balance}\n", "utf-8"
    )
    model = load_plant(path)
    assert (model.values.stiction, model.tolerance("stiction")) == (28.0, 2.0)
    again = tmp_path / "again.yaml"
    again.write_text(drive_text(model, "as written"), "utf-8")
    assert load_plant(again).parameters["stiction"] == model.parameters["stiction"]


def test_what_nobody_knows_of_a_bristle_has_a_tolerance_of_a_half():
    model = load_plant(EXAMPLE)
    for name in ("bristle_stiffness", "stribeck_velocity"):
        assert model.tolerance(name) == pytest.approx(0.5 * getattr(model.values, name))


@pytest.mark.parametrize("motion", ["linear", "rotary"])
def test_a_drives_model_is_read_back_from_its_text(tmp_path, rotary, motion):
    model = load_plant(EXAMPLE if motion == "linear" else rotary)
    assert model.device.is_linear == (motion == "linear")
    tooth = EffectEntry(id="cogging_torque", strengths={"sine": "1 N·m", "order": "7 1/turn"})
    path = tmp_path / "again.drive.yaml"
    path.write_text(drive_text(replace(model, effects=(tooth,)), "again"), "utf-8")
    again = load_plant(path)
    assert again.device.is_linear == model.device.is_linear
    np.testing.assert_allclose(again.values.vector(), model.values.vector(), rtol=1e-8)
    assert again.effects == (tooth,)
    assert again.sensors == model.sensors


def test_a_rotary_drive_is_measured_in_torque_and_angle_as_a_linear_one_in_force_and_way(rotary):
    rng = np.random.default_rng(3)
    way, force = np.cumsum(rng.normal(size=4000)) * 1e-5, rng.normal(size=4000)
    twins = []
    for path, roles in (
        (EXAMPLE, ("drive_force", "linear_position", "command_force")),
        (rotary, ("drive_torque", "drive_angle", "command_torque")),
    ):
        model = load_plant(path)
        (measured,) = measurements_of(_recording(**dict(zip(roles, (force, way, 9 * force), strict=True))), model)
        twins.append((measured, _other_unit(measured)))
    (linear, said), (turning, told) = twins
    assert (linear.device.is_linear, turning.device.is_linear) == (True, False)
    for name in ("voltage", "angle", "current", "added"):
        np.testing.assert_array_equal(getattr(linear, name), getattr(turning, name))
    assert linear.angle_noise == turning.angle_noise
    assert "command_force has another unit than stated" in said[0]
    assert [line.replace("torque", "force").replace("N·m", "N") for line in told] == said


def test_a_rotary_drives_model_is_refused_for_a_linear_drives_recording(rotary):
    zeros = np.zeros(4000)
    with pytest.raises(InputError, match=r"not measured on a rotary drive in torque.*drive_torque and drive_angle"):
        explain([_recording(drive_force=zeros, linear_position=zeros)], load_plant(rotary))


def test_friction_of_a_drive_is_not_judged_as_a_throttles():
    model = load_plant(EXAMPLE)
    with pytest.raises(InputError, match=r"'EMPS' is a drive's.*etb_hil/model/1"):
        Diagnosis(model, load_limits(find("limits", "default")))
