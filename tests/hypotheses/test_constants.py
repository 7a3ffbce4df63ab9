"""What the comparison calls nothing, noticeable and alike is in order."""

import math

from etb_hil.hypotheses.constants import ALIKE, ALIKE_NUMBERS, MATERIAL, NEEDED


def test_what_effects_leave_is_that_of_the_cosine_that_the_studies_call_alike():
    assert math.isclose(ALIKE, math.sqrt(1.0 - 0.95**2), rel_tol=0.01)


def test_numbers_have_to_leave_less_than_effects():
    assert 0.0 < ALIKE_NUMBERS < ALIKE < NEEDED < 1.0 < MATERIAL
