"""What is said of a rest without a name: what it follows in its own balance, and that no test of ours is for it."""

import pytest
from explain_cases import hidden_case
from explain_study import searched

from etb_hil.discrepancy.candidates.nonparametric import in_their_own_balances
from etb_hil.discrepancy.plan.next_test import next_test
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.table_one import KINDS

NAMED = (*CATALOGUE, *(f"parameter:{name}" for name in KINDS))


# A residual is unexplained where no candidate is a cause, or where none is tried.
@pytest.mark.parametrize(
    "without", [NAMED, pytest.param((), marks=pytest.mark.study)], ids=["no candidate", "every candidate"]
)
def test_a_torque_that_is_missing_is_not_said_to_be_the_motor_constants(without):
    """A spline in the voltage would let that number go where the torque wants it, and explain nothing of its own."""
    findings = searched(hidden_case(206137, ("running_in",)), without)
    assert findings.verdict == "unexplained"
    final = findings.final
    own = in_their_own_balances(findings.balances, final.jacobian, final.fit, final.unknowns)
    assert (own[0].balance, own[0].over, own[0].parity) == ("torque", "time", "odd")
    assert own[0].explained_share > 0.8
    assert all(one.explained_share < 0.02 for one in own if one.balance == "voltage")
    assert next_test(findings) is None
