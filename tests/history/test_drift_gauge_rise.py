"""Drift, gauge study and rise by numbers that can be checked by hand, each rule on both sides of its edge."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import f as f_distribution

from etb_hil.histories.drift import Drift, Point, deviations, drifts, series_of
from etb_hil.histories.gauge import USABLE, AnovaRow, GaugeStudy, balanced, gauge_study
from etb_hil.histories.rise import rises
from etb_hil.histories.temperature import unit_laws

LEVEL = 0.5 * math.log(1.25)  # what units that do not scatter may change by


def test_a_deviation_is_a_share_of_the_level_of_its_unit_on_its_bench():
    found = deviations(
        np.array([5.0, 1.0, 2.0, 3.0, 4.0, 6.0]),
        np.array([3.0, 1.0, 7.0, 2.0, 8.0, 9.0]),
        ["u", "u", "v", "u", "u", "u"],
        ["b", "b", "b", "b", "c", "c"],
    )
    few, pair = math.sqrt(3 / 2), math.sqrt(2)
    assert [(p.time, p.unit, p.bench) for p in found] == [
        (1.0, "u", "b"), (3.0, "u", "b"), (4.0, "u", "c"), (5.0, "u", "b"), (6.0, "u", "c"),
    ]  # fmt: skip
    assert [p.deviation for p in found] == pytest.approx([-0.5 * few, 0.0, -pair / 17, 0.5 * few, pair / 17])


def test_a_level_of_zero_has_no_shares():
    assert deviations(np.arange(2.0), np.array([1.0, -1.0]), ["u"] * 2, ["b"] * 2) == []


def line(count, *, unit="u", bench="b", start=0.0, step=1.0, slope=0.01):
    return [Point(start + step * k, unit, bench, slope * k) for k in range(count)]


def test_a_trend_needs_eight_values():
    assert drifts(line(7)) == ([], 0)
    found, looked_at = drifts(line(8))
    assert looked_at == 2
    (one,) = found
    assert (one.kind, one.name, one.count, one.alone) == ("unit", "u", 8, True)
    assert (one.change, one.low, one.high) == (pytest.approx(0.07),) * 3
    assert one.p == pytest.approx(2 / math.factorial(8))


def test_a_change_is_the_median_slope_with_the_interval_of_its_rank():
    """Sen 1968: the slopes of all pairs, from the rank (N - C) / 2 to that of (N + C) / 2 and one, C = 1.96 sigma."""
    shares = [0.0, 0.01, 0.03, 0.02, 0.05, 0.08, 0.09, 0.13]
    ((one,), _) = drifts([Point(3.0 * k, "u", "b", share) for k, share in enumerate(shares)])
    slopes = sorted((shares[b] - shares[a]) / (b - a) for a, b in itertools.combinations(range(8), 2))
    reach = 1.96 * math.sqrt(8 * 7 * (2 * 8 + 5) / 18)
    low, high = round((28 - reach) / 2), round((28 + reach) / 2)
    assert one.change == pytest.approx(7 * np.median(slopes))
    assert (one.low, one.high) == (pytest.approx(7 * slopes[low - 1]), pytest.approx(7 * slopes[high]))
    assert one.low < one.change < one.high


def test_a_trend_that_falls_is_one_too():
    ((one,), _) = drifts(line(8, slope=-0.01, start=5.0, step=2.0))
    assert one.change == pytest.approx(-0.07)


def test_values_that_are_all_alike_or_of_one_instant_have_none():
    assert drifts(line(8, slope=0.0)) == ([], 2)
    assert drifts(line(8, step=0.0)) == ([], 2)


def test_the_more_is_looked_at_the_surer_a_trend_has_to_be():
    """One exchange in eight values: p is 16/8!, or 4.0e-4, against 1 % over what is looked at."""
    nearly = line(8)
    nearly[3], nearly[4] = (
        Point(a.time, "u", "b", b.deviation) for a, b in zip(nearly[3:5], nearly[4:2:-1], strict=True)
    )
    ((one,), looked_at) = drifts(nearly)
    assert (looked_at, one.p) == (2, pytest.approx(16 / math.factorial(8)))
    others = [point for k in range(24) for point in line(8, unit=f"v{k}", bench=f"c{k % 2}", slope=0.0)]
    found, looked_at = drifts(nearly + others)
    assert (found, looked_at) == ([], 28)
    found, _ = drifts(nearly + others[: 8 * 16])  # twenty places: 5.0e-4
    assert [one.name for one in found] == ["u"]


def test_series_of_other_measurements_count_as_well():
    """Of eight values that rise, p is 2/8!, or 5.0e-5: of 201 series 1 % is less."""
    assert series_of(line(7)) == 0
    assert series_of(line(8)) == 2
    assert series_of([*line(8), *line(8, unit="v", start=0.5), *line(7, unit="w", bench="c", start=0.2)]) == 3
    found, looked_at = drifts(line(8), 199)
    assert ([one.name for one in found], looked_at) == (["u"], 2)
    assert drifts(line(8), 200) == ([], 2)
    shared = [*line(8), *line(8, unit="v", start=0.5)]
    assert [one.kind for one in drifts(shared, 1000)[0]] == ["bench"]


def test_a_bench_drifts_where_no_single_unit_makes_it():
    shared = [*line(16, unit="u", slope=0.01), *line(16, unit="v", start=0.5, slope=0.01)]
    found, looked_at = drifts(shared)
    assert looked_at == 3
    assert [(one.kind, one.name) for one in found] == [("bench", "b")]
    assert found[0].change == pytest.approx(0.15, rel=0.1)
    one_alone = [*line(16, unit="u", slope=0.01), *line(16, unit="v", start=0.5, slope=0.0)]
    found, _ = drifts(one_alone)
    assert [(one.kind, one.name, one.alone) for one in found] == [("unit", "u", False)]
    few = [*line(16, unit="u", slope=0.01), *line(7, unit="v", start=0.5, slope=0.01)]
    assert [(one.kind, one.name) for one in drifts(few)[0]] == [("unit", "u")]  # without u too few are left


@pytest.mark.parametrize(
    ("order", "kind"),
    [
        ([1, 0, 3, 2, 5, 4, 7, 6], "bench"),  # four exchanges of neighbours: p = 0.014
        ([2, 1, 0, 4, 3, 6, 5, 7], "bench"),  # five: 0.031
        ([2, 1, 0, 4, 3, 6, 7, 5], "unit"),  # six: 0.061
    ],
)
def test_a_bench_drifts_where_the_trend_stays_at_five_percent_without_any_unit(order, kind):
    other = [Point(0.5 + 1.5 * k, "v", "b", 0.02 * place) for k, place in enumerate(order)]
    found, _ = drifts([*line(12, unit="u", slope=0.02), *other])
    assert next(one.kind for one in found if one.name in {"b", "u"}) == kind


@pytest.mark.parametrize(("falling", "kind"), [(0.465, "bench"), (0.47, "unit")])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_unit_of_few_runs_at_both_ends_makes_no_trend_of_a_bench(falling, kind, direction):
    """Sixteen of 400 runs carry a trend whose p-value without them is 0.04, or 0.08."""
    places = []
    for k in range(384):  # each point is below the share `falling` of those before it
        places.insert(k - round(falling * k), k)
    others = [Point(float(k), f"v{k // 4}", "b", direction * 0.01 * place) for k, place in enumerate(places)]
    ends = [Point(at, "u", "b", direction * 0.01 * at) for at in (*range(-8, 0), *range(384, 392))]
    found, looked_at = drifts([*ends[:8], *others, *ends[8:]])
    assert looked_at == 2
    assert found[0].kind == kind


def test_the_trend_of_a_bench_has_to_be_as_sure_as_that_of_a_unit():
    nearly = [3, 0, 1, 2, 5, 4, 7, 6]
    points = [Point(k + 0.5 * (unit == "v"), unit, "b", 0.01 * at) for unit in "uv" for k, at in enumerate(nearly)]
    assert [one.kind for one in drifts(points)[0]] == ["bench"]
    others = [point for k in range(24) for point in line(8, unit=f"v{k}", bench=f"c{k % 2}", slope=0.0)]
    assert drifts([*points, *others]) == ([], 29)


def test_of_a_unit_on_a_bench_that_drifts_what_the_others_did_there_is_taken_out():
    others = [point for k in range(3) for point in line(16, unit=f"v{k}", start=0.2 * k + 0.2)]
    elsewhere = line(16, unit="w", bench="c", start=0.1, slope=-0.05)
    found, _ = drifts(sorted([*line(16, unit="u", slope=0.03), *others, *elsewhere]))
    by_name = {one.name: one for one in found}
    assert [one.kind for one in found][:2] == ["bench", "unit"]
    assert by_name["b"].change == pytest.approx(0.15, rel=0.3)
    assert by_name["u"].change == pytest.approx(0.03 * 15 - 0.01 * 15, rel=0.15)
    assert not by_name["u"].alone


def test_eight_values_of_other_units_are_enough_to_tell_a_bench():
    swings = [Point(float(k), "u", "b", 0.01 * k + 0.03 * (-1) ** k) for k in range(16)]
    found, _ = drifts([*swings, *line(8, unit="v", start=0.5, step=2.0, slope=0.02)])
    assert [(one.kind, one.name) for one in found] == [("bench", "b")]
    found, _ = drifts([*swings, *line(7, unit="v", start=0.5, step=2.0, slope=0.02)])
    assert [(one.kind, one.name) for one in found] == [("unit", "u")]


def test_what_a_bench_did_about_then_is_the_mean_of_the_four_nearest_values():
    """Others that go up and down by fours: two of them would show it, their mean of four does not."""
    swing = (0.1, 0.1, -0.1, -0.1)
    others = [Point(k + 0.5, "v", "b", 0.01 * k + swing[k % 4]) for k in range(-8, 40)]
    found, _ = drifts(sorted([*line(32, unit="u", slope=0.03), *others]))
    u = next(one for one in found if one.name == "u")
    assert (u.change, u.low, u.high) == (pytest.approx(0.02 * 31),) * 3


def test_values_of_long_before_do_not_tell_what_a_bench_did():
    """Four values of others follow each of the unit's within hours; those before are of the day before."""
    day, hour = 24.0, 1.0
    found, _ = drifts(
        [
            point
            for k in range(16)
            for point in (
                Point(day * k, "u", "b", 0.03 * k + 0.03 * (-1) ** k),
                *(Point(day * k + hour * j, "v", "b", 0.01 * k + 0.03 * (-1) ** k) for j in (1, 2, 3, 4)),
            )
        ]
    )
    u = next(one for one in found if one.name == "u")
    assert (u.change, u.low, u.high) == (pytest.approx(0.02 * 15),) * 3
    assert u.p == pytest.approx(2 / math.factorial(16))  # each value is above the one before


