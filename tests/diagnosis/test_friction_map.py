"""Friction over position and temperature: level places stay level, bumps are found where they are."""

from dataclasses import replace

import numpy as np
import pytest
from independent_throttle import Unit, friction_check, off_by_tolerances, sense
from interval_coverage import check
from throttle_as_model import bench_model, rows_of

from etb_hil.base.stock import find
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.friction_map import find_bumps, friction_map
from etb_hil.diagnosis.limits_file import load_limits
from etb_hil.diagnosis.windows import NARROW, WIDE

LIMITS = load_limits(find("limits", "default"))


def result_of(unit, seed, temperature=20.0, rate=1000):
    rng = np.random.default_rng(seed)
    run, phases = friction_check(unit)
    diagnosis = Diagnosis(bench_model(off_by_tolerances(Unit(), rng)), LIMITS)
    for rows, kind in rows_of(sense(unit, run, rate, rng), phases, rate, temperature=temperature):
        diagnosis.push(rows, kind)
    return diagnosis.finish()


def series_of(*given):
    return result_of(*given).series


def test_even_friction_maps_to_one():
    result = result_of(Unit(), 0)
    assert result.measurements.get("bump_1") is None
    over = friction_map([result.series])
    assert np.nanmax(np.abs(over.factor - 1.0)) < 0.04
    assert np.count_nonzero(np.isfinite(over.factor)) > 25
    assert not find_bumps(over)


@pytest.mark.parametrize("place", [0.4, 0.8, 1.2])
def test_bump_is_found_and_placed(place):
    result = result_of(Unit(bump_angle=place, bump_width=0.05, bump=0.3), 1)
    (bump,) = find_bumps(friction_map([result.series]))
    assert bump.start < place < bump.end
    assert bump.angle == pytest.approx(place, abs=0.035)
    assert bump.excess == pytest.approx(0.3, abs=0.08)
    number = result.measurements.get("bump_1")
    assert number.value == bump.excess < 0.3  # a mean over a cell: so there is no interval that could hold the peak
    assert number.low is number.high is None
    assert f"{np.degrees(bump.angle):.1f} deg" in number.name
    assert result.measurements.get("bump_2") is None
    # It does not draw the curve towards itself
    real = Unit()
    for name, true, within in (
        ("T_st", real.stiction, 0.03), ("T_c", real.coulomb, 0.05), ("omega_s", real.stribeck_velocity, 0.1),
    ):  # fmt: skip
        found = result.measurements.get(name)
        assert found.low < true < found.high
        assert found.value == pytest.approx(true, rel=within)


@pytest.mark.parametrize("rate", [1000, pytest.param(20000, marks=pytest.mark.study)])
@pytest.mark.parametrize(
    "shape",
    [
        (0.4, 0.9, 0.3, 0.0), (-0.3, 0.9, 0.2, 0.0), (0.4, 1.38, 0.06, 0.0), (0.5, 0.5, 0.07, 0.35),
        *(
            pytest.param(one, marks=pytest.mark.study)
            for one in ((0.15, 0.9, 0.3, 0.0), (0.5, 0.9, 0.5, 0.0), (0.3, 0.5, 0.05, 0.35), (0.6, 3.0, 2.0, 0.0))
        ),
    ],
)  # fmt: skip
def test_friction_that_differs_all_along_the_way_is_no_confident_curve(shape, rate):
    """Bumps that are broad, several or at an end, dips and slopes: what fast windows show is not speed's alone."""
    unit = Unit(**dict(zip(("bump", "bump_angle", "bump_width", "bump_every"), shape, strict=True)))
    result = result_of(unit, 4, rate=rate)
    for name, true in (("T_c", unit.coulomb), ("omega_s", unit.stribeck_velocity), ("viscous", unit.viscous)):
        found = result.measurements.get(name)
        assert found is None or found.low <= true <= found.high, name
    slope = shape[1] == 3.0
    assert not slope or result.measurements.get("bump_1") is None


def test_temperatures_are_rows_of_their_own():
    bumpy = Unit(bump_angle=0.8, bump_width=0.05, bump=0.3)
    cold, warm = series_of(bumpy, 2, 15.0), series_of(replace(Unit(), coulomb=0.13, stiction=0.154), 3, 62.0)
    over = friction_map([cold, warm])
    assert over.temperature[[0, -1]] == pytest.approx([15.0, 65.0])
    here = int(np.argmin(np.abs(over.angle - 0.8)))
    assert over.factor[0, here] > 1.15
    assert over.factor[-1, here] == pytest.approx(1.0, abs=0.04)
    assert np.all(np.isnan(over.factor[1:-1]))


def test_wide_windows_overlap_more_so_that_their_mean_is_less_sure():
    rng = np.random.default_rng(4)
    run = {
        "point_angle": np.full(400, 0.5),
        "point_velocity": np.where(np.arange(400) % 2, 1.0, -1.0),
        "point_excess": 0.1 * rng.standard_normal(400),
        "point_temperature": np.full(400, 20.0),
    }
    narrow, wide = ({**run, "point_overlap": np.full(400, shape.overlap)} for shape in (NARROW, WIDE))
    errors = [friction_map(runs).error.item() for runs in ([run], [narrow], [wide], [narrow, wide])]
    assert errors[0] == errors[1] == pytest.approx(0.1 * np.sqrt(NARROW.overlap / 400.0), rel=0.1)
    assert errors[2] == pytest.approx(np.sqrt(WIDE.overlap / NARROW.overlap) * errors[1])
    assert errors[3] == pytest.approx(np.hypot(errors[1], errors[2]) / 2.0)


def test_the_points_of_a_run_say_how_much_their_windows_overlap():
    _, (by_a_track,) = check(np.random.default_rng([7, 0]), (1000,), track=True)
    for series, shape in ((series_of(Unit(), 0), NARROW), (by_a_track.series, WIDE)):
        assert np.all(series["point_overlap"] == shape.overlap)
        assert len(series["point_overlap"]) == len(series["point_angle"])


def test_runs_without_a_fit_are_refused():
    with pytest.raises(ValueError, match="no run has a fitted"):
        friction_map([{"time": np.zeros(3)}])


def test_runs_too_fast_to_tell_places_apart_are_refused():
    names = ("point_angle", "point_velocity", "point_excess", "point_temperature")
    with pytest.raises(ValueError, match="slow enough"):
        friction_map([dict.fromkeys(names, np.full(5, 9.0))])
