"""Measured tables of other people's rigs become Recordings."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from etb_hil.recording.tables import read_table
from etb_hil.report.recording_plot import plot_recording

CHECKOUT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("ETB_HIL_REAL_DATA", CHECKOUT.parent / "shared" / "data"))
MAPS = CHECKOUT / "docs" / "examples"

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="no measured data beside the checkout (ETB_HIL_REAL_DATA)")


def test_the_throttle_sweep_has_duty_and_both_tracks_in_volts():
    recording = read_table(DATA / "etb_tbcp" / "tbcp_open_loop_duty_staircase.csv", MAPS / "etb_tbcp.map.yaml")
    first, second = recording.series("throttle_position"), recording.series("throttle_position_2")
    assert first.unit == second.unit == "V"
    assert np.std(first.values + second.values) < 0.05  # two tracks that run against each other
    duty, asked = recording.series("motor_duty"), recording.series("command_duty")
    assert (duty.values.min(), duty.values.max(), asked.values.max()) == (0.0, 1.0, 1.0)
    assert np.all((duty.values == asked.values) | (duty.values == 0.0))
    assert (recording.series("pwm_frequency").values.min(), recording.series("pwm_frequency").values.max()) == (
        1e3,
        19e3,
    )
    assert (first.time_ns[0], first.time_ns[-1]) == (5_070_000_000, 501_338_000_000)
    assert len(first.values) == 45_100 - 68  # 68 rows repeat the millisecond of the row before
    assert recording.notes == ["68 rows had the time of the row before and were left out"]


def test_the_throttle_sweep_is_drawn(tmp_path):
    recording = read_table(DATA / "etb_tbcp" / "tbcp_open_loop_duty_staircase.csv", MAPS / "etb_tbcp.map.yaml")
    plot_recording(recording, recording.roles, tmp_path / "sweep.png")
    assert (tmp_path / "sweep.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("name", ["DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"])
def test_the_linear_drive_has_position_and_force(name):
    recording = read_table(DATA / "emps" / name, MAPS / "emps.map.yaml")
    position, force = recording.series("linear_position"), recording.series("drive_force")
    assert (len(position.values), position.unit, force.unit) == (24_841, "m", "N")
    assert abs(int(position.time_ns[-1]) - 24_840_000_000) < 1000
    assert np.all(np.abs(np.diff(position.time_ns) - 1_000_000) < 100)
    assert 10 < np.max(np.abs(force.values)) < 400
    assert not recording.gaps()