def test_a_unit_on_a_bench_of_its_own_is_alone():
    points = [*line(16, unit="u", bench="b"), *line(16, unit="v", bench="c", slope=0.0)]
    ((one,), _) = drifts(points)
    assert (one.name, one.alone) == ("u", True)
    assert Drift("unit", "u", 8, 0.0, 0.0, 0.0, 1.0).alone is False


def anova(values):
    """Return mean squares and freedoms of units, benches, both and error, as they are defined."""
    units, benches, trials = values.shape
    mean, cell = values.mean(), values.mean(axis=2)
    by_unit, by_bench = values.mean(axis=(1, 2)), values.mean(axis=(0, 2))
    squares = (
        benches * trials * sum((by_unit - mean) ** 2),
        units * trials * sum((by_bench - mean) ** 2),
        trials * sum(((cell - by_unit[:, None] - by_bench[None] + mean) ** 2).ravel()),
        sum(((values - cell[:, :, None]) ** 2).ravel()),
    )
    freedoms = (units - 1, benches - 1, (units - 1) * (benches - 1), units * benches * (trials - 1))
    return [s / n for s, n in zip(squares, freedoms, strict=True)], freedoms


def values_with(interaction):
    unit, bench = np.array([0.0, 2.0, 5.0])[:, None, None], np.array([0.0, 0.7])[None, :, None]
    both = interaction * np.array([[1.0, -1.0], [-1.0, 1.0], [0.5, -0.5]])[:, :, None]
    return unit + bench + both + np.array([-0.2, 0.0, 0.2])[None, None, :]


