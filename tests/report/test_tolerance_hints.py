"""What an answer without a cause says of numbers at the edge of their tolerances."""

import pytest

from etb_hil.report.tolerance_hints import tolerance_hints
from etb_hil.results.explained.models import CalibratedParameter
from etb_hil.results.explanation import ExplanationResult

VISCOUS = CalibratedParameter("N·m·s/rad", nominal=1.0e-4, value=1.9e-4, interval=None, tolerance=0.9e-4)
COULOMB = CalibratedParameter("N·m", nominal=0.14, value=0.15, interval=None, tolerance=0.02)


def found(verdict, **calibrated):
    return ExplanationResult(verdict, calibrated=calibrated)


def test_a_number_at_its_edge_is_said_with_what_the_file_states():
    said = tolerance_hints(found("unexplained", viscous=VISCOUS, coulomb=COULOMB))
    assert "viscous friction (0.00019 N·m·s/rad, stated 0.0001 within 9e-05)" in said
    assert "sliding friction" not in said


@pytest.mark.parametrize("verdict", ["adequate", "explained", "ambiguous", "insufficient_data"])
def test_other_answers_have_no_hint(verdict):
    assert tolerance_hints(found(verdict, viscous=VISCOUS)) == ""


def test_numbers_inside_their_tolerances_give_no_hint():
    assert tolerance_hints(found("unexplained", coulomb=COULOMB)) == ""


@pytest.mark.parametrize("verdict", ["adequate", "explained", "unexplained"])
def test_a_number_of_a_stated_effect_that_the_fit_has_otherwise_is_said(verdict):
    """It has no tolerance: a model that describes the data is not the file's then."""
    sine = CalibratedParameter("N·m", nominal=0.7, value=1.0, interval=(0.99, 1.01), tolerance=0.0)
    cosine = CalibratedParameter("N·m", nominal=0.0, value=0.001, interval=(-0.01, 0.01), tolerance=0.0)
    said = tolerance_hints(found(verdict, **{"gravity_load.sine": sine, "gravity_load.cosine": cosine}))
    assert said.startswith("The fit has gravity")
    assert said.endswith("at 1 N·m (stated 0.7).")
