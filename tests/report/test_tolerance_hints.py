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