@pytest.mark.parametrize(("interaction", "pooled"), [(0.05, True), (0.6, False)])
def test_a_study_by_its_mean_squares(interaction, pooled):
    values = values_with(interaction)
    (unit, bench, both, error), (n_unit, n_bench, n_both, n_error) = anova(values)
    study = gauge_study(values)
    rows = {row.source: row for row in study.anova}
    assert study.pooled is pooled
    assert list(rows) == ["units", "benches", "units x benches", "repeatability"] + ["pooled"] * pooled
    p = f_distribution.sf(both / error, n_both, n_error)
    assert (p > 0.25) == pooled
    assert (rows["units x benches"].ratio, rows["units x benches"].p) == pytest.approx((both / error, p))
    assert rows["units"].p == pytest.approx(f_distribution.sf(unit / both, n_unit, n_both))
    assert rows["benches"].p == pytest.approx(f_distribution.sf(bench / both, n_bench, n_both))
    assert (rows["repeatability"].ratio, rows["repeatability"].p) == (None, None)
    base = (both * n_both + error * n_error) / (n_both + n_error) if pooled else both
    if pooled:
        assert (rows["pooled"].freedom, rows["pooled"].mean_square) == (n_both + n_error, pytest.approx(base))
    assert study.repeatability == pytest.approx(math.sqrt(base if pooled else error))
    between = max((bench - base) / 9, 0.0) + (0.0 if pooled else (both - error) / 3)
    assert study.reproducibility == pytest.approx(math.sqrt(between))
    assert study.part == pytest.approx(math.sqrt((unit - base) / 6))


