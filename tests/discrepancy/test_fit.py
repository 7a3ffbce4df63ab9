"""A fit that comes to where no slope leads on."""

import numpy as np
import pytest
from synthetic import MODEL, measurement

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import all_unknowns, calibrate
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
    assert np.any(found.columns[:, column] != 0.0)
