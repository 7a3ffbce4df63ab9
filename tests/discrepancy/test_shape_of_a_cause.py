"""What speaks against an answer that fits: numbers on their edges, impossible signs, causes that nothing needs."""

import numpy as np
import pytest
from explain_cases import hidden_case, recording_of
from synthetic import MODEL

from etb_hil.discrepancy.candidates.nonparametric import beyond_tolerances
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.fit import Fit
from etb_hil.discrepancy.fitting.unknowns import base_unknowns, start
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.search.stepwise import search


def _on_edge(wanted, x):
    """Made-up columns, and the fit of numbers at `x` of which the record wants `wanted`, beside some noise."""
    unknowns = base_unknowns(MODEL)[: len(x)]
    rng = np.random.default_rng(3)
    columns = rng.normal(size=(400, len(x)))
    whole = start(MODEL)
    for unknown, value in zip(unknowns, x, strict=True):
        unknown.put(whole, value)
    residual = columns @ (np.asarray(x) - np.asarray(wanted)) + 0.1 * rng.normal(size=400)
    return columns, Fit(whole, residual, float(residual @ residual)), unknowns


@pytest.mark.parametrize(
    ("wanted", "x", "least", "most"),
    [
        pytest.param([0.2, 1.5, -0.3], [0.2, 1.02, -0.3], 0.9, 1.0, id="wants to leave"),
        pytest.param([0.2, 1.02, -0.3], [0.2, 1.02, -0.3], 0.0, 0.02, id="is there by chance"),
        pytest.param([0.2, 0.9, -0.3], [0.2, 1.02, -0.3], 0.0, 0.02, id="what goes inwards is inside"),
        pytest.param([0.2, 0.9, -0.3], [0.2, 0.8, -0.3], 0.0, 0.0, id="inside already"),
    ],
)
def test_the_rest_that_numbers_would_take_beyond_their_tolerances(wanted, x, least, most):
    share = beyond_tolerances(*_on_edge(wanted, x), is_electrical=True).explained_share
    assert least - 1e-9 <= share <= most


@pytest.mark.study
def test_angles_that_are_late_make_no_current_early():
    hidden = hidden_case(220410, seconds=20.0)
    table = hidden.case.table
    for role in ("motor_angle", "throttle_angle"):
        table[role] = np.interp(table["time"] - 2e-4, table["time"], table[role])
    model = hidden.model
    findings = search(model, [Balances(m, model) for m in measurements_of(recording_of(hidden.case), model)])
    assert "measurement_delay" not in [found.winner.id for found in findings.accepted]