def study_of(repeatability, part, reproducibility=None):
    return GaugeStudy(2, 1, 2, (), False, repeatability, reproducibility, part)


@pytest.mark.parametrize(
    ("gauge", "part", "verdict", "categories"),
    [
        (0.09, 1.0, "good", 15),
        (3.0, math.sqrt(100.0 - 9.0), "unsuitable", 4),
        (0.27, 1.0, "usable", 5),
        (0.2821, 1.0, "unsuitable", 4),
        (0.0, 1.0, "unknown", None),
        (6.0, 8.0, "unsuitable", 1),
    ],
)
def test_a_gauge_is_as_good_as_its_share_and_its_categories(gauge, part, verdict, categories):
    study = study_of(gauge, part)
    assert (study.verdict, study.categories) == (verdict, categories)
    assert study.total == pytest.approx(math.hypot(gauge, part))
    assert study_of(0.6 * gauge, part, 0.8 * gauge).gauge == pytest.approx(gauge)


@pytest.mark.parametrize("share", np.linspace(0.28, 1.0, 20))
def test_enough_categories_are_a_usable_share(share):
    """ndc = 1.41 PV / GRR, and GRR and PV are sides of a right triangle: five need a share under 27.2 %."""
    assert study_of(share, math.sqrt(1.0 - share**2)).verdict == "unsuitable"


@pytest.mark.parametrize(("beyond", "verdict"), [(-1e-6, "usable"), (1e-6, "unsuitable")])
def test_the_share_up_to_which_a_gauge_is_usable_is_that_of_its_categories(beyond, verdict):
    share = USABLE + beyond
    assert round(USABLE, 4) == 0.2714
    assert study_of(share, math.sqrt(1.0 - share**2)).verdict == verdict


@pytest.mark.parametrize(
    ("between", "verdict", "categories"), [(0.0, "unknown", None), (0.05, "unknown", 28), (0.4, "unsuitable", 3)]
)
def test_of_repeats_that_do_not_scatter_a_gauge_has_no_verdict_but_that_of_its_benches(between, verdict, categories):
    study = study_of(0.0, 1.0, between)
    assert (study.is_resolved, study.verdict, study.categories) == (False, verdict, categories)
    assert study_of(0.01, 1.0, between).is_resolved


