"""The truth as the model of a free run: all that it errs by is the measured voltage."""

import numpy as np
import pytest
from explain_truth import truth_errors
from generator import layout as at
from generator.case import make_case


@pytest.mark.parametrize(
    "effect",
    [
        pytest.param("stiction_dwell", marks=pytest.mark.study),
        pytest.param("shaft_compliance", marks=pytest.mark.study),
        "resistance_temperature",
    ],
)
def test_under_the_exact_voltage_the_truth_errs_by_next_to_nothing(effect):
    case = make_case(3, (effect,))
    exact = case.rig.motion(case.effects)[:, at.LOG_COMMAND]
    left, measured = (
        np.sqrt(np.mean(truth_errors(case, voltage, 2000.0) ** 2)) for voltage in (exact, case.table["motor_voltage"])
    )
    assert left < 0.05 * measured
    assert 1e-4 < measured < 0.03
