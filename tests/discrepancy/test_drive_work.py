"""A drive's current in another unit, or against the angle, is refused by the work that it does."""

import math
from pathlib import Path

import numpy as np
import pytest
from answers import plain

from etb_hil.base.errors import InputError
from etb_hil.discrepancy.explain import explain
from etb_hil.discrepancy.measured.drive_work import must_do_its_work
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.plant.drive_file import load_plant
from etb_hil.recording.tables import read_table

MODEL = load_plant(Path("docs/examples/brushless.drive.yaml"))


def recorded(path, *, constant=1.0, sign=1.0, friction=1.0, wave=0.0, load=0.0, late=0.0, moves=(20.0, 1.0)):
    """Write a record of a motor that turns to and fro, by its equation of motion."""
    v = MODEL.values
    time = np.arange(0.0, 12.0, 0.002)
    far, often = moves
    angle, speed = far * np.sin(often * time), far * often * np.cos(often * time)
    torque = -v.inertia * often**2 * angle + friction * (v.viscous * speed + v.coulomb * np.tanh(speed / 0.1))
    torque += (wave * np.sin(7.0 * angle) + load) * v.coulomb
    angle = far * np.sin(often * (time - late))
    current = constant * sign * torque / v.torque_per_ampere
    rows = np.column_stack([time, current, angle])
    np.savetxt(path, rows, "%.9g", ",", header="time_s,motor_current_A,motor_angle_rad", comments="")
    return read_table(path)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"constant": 1000.0}, "times the work that the model's friction and mass take; check the unit"),
        ({"constant": 0.001}, "of the work that the model's friction takes; check the unit"),
        ({"sign": -1.0}, "the angle moves opposite to motor_current; invert the sign"),
    ],
)
def test_a_current_that_cannot_have_driven_the_motion_is_refused(wrong, says, tmp_path):
    record = recorded(tmp_path / "wrong.csv", **wrong)
    with pytest.raises(InputError, match=says):
        must_do_its_work(measurements_of(record, MODEL), MODEL)
    answer = plain(explain([record], MODEL))
    assert answer["verdict"] == "insufficient_data"
    assert says in str(answer)


@pytest.mark.parametrize(
    "other",
    [
        {},
        {"friction": 5.0},
        {"friction": 0.4},
        {"wave": 20.0},
        {"constant": math.pi},
        {"moves": (1.0, 20.0 * math.pi), "late": 0.005},
        {"moves": (0.1, 100.0 * math.pi)},
        {"moves": (30.0, 0.1), "load": -3.0},
    ],
    ids=str,
)
def test_a_drive_that_the_model_has_wrong_is_not_taken_for_another_unit(other, tmp_path):
    """Friction may be several times the stated, and waves over the angle take no work at all.

    An angle that is late seems to do some, and a load that the model lacks does it.
    """
    segments = measurements_of(recorded(tmp_path / "right.csv", **other), MODEL)
    must_do_its_work(segments, MODEL)
    assert segments