@pytest.mark.parametrize("scale", [0.1, 1.0, 1e-6])
@pytest.mark.parametrize(("trials", "benches"), [(2, 1), (3, 1), (3, 2), (7, 3)])
def test_rounding_is_no_scatter_of_a_gauge(scale, trials, benches):
    """Means of equal values, such as three times 0.1, differ from them by rounding."""
    units = scale * np.array([1.0, 1.1, 1.3, 1.7])
    study = gauge_study(np.broadcast_to(units[:, None, None], (4, benches, trials)))
    assert (study.repeatability, study.gauge, study.verdict) == (0.0, 0.0, "unknown")
    assert study.part == pytest.approx(units.std(ddof=1))
    assert study.share(study.gauge) == 0.0
    same = gauge_study(np.full((4, benches, trials), 0.1 * scale))
    assert (same.part, same.total, same.share(same.gauge)) == (0.0, 0.0, 0.0)


def test_a_share_of_a_tenth_is_usable():
    study = study_of(0.1, math.sqrt(0.99))
    assert study.share(study.gauge) >= 0.1
    assert study.verdict == "usable"
    assert AnovaRow("units", 4, 2.0).mean_square == 0.5


def test_the_largest_crossed_study_is_found():
    assert balanced({}) is None
    assert balanced({("a", "x"): [1.0], ("b", "x"): [2.0]}) is None
    assert balanced({("a", "x"): [1.0, 2.0], ("b", "x"): [2.0]}) is None
    assert balanced({("a", "x"): [1.0, 2.0], ("b", "y"): [2.0, 3.0]}) is None
    units, benches, values = balanced({(u, "x"): [1.0, 2.0, 3.0] for u in "ba"} | {("c", "x"): [5.0, 6.0]})
    assert (units, benches, values.shape) == (["a", "b"], ["x"], (2, 1, 3)) or (len(units), values.shape[2]) == (3, 2)
    assert values.size == 6
    units, benches, values = balanced({(u, b): [1.0, 2.0] for u in "ab" for b in "xy"} | {("c", "y"): [1.0] * 9})
    assert (units, benches, values.tolist()) == (["a", "b"], ["x", "y"], [[[1.0, 2.0]] * 2] * 2)


def crossed(units, benches, runs):
    return {(u, b): [float(k) for k in range(runs)] for u in units for b in benches}


TEN = [f"u{k}" for k in range(10)]
OTHERS = ["x1", "x2"]


@pytest.mark.parametrize(
    ("more", "units", "benches", "trials"),
    [
        (crossed(OTHERS, "C", 3), TEN, "AB", 3),  # a bench with units of its own
        (crossed([TEN[0], *OTHERS], "C", 3), TEN, "AB", 3),  # that shares one unit
        (crossed(TEN[:2], "C", 9), TEN, "AB", 3),  # or two: 2 x 3 x 3 are fewer values
        (crossed(TEN, "C", 3), TEN, "ABC", 3),
        (crossed(OTHERS, "CD", 3), TEN, "AB", 3),
        (crossed([*TEN, *OTHERS], "CD", 3), TEN, "ABCD", 3),
        (crossed([*TEN, *OTHERS], "CD", 9), [*TEN, *OTHERS], "CD", 9),
    ],
)
def test_the_largest_crossed_study_is_that_of_some_benches(more, units, benches, trials):
    found_units, found_benches, values = balanced(crossed(TEN, "AB", 3) | more)
    assert (found_units, found_benches) == (sorted(units), list(benches))
    assert values.shape == (len(units), len(benches), trials)


def test_two_benches_come_before_ten_units_and_these_before_many_values():
    nine = crossed(TEN, "AB", 2) | crossed(TEN[:9], "AB", 9)
    assert balanced(nine)[2].shape == (10, 2, 2)
    del nine["u9", "A"]
    assert balanced(nine)[2].shape == (9, 2, 9)
    assert balanced(crossed(TEN, "A", 9) | crossed(TEN[:2], "B", 2))[2].shape == (2, 2, 2)


