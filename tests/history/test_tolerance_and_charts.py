"""Edges of the statistics: the fewest values that tell something, and each rule one value before it speaks."""

import itertools
import math
from dataclasses import replace

import made_up
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2, norm

from etb_hil.histories.capability import capability
from etb_hil.histories.control_chart import control_chart, nelson_signals
from etb_hil.histories.distribution import PEARSON, Distribution, distribution, normal
from etb_hil.histories.gauge import balanced, gauge_study
from etb_hil.histories.tolerance import change_limit, factor, tolerance_limit

HALF_WAY = 0.5 * math.log(1.25)


@pytest.mark.parametrize("count", [8, 20, 43, 300])
def test_the_tolerance_factor_is_that_of_the_handbook(count):
    """NIST/SEMATECH e-Handbook, 7.2.6.3 (after Natrella 1963), written out for 99 % of a population, 95 % sure."""
    z_content, z_sure = norm.ppf(0.99), norm.ppf(0.95)
    a = 1 - z_sure**2 / (2 * (count - 1))
    b = z_content**2 - z_sure**2 / count
    assert factor(count) == pytest.approx((z_content + math.sqrt(z_content**2 - a * b)) / a, rel=2e-5)


def test_a_tolerance_limit_needs_eight_values_above_zero():
    values = np.exp(np.array([0.1, -0.1] * 4))
    expected = math.exp(factor(8) * math.sqrt(8 * 0.01 / 7))
    assert made_up.of_shares(values) == pytest.approx(expected)
    assert made_up.of_shares(0.17 * values) == pytest.approx(0.17 * expected)  # in any unit
    assert distribution(values[:7], by_shares=True) is None
    assert distribution(np.append(values, 0.0), by_shares=True) is None
    assert distribution(np.append(values, -1.0), by_shares=True) is None


def test_a_change_limit_is_half_way_to_what_matters_unless_units_scatter_by_more():
    quiet, rough = np.array([1e-4, -1e-4] * 4), np.array([0.2, -0.2] * 4)
    assert change_limit(quiet) == pytest.approx(HALF_WAY)
    assert change_limit(rough[:7]) == pytest.approx(HALF_WAY)
    assert change_limit(rough) == pytest.approx(1.4826 * 0.2 * factor(8))
    assert change_limit(rough + 0.5) == pytest.approx(0.5 + 1.4826 * 0.2 * factor(8))


def test_a_chart_is_drawn_from_eight_values_on():
    assert control_chart(np.arange(7.0)) is None
    chart = control_chart(np.array([1.0, 3.0] * 4))
    assert (chart.centre, chart.mean_range) == (2.0, 2.0)
    assert chart.sigma == pytest.approx(2.0 / 1.128)
    assert (chart.low, chart.high) == (pytest.approx(2.0 - 6.0 / 1.128), pytest.approx(2.0 + 6.0 / 1.128))
    assert chart.range_high == pytest.approx(6.534)


def run_up_to(index, speaks):
    """Return how many values in a row up to `index` speak, by a test of each place."""
    count = 0
    while index - count >= 0 and speaks(index - count):
        count += 1
    return count


def said_of(values, index):
    """Return what Nelson's first three tests say of a value, each written out as it is defined."""
    centre = sum(values) / len(values)
    ranges = [abs(b - a) for a, b in itertools.pairwise(values)]
    if abs(values[index] - centre) > 3 * sum(ranges) / len(ranges) / 1.128:
        return "beyond the limits"
    above = run_up_to(index, lambda k: values[k] > centre)
    below = run_up_to(index, lambda k: values[k] < centre)
    if max(above, below) >= 9:
        return f"{max(above, below)} in a row on one side of the centre"
    rising = 1 + run_up_to(index, lambda k: k > 0 and values[k] > values[k - 1])
    falling = 1 + run_up_to(index, lambda k: k > 0 and values[k] < values[k - 1])
    if max(rising, falling) >= 6:
        return f"{max(rising, falling)} in a row {'rising' if rising > falling else 'falling'}"
    return None


