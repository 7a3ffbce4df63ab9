"""Classes are judged in a record in which all samples of a balance count alike."""

import numpy as np
import pytest
from explain_cases import hidden_case
from explain_study import searched
from synthetic import MODEL, measurement

from etb_hil.discrepancy.candidates.uniform_weighting import uniformly_weighted
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.measured.regimes import STOP
from etb_hil.plant.effects.layout import EXTENDED


def test_samples_of_a_balance_weigh_alike_at_rest_too():
    balances = Balances(measurement(MODEL.vector(), seed=5), MODEL)
    calibration = calibrate(MODEL, [balances])
    residual, healthy = uniformly_weighted([balances], calibration, calibration.fit.whole)
    left = residual(calibration.fit.whole).reshape(3, -1)
    plain = np.stack(balances.channels(calibration.fit.whole[:EXTENDED], calibration.fit.whole[EXTENDED:]))
    on_stop = balances.regimes.label == STOP
    assert np.mean(left[0, on_stop] ** 2) == pytest.approx(1.0)
    assert np.mean(left[0, ~on_stop] ** 2) == pytest.approx(1.0)
    assert np.ptp(left[0, ~on_stop] / plain[0, ~on_stop]) == pytest.approx(0.0, abs=1e-9)
    assert (balances.regimes.is_stuck & ~on_stop).any()
    np.testing.assert_array_equal(healthy.fit.residual, left.ravel())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "effect"), [pytest.param(701, "friction_asymmetry", marks=pytest.mark.study), (703, "iron_loss")]
)
def test_a_torque_of_which_base_parameters_leave_a_share_is_told_from_them(seed, effect):
    (found, *_) = searched(hidden_case(seed, (effect,))).accepted
    assert found.winner.id == effect
    assert found.ambiguity_group == []