def test_of_studies_of_as_many_values_the_one_of_most_units_is_taken():
    assert balanced(crossed("abc", "A", 2) | crossed("ab", "A", 3))[2].shape == (3, 1, 2)
    assert balanced(crossed("abc", "A", 4) | crossed("abcdef", "A", 2))[2].shape == (6, 1, 2)
    assert balanced(crossed("ab", "AB", 3) | crossed("abc", "AB", 2))[:2] == (["a", "b", "c"], ["A", "B"])


def best_by_all_sets(cells):
    """Return the criteria of the largest study, by every set of units and benches."""
    units, benches = ({cell[k] for cell in cells} for k in (0, 1))
    best = None
    for some_units in (c for n in range(2, len(units) + 1) for c in itertools.combinations(units, n)):
        for some in (c for n in range(1, len(benches) + 1) for c in itertools.combinations(benches, n)):
            trials = min(len(cells.get((u, b), ())) for u in some_units for b in some)
            if trials > 1:
                size = (len(some) > 1, len(some_units) * len(some) * trials, len(some_units))
                best = max(best or size, size)
    return best


@given(st.lists(st.lists(st.integers(0, 5), min_size=4, max_size=4), min_size=1, max_size=5))
def test_no_set_of_units_and_benches_is_a_larger_study(counts):
    cells = {
        (f"u{k}", f"b{j}"): [float(n) for n in range(count)]
        for k, row in enumerate(counts)
        for j, count in enumerate(row)
    }
    found = balanced(cells)
    expected = best_by_all_sets(cells)
    assert (found is None) == (expected is None)
    if found is not None:
        units, benches, values = found
        assert (len(benches) > 1, values.size, len(units)) == expected
        assert values.shape[:2] == (len(units), len(benches))
        trials = values.shape[2]
        assert values.tolist() == [[cells[u, b][-trials:] for b in benches] for u in units]


@pytest.mark.parametrize("count", [8, 9, 12])
def test_of_many_benches_those_that_share_units_are_found(count):
    """Most benches have units of their own, three share ten, two more share some of those."""
    benches = [f"b{k:02d}" for k in range(count)]
    cells = {cell: runs for b in benches for cell, runs in crossed([f"{b}u1", f"{b}u2"], [b], 9).items()}
    shared = [benches[1], benches[4], benches[-1]]
    cells |= crossed(TEN, shared, 3) | crossed(TEN[:4], [benches[0], benches[5]], 3)
    assert balanced(cells)[:2] == (TEN, shared)
    alone = {cell: runs for cell, runs in cells.items() if cell[0] not in TEN} | crossed(TEN, benches[3:4], 2)
    units, of, values = balanced(alone)
    assert (units, of, values.shape) == (["b03u1", "b03u2", *TEN], benches[3:4], (12, 1, 2))


def risen(values, warmth, units=None, started=None):
    values, warmth = np.array(values), np.array(warmth, float)
    units = units or ["u"] * len(values)
    started = started or [f"2026-01-{k + 1:02d}" for k in range(len(values))]
    return rises(started, values, warmth, units, unit_laws(values, warmth, units))


def test_a_unit_that_was_measured_once_tells_no_rise():
    assert risen([0.2], [20.0]) is None
    assert risen([0.2, 0.0, -1.0], [20.0] * 3) is None  # what cannot be measured does not count
    assert risen([0.2, 0.3], [20.0] * 2, ["u", "v"]) is None


@pytest.mark.parametrize(("factor", "named"), [(1.11, False), (1.12, True)])
def test_a_unit_has_risen_by_half_of_a_quarter(factor, named):
    told = risen([0.2, 0.2 * factor], [20.0, 20.0])
    assert (told.looked_at, told.limit, told.apart) == (1, pytest.approx(math.expm1(LEVEL)), [])
    assert [(one.unit, one.since) for one in told.found] == ([("u", "2026-01-01")] if named else [])
    assert all(one.rise == pytest.approx(factor - 1.0) for one in told.found)


@pytest.mark.parametrize(("warmer", "compared"), [(5.0, True), (-5.0, True), (5.01, False), (-5.01, False)])
def test_without_a_law_runs_within_five_kelvin_are_compared(warmer, compared):
    told = risen([0.2, 0.3], [20.0, 20.0 + warmer])
    assert told.looked_at == compared
    assert told.apart == ([] if compared else ["u"])
    assert len(told.found) == compared


