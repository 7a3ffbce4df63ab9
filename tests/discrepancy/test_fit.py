"""A fit that comes to where no slope leads on."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic import MODEL, measurement

from etb_hil.base import side_by_side
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import all_unknowns, calibrate, residual_of
from etb_hil.discrepancy.fitting.fit import fit_of, jacobian
from etb_hil.discrepancy.fitting.unknowns import start
from etb_hil.plant.physics import COULOMB, STICTION, STRIBECK_VELOCITY


def test_a_fit_that_begins_with_no_break_away_peak_finds_it():
    truth = MODEL.vector()
    truth[STICTION] = 1.05 * truth[COULOMB]
    balances = [Balances(measurement(truth, seed=4), MODEL)]
    unknowns = all_unknowns(MODEL, balances)
    whole = start(MODEL)
    whole[COULOMB], whole[STICTION] = 1.08 * truth[COULOMB], 1.03 * truth[COULOMB]
    found = calibrate(MODEL, balances, whole, unknowns)
    assert found.fit.whole[[COULOMB, STICTION]] == pytest.approx(truth[[COULOMB, STICTION]], rel=0.01)
    column = next(k for k, unknown in enumerate(unknowns) if unknown.place == STRIBECK_VELOCITY)
    assert np.any(found.jacobian[:, column] != 0.0)


@pytest.mark.parametrize("is_current_known", [True, False])
def test_as_many_cores_as_there_are_find_the_same_jacobian(is_current_known, monkeypatch):
    measured = measurement(MODEL.vector(), seed=4)
    measured = measured if is_current_known else replace(measured, current=None)
    found = []
    for count in (1, 2, 7):
        monkeypatch.setattr(side_by_side, "cores", lambda count=count: count)
        balances = [Balances(measured, MODEL)]
        unknowns = all_unknowns(MODEL, balances)
        residual = residual_of(balances)
        found.append(jacobian(residual, fit_of(residual, start(MODEL)), unknowns))
    assert np.any(found[0] != 0.0)
    np.testing.assert_array_equal(found[1], found[0])
    np.testing.assert_array_equal(found[2], found[0])
