"""Pieces of a healthy unit's record, wherever they begin, however short: nothing of the unit is accused."""

import numpy as np
import pytest
from synthetic import MODEL, RATE

from etb_hil.base.stock import find
from etb_hil.bench.simulation import Simulation
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.measurement import measurements_of
from etb_hil.discrepancy.suspects.placeholders import placeholders
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import SampleBlock
from etb_hil.scenario.scenario_file import load_scenario

ROLES = ("motor_voltage", "motor_current", "motor_angle", "throttle_angle")


@pytest.fixture(scope="module")
def whole():
    steps = load_scenario(find("scenario", "isolability")).content.steps
    return Simulation(MODEL, MODEL, law="pd", seed=3, rate=RATE).run(steps)


def _piece(whole, begin, seconds, **changed):
    time_ns, columns = whole
    rows = slice(round(begin * RATE), round((begin + seconds) * RATE))
    columns = {role: np.array(columns[role][rows]) for role in ROLES}
    for role, change in changed.items():
        columns[role] = change(columns[role])
    found = Recording("piece", ClockGrade.TABLE)
    lost = np.zeros(len(time_ns[rows]), np.int64)
    found.append([SampleBlock("table", time_ns[rows], time_ns[rows], columns, lost)])
    return found


def test_an_angle_that_is_missing_for_long_parts_the_record(whole):
    def missing(angle):
        angle[16000:16400] = np.nan
        angle[100] = np.nan
        return angle

    first, second = measurements_of(_piece(whole, 0.0, 20.0, motor_angle=missing), MODEL)
    assert len(first) == 16000
    assert len(second) == 40000 - 16400
    assert any("of the rows have no motor_angle" in flag for flag in first.flags)


def test_stretches_that_rest_for_unlike_long_are_searched_together(whole):
    """Of one that rests for most of its time fewer knots of a nameless spline are apart."""
    stretches = [measurements_of(_piece(whole, begin, 3.0), MODEL)[0] for begin in (10.0, 29.0)]
    balances = [Balances(measured, MODEL) for measured in stretches]
    columns, residual = np.ones((3 * sum(b.rows for b in balances), 1)), np.zeros(3 * sum(b.rows for b in balances))
    found = placeholders(balances, MODEL.vector(), columns, residual)
    assert {one.share for one in found} == {0.0}