def test_the_latest_run_that_can_be_compared_is():
    told = risen([0.2, 0.3, 0.2], [20.0, 21.0, 22.0])
    assert (told.found, told.apart) == ([], [])
    told = risen([0.2, 0.3, 0.2], [20.0, 21.0, 40.0])
    assert [one.rise for one in told.found] == pytest.approx([0.5])
    assert told.apart == ["u"]
    told = risen([0.1, 0.2, 0.3], [math.nan, 20.0, 21.0])
    assert [(one.rise, one.since) for one in told.found] == [(pytest.approx(0.5), "2026-01-02")]
    assert risen([0.2, 0.3], [math.nan] * 2).apart == ["u"]


def units_with(slopes):
    """Return values, temperatures and names of units, each tested at 20 and 40 degC, by their slopes."""
    values = [value for slope in slopes for value in (1.0, math.exp(20.0 * slope))]
    return values, [20.0, 40.0] * len(slopes), [f"unit {k // 2}" for k in range(len(values))]


@pytest.mark.parametrize(("warmest", "apart"), [(45.0, []), (45.1, ["u"])])
def test_a_law_compares_no_run_that_it_does_not_carry_to(warmest, apart):
    values, warmth, units = units_with([-0.004] * 3)
    law = math.exp(-0.004 * (warmest - 30.0))
    told = risen([*values, 1.0, law], [*warmth, 30.0, warmest], [*units, "u", "u"])
    assert told.apart == apart


@pytest.mark.parametrize(("share", "named"), [(0.9, []), (1.1, ["u"])])
def test_a_rise_must_exceed_what_the_law_leaves_unsure(share, named):
    values, warmth, units = units_with([-0.0039, -0.004, -0.0041])
    law = unit_laws(np.array(values), np.array(warmth), units).together()
    unsure = float(law.uncertainty(20.0))
    assert unsure > 0.002
    ratio = law.coefficient * 20.0 + LEVEL + share * unsure
    told = risen([*values, 1.0, math.exp(ratio)], [*warmth, 20.0, 40.0], [*units, "u", "u"])
    assert [one.unit for one in told.found] == named


def test_a_unit_is_compared_by_the_law_of_the_others():
    """The others depart by 8 % either way, so that 25 % of one unit count as scatter of a law."""
    values, warmth, units = units_with([0.004, -0.004] * 32)
    values += [1.0, math.exp(0.25)] + [1.0, 1.0] * 80
    warmth += [20.0, 40.0] + [20.0, 20.0] * 80
    units += ["u", "u", *(f"at rest {k // 2}" for k in range(160))]
    assert "u" in unit_laws(np.array(values), np.array(warmth), units).name
    (one,) = risen(values, warmth, units, ["2026-01-01"] * len(values)).found
    assert (one.unit, one.rise) == ("u", pytest.approx(math.expm1(0.25)))


def test_an_interaction_is_pooled_where_its_p_value_exceeds_a_quarter():
    sign = np.array([-1.0, 1.0])
    apart = 3.0 * sign[:, None, None] + sign[None, :, None] + 0.5 * sign[None, None, :]
    together = sign[:, None, None] * sign[None, :, None]
    seen = set()
    for size in np.linspace(0.0, 0.5, 101):
        study = gauge_study(apart + size * together + np.zeros((2, 2, 2)))
        p = next(row.p for row in study.anova if row.source == "units x benches")
        assert study.pooled == (p > 0.25)
        seen.add(round(p, 1))
    assert {0.2, 0.3, 0.4} <= seen


def test_a_gauge_of_five_categories_is_usable_and_one_of_a_tenth_is_good():
    def of(gauge):
        return GaugeStudy(10, 2, 2, (), False, gauge, 0.0, float(np.sqrt(1.0 - gauge**2)))

    assert [of(share).verdict for share in (0.09, 0.11, 0.27, 0.28)] == ["good", "usable", "usable", "unsuitable"]
    assert of(0.27).share(of(0.27).gauge) < USABLE < of(0.28).share(of(0.28).gauge)
