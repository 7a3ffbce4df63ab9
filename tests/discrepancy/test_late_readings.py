"""A reading that is late: it has a name however little it is late, and its numbers hold the truth."""

import numpy as np
import pytest
from explain_study import one_case
from synthetic import MODEL, measurement

from etb_hil.discrepancy.fitting import free_run
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


def _torque_left(balances, p):
    """RMS of the torque balance over its noise."""
    return float(np.sqrt(np.mean(balances.channels(p, np.zeros(len(NUISANCES)))[0] ** 2)))


def _left(id_, delay, lag):
    """RMS of each balance over its noise under the truth."""
    p = MODEL.vector()
    p[list(CATALOGUE[id_].indices)] = delay, lag
    return [float(np.sqrt(np.mean(one**2))) for one in _balances(p).channels(p, np.zeros(len(NUISANCES)))]


def _balances(p):
    return Balances(measurement(p, seed=4), MODEL)


@pytest.mark.parametrize(
    ("id_", "delay", "lag"),
    [
        ("motor_angle_delay", 0.2e-3, 0.0),
        ("angle_delay", 3e-3, 0.0),
        ("plate_angle_delay", 3e-3, 0.0),
        ("plate_angle_delay", 2e-3, 4e-3),
    ],
)
def test_a_late_angle_leaves_no_more_than_one_in_time(id_, delay, lag):
    assert _left(id_, delay, lag) == pytest.approx(_left(id_, 0.0, 0.0), rel=0.1)


@pytest.mark.parametrize(("delay", "lag"), [(0.0, 1.5e-3), (2e-3, 4e-3)])
def test_a_motor_angle_behind_a_lag_leaves_little(delay, lag):
    """Without the edges of an encoder, which a lag's inverse makes larger, bristles are not quite where they were."""
    p = MODEL.vector()
    p[list(CATALOGUE["motor_angle_delay"].indices)] = delay, lag
    true, plain = (_torque_left(_balances(p), q) for q in (p, MODEL.vector()))
    assert true < 0.15 * plain


@pytest.mark.parametrize(("id_", "delay"), [("motor_angle_delay", 5e-3), ("measurement_delay", 5e-3)])
def test_a_free_run_ends_no_farther_from_readings_that_are_late(id_, delay):
    """By the model with the delay; without it, the angle is off by the way of the delay."""
    p = MODEL.vector()
    p[CATALOGUE[id_].indices[0]] = delay
    late, plain = _balances(p), MODEL.vector()
    found = [
        {
            name: float(np.sqrt(np.mean(errors**2)))
            for name, errors in free_run.errors(
                late, lambda _, q=q: q, free_run.starts(late, q), free_run.ticks_of(late.measured.dt), one_step=False
            ).items()
        }
        for q in (p, plain)
    ]
    assert found[0][free_run.POSITION] < 1.2 * found[1][free_run.POSITION]
    assert found[0][free_run.CURRENT_ROLE] < found[1][free_run.CURRENT_ROLE]


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
