"""A single bump, however tall and narrow, is left out of the curve, or leaves no curve: it never bends one."""

from dataclasses import replace

import numpy as np
import pytest
from independent_throttle import Unit, friction_check, sense
from throttle_as_model import bench_model, rows_of

from etb_hil.base.stock import find
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limits_file import load_limits

LIMITS = load_limits(find("limits", "default"))


def diagnosed(unit, seed):
    run, phases = friction_check(unit)
    diagnosis = Diagnosis(bench_model(Unit()), LIMITS)
    for rows, kind in rows_of(sense(unit, run, 1000, np.random.default_rng(seed)), phases, 1000):
        diagnosis.push(rows, kind)
    return diagnosis.finish()


@pytest.mark.parametrize(
    ("height", "place", "width", "seed"),
    [
        (3.0, 0.7, 0.02, 1),
        (2.0, 1.0, 0.015, 5),
        (1.0, 0.7, 0.02, 7),
        *(
            pytest.param(*one, marks=pytest.mark.study)
            for one in ((3.0, 0.9, 0.02, 2), (3.0, 0.5, 0.03, 3), (3.0, 0.7, 0.06, 4), (1.5, 1.1, 0.04, 6))
        ),
    ],
)
def test_a_tall_bump_bends_no_curve(height, place, width, seed):
    unit = replace(Unit(), bump=height, bump_angle=place, bump_width=width)
    result = diagnosed(unit, seed)
    truth = {
        "T_st": unit.stiction,
        "T_c": unit.coulomb,
        "omega_s": unit.stribeck_velocity,
        "viscous": unit.viscous,
    }
    found = {name: result.measurements.get(name) for name in truth}
    # Of 28 intervals of 95 % one or two miss: three standard errors hold all of them with a chance of 93 %.
    off = {
        name: (number.value - truth[name]) / (0.5 * (number.high - number.low) / 1.96)
        for name, number in found.items()
        if number is not None
    }
    assert all(abs(errors) < 3.0 for errors in off.values()), off
    assert result.measurements.get("T_st") is not None
    assert any(reason.id == "T_st_exceeded" for reason in result.reasons)
    assert not any(reason.id in {"model_contradicted", "uneven_way"} for reason in result.reasons)


def test_beside_a_bump_of_one_and_a_half_times_friction_the_curve_is_known_as_well_as_without():
    plain = diagnosed(Unit(), 1)
    bumpy = diagnosed(replace(Unit(), bump=1.5, bump_angle=0.7, bump_width=0.05), 1)
    for name in ("T_c", "omega_s"):
        alone, beside = plain.measurements.get(name), bumpy.measurements.get(name)
        assert beside.high - beside.low < 2.0 * (alone.high - alone.low)