@given(st.lists(st.integers(-3, 3), min_size=1, max_size=12), st.lists(st.integers(-40, 40), min_size=4, max_size=30))
def test_the_rules_as_they_are_defined(steps, more):
    """Whole numbers in sixteens, of which the mean is exact: values on the centre and equal ones occur."""
    values = [float(v) for v in (list(np.cumsum(np.repeat(steps, 4))) + more)]
    values = values[: len(values) // 16 * 16] or [0.0, 1.0] * 8
    expected = {k: said for k in range(len(values)) if (said := said_of(values, k)) is not None}
    assert control_chart(np.array(values)).signals == expected


def test_a_chart_of_a_process_that_rises_jumps_and_stays():
    values = (
        [0.0, 6.0] * 4 + [0.0, 1.0, 2.0, 3.0, 4.0, 5.0] + [2.0, 1.0] * 5 + [40.0] + [5.0, 4.0, 3.0, 2.0, 1.0, 0.0, 3.0]
    )
    expected = {k: said for k in range(len(values)) if (said := said_of(values, k)) is not None}
    assert control_chart(np.array(values)).signals == expected
    assert {said.split(" in a row ")[-1] for said in expected.values()} == {
        "rising", "falling", "beyond the limits", "on one side of the centre",
    }  # fmt: skip


@pytest.mark.parametrize(("scale", "offset"), [(1000.0, 0.0), (0.001, 0.0), (1.0, 50.0)])
def test_a_shift_is_found_whatever_the_unit(scale, offset):
    rng = np.random.default_rng(2)
    values = 0.17 + 0.01 * (rng.standard_normal(60) + 2.0 * (np.arange(60) >= 40))
    found = control_chart(values).shifts.signals
    assert found
    assert control_chart(scale * values + offset).shifts.signals == found


@pytest.mark.parametrize("value", [0.1, 0.17, 0.3, 1 / 3, 0.35, -0.3, 0.0, 3e5])
@pytest.mark.parametrize("count", [8, 9, 10, 11, 12, 13, 40])
def test_values_that_do_not_scatter_have_no_signals(value, count):
    """The mean of eleven times 0.3 is 0.29999999999999993, which is below all of them."""
    chart = control_chart(np.full(count, value))
    assert (chart.sigma, chart.signals, chart.is_steady) == (0.0, {}, True)
    rounded = control_chart(value * (1.0 + 1e-15 * np.arange(count)))
    assert (rounded.sigma, rounded.signals, rounded.is_steady) == (0.0, {}, True)
    assert distribution(rounded.values) is None


def test_rounding_is_no_side_of_the_centre():
    """Ten times 0.3 between values as far above as below: their mean is 0.3 but for rounding."""
    values = np.array([0.2, 0.4] * 4 + [0.3] * 11 + [0.4, 0.2] * 4)
    assert 0.0 < abs(values.mean() - 0.3) < 1e-15
    assert control_chart(values).signals == {}


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_value_on_the_limit_is_not_beyond_it(side):
    values = side * np.array([3.0, 0.0, 3.25, 0.0])
    assert nelson_signals(values, 0.0, 1.0) == {2: "beyond the limits"}
    assert nelson_signals(values, 0.0, 0.0) == {}


def test_rounding_is_no_step():
    rising = np.array([0.3, 0.1, 0.2, 0.2 * (1 + 1e-15), 0.2 * (1 + 2e-15), 0.2 * (1 + 3e-15), 0.4, 0.1, 0.3])
    assert control_chart(rising).signals == {}
    steps = np.array([0.3, 0.1, 0.2, 0.21, 0.22, 0.23, 0.4, 0.1, 0.3])
    assert control_chart(steps).signals == {6: "6 in a row rising"}


@pytest.mark.parametrize(("step", "signals"), [(0.5e-12, {}), (2e-12, {6: "6 in a row rising"})])
def test_a_millionth_of_a_millionth_is_rounding(step, signals):
    values = np.array([1.0, -1.0, 0.0, step, 2 * step, 3 * step, 1.0, -1.0, 1.0])
    assert control_chart(values).signals == signals


def test_a_value_on_the_centre_ends_a_run_on_one_side():
    values = [1.0, 2.0] * 4 + [0.0, 1.0, -6.5, -6.5]
    assert sum(values) == 0.0
    assert 9 not in control_chart(np.array(values)).signals
    assert said_of(values, 9) is None


def test_capability_is_the_nearer_limit_over_three_sigma_with_published_intervals():
    values = np.array([10.0, 11.0] * 15)
    chart = control_chart(values)
    found = made_up.of_normal(chart, 4.0, 18.0)
    sigma, overall = 1.0 / 1.128, values.std(ddof=1)
    assert found.count == 30
    assert found.cpk.value == pytest.approx(6.5 / (3 * sigma))
    assert found.ppk.value == pytest.approx(6.5 / (3 * overall))
    assert found.cp.value == pytest.approx(14.0 / (6 * sigma))
    freedom = 0.605 * 29  # of moving ranges: Cryer and Ryan 1990
    for index, degrees in ((found.cpk, freedom), (found.ppk, 29.0)):  # Bissell 1990
        half = norm.ppf(0.975) * math.sqrt(1 / (9 * 30) + index.value**2 / (2 * degrees))
        assert (index.low, index.high) == (pytest.approx(index.value - half), pytest.approx(index.value + half))
    for edge, beyond in ((found.cp.low, 0.025), (found.cp.high, 0.975)):
        assert edge == pytest.approx(found.cp.value * math.sqrt(chi2.ppf(beyond, freedom) / freedom))
    assert made_up.of_normal(chart, 4.5, 17.0).cpk.value == pytest.approx(6.0 / (3 * sigma))
    assert made_up.of_normal(chart, 8.0, None).cpk.value == pytest.approx(2.5 / (3 * sigma))
    assert made_up.of_normal(chart, None, 13.0).cpk.value == pytest.approx(2.5 / (3 * sigma))
    assert made_up.of_normal(chart, 8.0, None).cp is None
    assert made_up.of_normal(chart, None, 13.0).cp is None


def test_capability_widens_by_what_all_values_may_be_off_together():
    chart = control_chart(np.array([10.0, 11.0] * 15))
    sure, unsure = made_up.of_normal(chart, None, 14.0), made_up.of_normal(chart, None, 14.0, unsure=0.3)
    for name, spread in (("cpk", chart.sigma), ("ppk", chart.values.std(ddof=1))):
        narrow, wide = getattr(sure, name), getattr(unsure, name)
        assert narrow.value == wide.value
        half = math.hypot(narrow.high - narrow.value, 0.3 / (3.0 * spread))
        assert wide.high - wide.value == pytest.approx(half)
        assert wide.value - wide.low == pytest.approx(half)


TIMES = np.linspace(0.5, 1.5, 41)  # quantiles of 2.5, 5 and 97.5 % are the second, the third and the last but one
CHART = control_chart(np.array([10.0, 11.0] * 15))  # centre 10.5


def free_shape(low=8.0, median=10.0, most=12.0, high=13.0, times=TIMES):
    """Return a distribution without a formula; those of its replicates are as wide as its own divided by `times`."""
    at = median + (np.array([low, median, most, high]) - median) / np.asarray(times)[:, None]
    return Distribution(PEARSON, 0.5, {}, 30, low, median, most, high, at)


def ends(index):
    return (index.value, index.low, index.high)


@pytest.mark.parametrize(
    ("low", "high", "value", "reach"),
    [(None, 16.0, 2.0, 3.0), (7.0, None, 1.5, 2.0), (7.0, 16.0, 1.5, 2.0), (2.0, 16.0, 2.0, 3.0)],
)
@pytest.mark.parametrize("unsure", [0.0, 0.6])
def test_capability_of_another_family_rests_on_its_quantiles_and_its_bootstrap(low, high, value, reach, unsure):
    """The basic bootstrap in the logarithm (Davison and Hinkley 1997): value squared over the quantiles' ends."""
    found = capability(CHART, free_shape(), low, high, unsure)
    assert found.cpk == found.ppk  # its spread from unit to unit is not known
    below, above = value - value / TIMES[-2], value / TIMES[1] - value
    off = unsure / reach
    expected = (value, value - math.hypot(below, off), value + math.hypot(above, off))
    assert ends(found.ppk) == pytest.approx(expected)
    if low is None or high is None:
        assert found.cp is None
    else:
        cp = (high - low) / 5.0
        assert ends(found.cp) == pytest.approx((cp, cp / TIMES[-2], cp / TIMES[1]))


def test_a_capability_that_may_be_below_zero_has_its_bootstrap_without_a_logarithm():
    times = np.linspace(-0.52, 1.48, 41)
    value = 1.0 / 3.0
    found = capability(CHART, free_shape(times=times), None, 11.0).ppk
    ends_of = value * times[1], value * times[-2]
    assert ends(found) == pytest.approx((value, 2 * value - ends_of[1], 2 * value - ends_of[0]))


def test_the_interval_of_a_normal_family_reaches_as_far_as_that_of_a_free_shape():
    shape = normal(CHART.values)
    inside = CHART.sigma / CHART.values.std(ddof=1)
    closed = capability(CHART, shape, 4.0, 18.0)
    unsure = free_shape(5.0, 10.5, 14.0, 16.0)  # quantiles of bootstrap samples that are far from each other
    wide = capability(CHART, replace(shape, free=unsure), 4.0, 18.0)
    alone = capability(CHART, unsure, 4.0, 18.0)
    for name, times in (("cpk", inside), ("ppk", 1.0), ("cp", inside)):
        found, narrow, free = getattr(wide, name), getattr(closed, name), getattr(alone, name)
        assert found.value == narrow.value
        assert found.low == pytest.approx(min(narrow.low, free.low / times))
        assert found.high == pytest.approx(max(narrow.high, free.high / times))
        assert found.low < narrow.low
    sure = free_shape(8.9, 10.5, 11.9, 12.1, times=np.ones(41))
    narrow = capability(CHART, replace(shape, free=sure), 4.0, 18.0)
    assert (narrow.cpk.low, narrow.ppk.high) == (closed.cpk.low, closed.ppk.high)
    assert capability(CHART, replace(shape, free=unsure), None, 18.0).cp is None


@pytest.mark.parametrize(("low", "high"), [(None, None), (0.0, None), (None, 20.0)])
def test_no_capability_without_a_limit_or_a_distribution(low, high):
    assert capability(CHART, None, low, high) is None
    assert (capability(CHART, normal(CHART.values), low, high) is None) == (low is None and high is None)


def test_tolerance_limit_of_another_family_is_that_of_its_bootstrap():
    """Of the distance from the median, 2 here, times 2 over the 5 % quantile of the replicates' distances."""
    times = 1.0 / np.linspace(0.5, 1.5, 41)
    assert tolerance_limit(free_shape(times=times)) == pytest.approx(10.0 + 2.0 / (0.5 + 2 * 0.025))
    assert tolerance_limit(None) is None


def test_tolerance_limit_of_a_normal_family_is_not_below_that_of_a_free_shape():
    shape = normal(CHART.values)
    limit = 10.5 + factor(30) * CHART.values.std(ddof=1)
    assert tolerance_limit(shape) == pytest.approx(limit)
    low, high = free_shape(most=11.0, times=np.ones(41)), free_shape(most=19.0, times=np.ones(41))
    assert tolerance_limit(replace(shape, free=low)) == pytest.approx(limit)
    assert tolerance_limit(replace(shape, free=high)) == pytest.approx(19.0)


@pytest.mark.parametrize(("count", "preliminary"), [(24, True), (25, False)])
def test_a_capability_of_fewer_than_25_units_is_preliminary(count, preliminary):
    values = np.resize([10.0, 11.0], count)
    assert made_up.of_normal(control_chart(values), None, 14.0).is_preliminary is preliminary


def test_no_capability_without_spread():
    assert made_up.of_normal(control_chart(np.ones(9)), 0.0, 2.0) is None


def test_a_gauge_tells_so_many_groups_of_units_apart():
    rng = np.random.default_rng(21)
    unit, bench = rng.normal(0, 5, (10, 1, 1)), rng.normal(0, 0.5, (1, 3, 1))
    study = gauge_study(unit + bench + rng.normal(0, 0.4, (10, 3, 3)))
    assert (study.units, study.benches, study.trials) == (10, 3, 3)
    assert study.gauge == pytest.approx(math.sqrt(study.repeatability**2 + study.reproducibility**2))
    assert study.total == pytest.approx(math.sqrt(study.gauge**2 + study.part**2))
    assert study.share(study.part) == pytest.approx(study.part / study.total)
    assert study.categories == math.floor(1.41 * study.part / study.gauge) > 1


def test_gauge_of_benches_that_repeat_exactly():
    values = np.zeros((3, 2, 2)) + np.array([0.0, 1.0, 2.0])[:, None, None]
    study = gauge_study(values)
    assert (study.gauge, study.categories, study.verdict) == (0.0, None, "unknown")
    assert all(row.ratio is None for row in study.anova)
    assert study.part == pytest.approx(1.0)


def test_one_bench_has_its_units_and_its_repeats_only():
    rng = np.random.default_rng(22)
    values = rng.normal(0, 2, (6, 1, 1)) + rng.normal(0, 0.1, (6, 1, 4))
    study = gauge_study(values)
    assert [row.source for row in study.anova] == ["units", "repeatability"]
    assert (study.units, study.benches, study.trials) == (6, 1, 4)
    assert not study.pooled
    within = values.var(axis=2, ddof=1).mean()
    between = 4 * values.mean(axis=(1, 2)).var(ddof=1)
    assert study.repeatability == pytest.approx(math.sqrt(within))
    assert study.part == pytest.approx(math.sqrt((between - within) / 4))
    assert study.anova[0].ratio == pytest.approx(between / within)


def test_an_interaction_counts_as_reproducibility():
    """Random effects, by their expected mean squares (AIAG, Measurement Systems Analysis, appendix A)."""
    cell = np.array([[0.0, 3.0, 1.0], [4.0, 1.0, 2.0], [2.0, 2.0, 7.0], [9.0, 5.0, 6.0]])
    trial = np.array([-0.1, 0.1])
    study = gauge_study(cell[:, :, None] + trial)
    units, benches, trials = 4, 3, 2
    mean = cell.mean()
    both = trials * ((cell - cell.mean(1, keepdims=True) - cell.mean(0) + mean) ** 2).sum() / 6
    bench = units * trials * ((cell.mean(0) - mean) ** 2).sum() / 2
    unit = benches * trials * ((cell.mean(1) - mean) ** 2).sum() / 3
    error = 24 * 0.01 / 12
    assert not study.pooled
    assert study.repeatability == pytest.approx(math.sqrt(error))
    between = max((bench - both) / (units * trials), 0.0)
    assert study.reproducibility == pytest.approx(math.sqrt(between + (both - error) / trials))
    assert study.part == pytest.approx(math.sqrt(max((unit - both) / (benches * trials), 0.0)))


def test_negative_variances_count_as_zero():
    values = np.array([[[0.0, 2.0], [2.0, 0.0]], [[2.0, 0.0], [0.0, 2.0]], [[0.0, 2.0], [0.0, 2.0]]])
    study = gauge_study(values)
    assert (study.reproducibility, study.part) == (0.0, 0.0)


@given(st.integers(2, 6), st.integers(2, 4), st.integers(2, 4), st.integers(0, 2**31))
def test_the_anova_takes_the_whole_variation_apart(units, benches, trials, seed):
    values = np.random.default_rng(seed).normal(size=(units, benches, trials))
    rows = {row.source: row for row in gauge_study(values).anova}
    sources = ("units", "benches", "units x benches", "repeatability")
    assert sum(rows[s].squares for s in sources) == pytest.approx(((values - values.mean()) ** 2).sum())
    assert sum(rows[s].freedom for s in sources) == values.size - 1


def test_more_benches_come_before_more_values():
    cells = {("a", "x"): [1.0, 2.0, 3.0], ("b", "x"): [4.0, 5.0, 6.0], ("a", "y"): [7.0, 8.0], ("b", "y"): [9.0, 10.0]}
    units, benches, values = balanced(cells)
    assert (units, benches, values.tolist()) == (
        ["a", "b"],
        ["x", "y"],
        [[[2.0, 3.0], [7.0, 8.0]], [[5.0, 6.0], [9.0, 10.0]]],
    )
    units, benches, values = balanced({**cells, ("b", "y"): [9.0]})
    assert (units, benches, values.tolist()) == (["a", "b"], ["x"], [[[1.0, 2.0, 3.0]], [[4.0, 5.0, 6.0]]])


def test_benches_that_share_one_unit_alone_are_no_study_together():
    cells = {(u, "x"): [1.0, 2.0] for u in "abc"} | {(u, "y"): [1.0, 2.0] for u in "cd"}
    units, benches, _ = balanced(cells)
    assert (units, benches) == (["a", "b", "c"], ["x"])


@pytest.mark.parametrize(
    ("noise", "verdict"), [(0.05, "good"), (0.2, "usable"), (0.33, "unsuitable"), (0.5, "unsuitable")]
)
def test_a_gauge_has_its_verdict(noise, verdict):
    # Ten units that scatter by about 1, each repeated at -noise, 0 and +noise: nothing of it is drawn at random.
    units = np.linspace(-1.5, 1.5, 10)[:, None, None]
    repeats = noise * np.array([-1.0, 0.0, 1.0])[None, None, :]
    study = gauge_study(np.broadcast_to(units + repeats, (10, 2, 3)))
    assert study.verdict == verdict
    assert (study.share(study.gauge) < 0.1) == (verdict == "good")
    assert study.categories >= 5 or verdict == "unsuitable"
