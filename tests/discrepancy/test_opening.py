"""A session of the bench opens its bridge under current: what the diodes give for a tenth of a row is no blow."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic import MODEL

from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.measurement import measurements_of
from etb_hil.discrepancy.opening import without_diodes


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """The friction check of a healthy unit on the stock bench: 1 kHz, and the bridge opens twice."""
    model = find("model", "default")
    limits = find("limits", "default")
    files = JobFiles(find("scenario", "friction_check"), find("bench", "virtual_classic"), model, limits)
    finished = execute(prepare(files), tmp_path_factory.mktemp("session"), "", 1)
    (measured,) = measurements_of(finished.analysis.recording, MODEL)
    return measured


def _openings(measured):
    return np.flatnonzero(np.abs(measured.voltage) > MODEL.values.voltage_limit * 1.05)


def test_a_true_model_explains_the_voltage_of_a_session(session):
    assert len(_openings(session)) > 0
    balances = Balances(session, MODEL)
    voltage = balances.channels(MODEL.vector(), np.zeros(4))[1]
    assert np.sqrt(np.mean(voltage[balances.regimes.is_good] ** 2)) < 1.5  # 8.6 with the rows as they were read
    assert balances.regimes.is_good.mean() > 0.9


def test_the_row_has_the_mean_that_takes_the_current_away(session):
    found = without_diodes(session, MODEL)
    v = MODEL.values
    changed = np.flatnonzero(found.voltage != session.voltage)
    np.testing.assert_array_equal(changed, _openings(session))
    np.testing.assert_array_equal(~found.is_good, found.voltage != session.voltage)
    for row in changed:
        # A winding's flux: what it loses is what the voltage takes, with its resistance's help.
        of_motor = session.voltage[row + 1]
        taken = (found.voltage[row] - of_motor) / session.rate
        assert taken == pytest.approx(-v.inductance * session.current[row], rel=0.1)


def test_nothing_is_changed_where_a_voltmeter_sees_no_diodes(session):
    rows = _openings(session)
    voltage = session.voltage.copy()
    voltage[rows] = voltage[rows + 1]
    quiet = replace(session, voltage=voltage)
    assert without_diodes(quiet, MODEL) is quiet
