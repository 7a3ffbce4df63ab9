"""The time of an unpowered return, against ODEPACK: the truth that end-of-line measurements are held against."""

import numpy as np
import pytest
from end_of_line_study import job_of, run
from end_of_line_truth import of_motion, phases_of
from independent_plant import coast

BAND = np.radians(1.0)


@pytest.mark.parametrize(("side", "first"), [("open", 0), pytest.param("closed", 1, marks=pytest.mark.study)])
def test_the_measured_return_takes_as_long_as_another_solver_says(side, first):
    job = job_of()
    finished, motion = run(job, job.unit, 3)
    begin, end = list(phases_of(finished, "release"))[first]
    time, angle, velocity, current = motion[(motion[:, 0] > begin) & (motion[:, 0] < end)].T
    off = int(np.flatnonzero(np.abs(current) > 0.5)[-1])  # the last sample that the bridge drove
    values = job.unit.values
    held = values.torque_per_ampere * current[off]
    springs = np.sign(angle[off] - values.limp_home) * (
        values.preload_open + values.slope_open * abs(angle[off] - values.limp_home)
    )
    bristle = (held - springs) / values.bristle_stiffness  # at rest: friction is what motor and springs leave over
    times = np.linspace(0.0, 0.6, 6001)
    away = coast(np.array([angle[off], 0.0, bristle, current[off]]), times, values)[:, 0]
    away = away - away[-1]
    expected = times[np.flatnonzero(np.abs(away) > BAND)[-1]]
    measured = finished.found.measurements[f"return_time_{side}"]
    assert of_motion(finished, motion)[f"return_time_{side}"] == pytest.approx(expected, abs=1.5e-3)
    # The controller acts on the command at its next tick, up to a millisecond later.
    assert measured.low - 1e-3 < expected < measured.high + 1e-3
    assert velocity[off] == pytest.approx(0.0, abs=0.01)
    assert time[off] < end
