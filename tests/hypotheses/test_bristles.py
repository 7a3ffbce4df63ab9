"""Healthy and faulty units whose bristles stay below break-away, where the model file says so.

The independent bristles yield along another curve than ours, and begin to at another share of friction.
"""

from dataclasses import replace

import numpy as np
import pytest
from independent_throttle import Unit, friction_check, off_by_tolerances
from throttle_as_model import record_until_the_bridge_opens

from etb_hil.hypotheses.search import searched
from etb_hil.plant.model_file import FrictionModel

RATE = 1000
ELASTO_PLASTIC = 1  # as `Unit.law` numbers it


def _found(unit, seed, **motion):
    unit, bench = replace(unit, law=ELASTO_PLASTIC), off_by_tolerances(Unit(), np.random.default_rng(seed))
    record, model = record_until_the_bridge_opens(unit, bench, friction_check(unit, **motion), RATE, seed)
    return searched(record, replace(model, friction_model=FrictionModel.ELASTO_PLASTIC))


@pytest.mark.parametrize("seed", [81, pytest.param(82, marks=pytest.mark.study)])
def test_a_healthy_unit_has_no_cause(seed):
    found = _found(Unit(), seed)
    assert (found.verdict, found.causes) == ("adequate", ())


def test_a_break_away_that_is_too_hard_is_named():
    found = _found(Unit(stiction=0.5), 83, creeps=(), speeds=(1.2,), dashes=1)
    assert found.verdict == "explained"
    assert [step.best.ids for step in found.causes] == [("parameter:stiction",)]
