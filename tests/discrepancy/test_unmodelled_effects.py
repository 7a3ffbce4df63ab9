"""What together does nearly what something unknown does is no explanation: by rule, and on files where it was one."""

import numpy as np
import pytest
from explain_cases import hidden_case
from explain_study import searched
from synthetic import MODEL, measurement

from etb_hil.discrepancy.candidates.nonparametric import nonparametric_terms
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.plant.effects.layout import EXTENDED


def test_a_curve_is_looked_for_in_the_samples_that_count():
    balances = Balances(measurement(MODEL.vector(), seed=3), MODEL)
    found = calibrate(MODEL, [balances])
    velocity = balances.spectrum.picked(balances.motion(found.fit.whole[:EXTENDED])[1])
    curve = np.zeros(3 * balances.samples)
    curve[: balances.samples] = np.abs(velocity) > np.median(np.abs(velocity))
    left = found.fit.residual + 3.0 * curve

    def most(counts):
        taken = nonparametric_terms([balances], found.fit.whole[:EXTENDED], found.jacobian, left, counts)
        return max(spline.share for spline in taken)

    assert most(curve == 0.0) < 0.1 < most(None)


@pytest.mark.study
@pytest.mark.parametrize(
    ("seed", "hidden", "level", "without"),
    [
        pytest.param(147012, "stribeck_shape", "strong", ("stribeck_shape",), id="three strangers"),
        pytest.param(131110, "air_drag", "medium", (), id="a number beside a curve"),
        pytest.param(132050, "current_sensor_curvature", "medium", (), id="one who touched only half"),
        pytest.param(131086, "spring_thermal_drift", "medium", (), id="a spring and no magnets"),
        pytest.param(132014, "running_in", "medium", (), id="wear and no grease"),
    ],
)
def test_what_is_no_candidate_is_unexplained(seed, hidden, level, without):
    assert searched(hidden_case(seed, (hidden,), level), without).verdict == "unexplained"
