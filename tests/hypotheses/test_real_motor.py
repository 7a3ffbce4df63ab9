"""A brushless motor that others measured: cogging and a filtered current, from the record alone."""

import math
import os
from pathlib import Path

import numpy as np
import pytest

from etb_hil.discrepancy.measured.filter_record import as_record
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.estimation.record import joined
from etb_hil.hypotheses.search import searched
from etb_hil.plant.drive_file import load_plant
from etb_hil.recording.tables import read_table

HERE = Path(__file__).parent
REAL = Path(os.environ.get("ETB_HIL_REAL_DATA", HERE.parents[2] / "shared" / "data"))
DATA = REAL / "odrive_cogging"
STEPS = 8192  # of the encoder in a turn
TORQUE = 0.036  # N·m/A, by the author's notes
DRIVE = """
schema: etb_hil/drive/1
name: brushless motor
description: without a load, driven by its current
motion: rotary
inertia: {value: 2.5e-4 kg·m², tolerance: 30 %, source: the author's notes}
viscous: {value: 1e-4 N·m·s/rad, tolerance: 100 %, source: rounded}
coulomb: {value: 0.01 N·m, tolerance: 50 %, source: rounded}
constant_load: {value: 0 N·m, tolerance: 0.002 N·m, source: offset of the drive}
presliding: 0.01 rad
settled_speed: 0.5 rad/s
travel_per_turn: 6.283185307 rad
position_step: 0.000767 rad
drive_noise: 0.0005 N·m
"""

pytestmark = [
    pytest.mark.skipif(not DATA.is_dir(), reason="the measured data are not beside this checkout"),
    pytest.mark.study,
]


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Return what is found of the slow turn, by the likelihood."""
    folder = tmp_path_factory.mktemp("motor")
    (folder / "drive.yaml").write_text(DRIVE.strip(), "utf-8")
    time, counts, current = np.genfromtxt(DATA / "slow_without_compensation.csv", delimiter=",", skip_header=1).T
    columns = np.column_stack([time, TORQUE * current, counts * 2.0 * math.pi / STEPS])
    table = folder / "turn.csv"
    names = "time_s,drive_torque_Nm,drive_angle_rad"
    np.savetxt(table, columns, delimiter=",", header=names, comments="", fmt="%.9g")
    model = load_plant(folder / "drive.yaml")
    made = joined([as_record(one, model) for one in measurements_of(read_table(table), model)])
    return searched(
        made, model, ids=["measurement_delay", "cogging_torque", "friction_position_periodic", "torque_ripple"]
    )


def test_the_cogging_is_named_and_the_filter_of_the_current(found):
    """The README beside the data has both."""
    assert {step.best.ids for step in found.causes} == {("cogging_torque",), ("measurement_delay",)}
    assert found.final.value("measurement_delay.lag")[0] == pytest.approx(0.125, rel=0.1)


@pytest.mark.parametrize(("order", "size"), [(7, 0.0323), (14, 0.0116), (28, 0.0210), (36, 0.0112), (12, 0.0095)])
def test_orders_and_sizes_are_those_of_a_fit_by_least_squares(found, order, size):
    """Sizes: of the README beside the data. The motion is one turn, so that orders are known by being whole."""
    names = {one.name: float(found.final.parameters[one.place]) for one in found.final.unknowns}
    cogging = {name.partition(".")[2]: value for name, value in names.items() if name.startswith("cogging_torque.")}
    first = cogging["order"]
    waves = [(first, "sine", "cosine"), (2.0 * first, "second_sine", "second_cosine")]
    waves += [(cogging[f"order_{k}"], f"sine_{k}", f"cosine_{k}") for k in range(2, 6) if f"order_{k}" in cogging]
    near, sine, cosine = min(waves, key=lambda one: abs(one[0] - order))
    assert near == pytest.approx(order, rel=0.003)
    assert math.hypot(cogging[sine], cogging[cosine]) == pytest.approx(size, rel=0.12)
