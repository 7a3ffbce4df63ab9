"""A current that is measured late: it has a name however little it is late, and its numbers hold the truth."""

import numpy as np
import pytest
from explain_study import one_case
from synthetic import MODEL, measurement

from etb_hil.discrepancy.fitting.balances import NUISANCES, Balances
from etb_hil.plant.effects.catalogue import CATALOGUE


def _voltage_left(delay, lag):
    """RMS of the voltage balance over its noise under the truth, of a current that is late by so many s."""
    p = MODEL.vector()
    p[list(CATALOGUE["measurement_delay"].indices)] = delay, lag
    left = Balances(measurement(p, seed=4), MODEL).channels(p, np.zeros(len(NUISANCES)))[1]
    return float(np.sqrt(np.mean(left**2)))


@pytest.mark.parametrize(("delay", "lag"), [(0.2e-3, 0.0), (0.7e-3, 0.0), (0.0, 1.5e-3), (0.4e-3, 0.6e-3)])
def test_a_late_current_leaves_no_more_than_one_in_time(delay, lag):
    assert _voltage_left(delay, lag) == pytest.approx(_voltage_left(0.0, 0.0), rel=0.1)


@pytest.mark.study
@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(100048, id="0.21 ms, less than half a sample"),
        pytest.param(88009, id="0.67 ms, more than a sample"),
        pytest.param(100053, id="a lag"),
    ],
)
def test_a_late_current_is_named_and_measured(seed):
    _, sample = one_case("strong", seed)
    assert sample["causes"] == [("measurement_delay", [])]
    assert sample["outcome"] == "right"
    held = sample["covered"]
    numbers = [held[name] for name in held if name.startswith("measurement_delay")]
    assert numbers == [True]
    assert held["base:inertia"]
