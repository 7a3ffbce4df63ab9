"""The thresholds for no misfit, a material one and an equivalent hypothesis are in order."""

import math

from etb_hil.hypotheses.constants import EQUIVALENT_PARAMETER, EQUIVALENT_SHAPE, MATERIAL, NEEDED


def test_the_share_of_an_equivalent_shape_is_that_of_the_cosine_of_the_studies():
    assert math.isclose(EQUIVALENT_SHAPE, math.sqrt(1.0 - 0.95**2), rel_tol=0.01)


def test_the_share_of_a_parameter_is_smaller_than_that_of_an_effect():
    assert 0.0 < EQUIVALENT_PARAMETER < EQUIVALENT_SHAPE < NEEDED < 1.0 < MATERIAL
