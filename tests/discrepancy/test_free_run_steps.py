"""Free runs take longer steps than the plant where that changes little, and its own where a shaft is elastic."""

import numpy as np
import pytest
from synthetic import MODEL, measurement

from etb_hil.discrepancy.fitting import free_run
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.plant.effects.catalogue import CATALOGUE


def _with(id_, *values):
    p = MODEL.vector()
    if id_:
        p[list(CATALOGUE[id_].indices)[: len(values)]] = values
    return p, Balances(measurement(p, seed=6), MODEL)


def _errors(b, p, ticks, *, one_step):
    found = free_run.errors(b, lambda _: p, free_run.starts(b, p), ticks, one_step=one_step)
    return {name: free_run.rms(errors) for name, errors in found.items()}


@pytest.mark.parametrize(
    ("id_", "values"),
    [("", ()), ("cogging_torque", (0.02,)), ("friction_asymmetry", (0.3, 0.0, 0.02))],
)
def test_few_steps_leave_the_errors_of_a_free_run_as_they_are(id_, values):
    p, b = _with(id_, *values)
    most, ticks = free_run.ticks_of(b.measured.dt), free_run.fewest_ticks(b, p)
    assert ticks <= most / 2
    for one_step in (True, False):
        few, all_ = (_errors(b, p, each, one_step=one_step) for each in (ticks, most))
        assert few == pytest.approx(all_, rel=0.03)


def test_an_elastic_shaft_is_followed_in_the_plants_own_steps():
    p, b = _with("shaft_compliance", 0.02)
    assert free_run.fewest_ticks(b, p) == free_run.ticks_of(b.measured.dt)
    assert np.isfinite(free_run.trace(b, p, 0)).all()
