"""A sensor with play is on one of its sides where a part of a record begins, and remembers the smallest motions."""

import numpy as np
import pytest
from synthetic import MODEL, measurement

from etb_hil.discrepancy.measured.filter_record import as_record
from etb_hil.estimation.filtering import Disturbance, filtered
from etb_hil.hypotheses.constants import IMMATERIAL
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.physics import COULOMB

PLAY = CATALOGUE["sensor_hysteresis"]


@pytest.mark.parametrize("sharpness", [1.5, 20.0])
def test_of_the_true_play_no_reading_is_an_outlier_in_any_part(sharpness):
    p = MODEL.vector()
    p[list(PLAY.indices)] = 0.003, sharpness
    parts = as_record(measurement(p, seed=11), MODEL).thinned(9_000, 9)
    found = filtered(parts, p, Disturbance(IMMATERIAL * p[COULOMB], 1e-2))
    assert found.outlying == 0
    assert np.mean(found.whitened[:, 2] ** 2) < 1.1
