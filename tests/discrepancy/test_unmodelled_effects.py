"""What together does nearly what something unknown does is no explanation: by rule, and on files where it was one."""

import pytest
from explain_cases import hidden_case
from explain_study import searched


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
