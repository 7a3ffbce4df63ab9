"""A stop that is not where the model file has it: a wrong number, and no layer before the stop that it states."""

from dataclasses import replace

import numpy as np
import pytest
from explain_cases import hidden_case

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.search.stepwise import search

DEGREE = np.radians(1.0)


def _stated_elsewhere(seed, stop, degrees):
    """A healthy unit, and its model file with a stop that many degrees further than the unit has it."""
    hidden = hidden_case(seed, seconds=20.0)
    there = hidden.case.rig.unit[stop]
    stated = replace(hidden.model.parameters[stop], value=there + degrees * DEGREE)
    model = replace(hidden.model, parameters={**hidden.model.parameters, stop: stated})
    return model, [Balances(m, model) for m in measurements_of(hidden.recording, model)], there


@pytest.mark.slow
@pytest.mark.parametrize("seed", [pytest.param(8001, marks=pytest.mark.study), 8004])
@pytest.mark.parametrize(
    ("stop", "degrees"),
    [
        ("stop_high", 2.0),
        *(pytest.param(*one, marks=pytest.mark.study) for one in (("stop_high", 0.7), ("stop_low", -2.0))),
    ],
)
def test_a_stop_met_before_the_stated_one_is_no_layer_alone(stop, degrees, seed):
    model, balances, there = _stated_elsewhere(seed, stop, degrees)
    findings = search(model, balances)
    assert findings.verdict in ("explained", "ambiguous")
    (found,) = findings.accepted
    assert f"parameter:{stop}" in (found.winner.id, *found.ambiguity_group)
    if found.winner.candidate.effect is None:
        (unknown,) = [u for u in found.winner.unknowns if u.name == stop]
        assert findings.final.fit.whole[unknown.place] == pytest.approx(there, abs=1e-3)
