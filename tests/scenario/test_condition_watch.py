"""Conditions: which sample fires each kind, that no cut of the stream changes it, and that gaps prove nothing."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.recording.samples import SampleBlock
from etb_hil.scenario.condition import Condition
from etb_hil.scenario.condition_watch import ConditionWatch

MS = 1_000_000


def condition(role="motor_current", **settings):
    return Condition.model_validate({"role": role, **{key.rstrip("_"): value for key, value in settings.items()}})


def block(values, lost=(), role="motor_current", start_ms=1):
    n = len(values)
    time_ns = (np.arange(n, dtype=np.int64) + start_ms) * MS
    missing = np.zeros(n, np.int64)
    for index in lost:
        missing[index] = 1
    return SampleBlock("m", time_ns, time_ns + 300_000, {role: np.asarray(values, float)}, missing)


def fired_at(wanted, values, since_ns=0, **how):
    fired = ConditionWatch(wanted, since_ns).push([block(values, **how)])
    return None if fired is None else (fired.stamp_ns - 300_000) // MS - 1


@pytest.mark.parametrize(
    ("wanted", "values", "index"),
    [
        (condition(above="2 A"), [3, 1], 0),
        (condition(above="2 A"), [2, 1, 2.5], 2),
        (condition(below="2 A"), [2, 3, 1.9], 2),
        (condition(rises_above="2 A"), [3, 3, 1, 3], 3),
        (condition(rises_above="2 A"), [3, 3, 3], None),
        (condition(falls_below="-1 A"), [-2, 0, -2], 2),
        (condition(inside=["1 A", "2 A"]), [0, 2.5, 1], 2),
        (condition(outside=["1 A", "2 A"]), [1, 2, 0.9], 2),
        (condition(above="2 A", for_="3 ms"), [3, 3, 3, 1, 3, 3, 3, 3, 3], 7),
        (condition(rises_above="2 A", for_="1 ms"), [3, 1, 3, 1, 3, 3], 5),
        (condition(above="2 A"), [math.nan, 1, math.nan], None),
        (condition(rises_above="2 A"), [math.nan, 3, 3], None),
        (condition(above="2 A", for_="2 ms"), [3, math.nan, 3, 3, 3], 4),
    ],
)
def test_the_sample_that_fires(wanted, values, index):
    assert fired_at(wanted, values) == index


def test_a_gap_starts_the_time_anew():
    wanted = condition(above="2 A", for_="3 ms")
    assert fired_at(wanted, [3] * 8) == 3
    assert fired_at(wanted, [3] * 8, lost=[2]) == 5


def test_samples_before_and_after_the_phase_do_not_count():
    watch = ConditionWatch(condition(above="2 A"), 3 * MS)
    watch.until_ns = 5 * MS
    assert watch.push([block([3, 3, 3, 0, 0, 3, 3])]).stamp_ns == 3 * MS + 300_000
    watch = ConditionWatch(condition(above="2 A"), 4 * MS)
    watch.until_ns = 5 * MS
    assert watch.push([block([3, 3, 3, 0, 3, 3])]) is None


def test_a_clock_that_was_set_back_hides_no_sample_of_the_phase():
    """Stamps 1, 2, 9, 4, 5, 12 ms: what came after the 9 belongs to a phase that began at 8 ms, wherever it is cut."""
    whole = block([0, 0, 0, 3, 0, 0])
    whole.stamp_ns[:] = np.array([1, 2, 9, 4, 5, 12]) * MS
    for cut in range(7):
        watch = ConditionWatch(condition(above="2 A"), 8 * MS)
        fired = watch.push([whole.select(slice(0, cut)), whole.select(slice(cut, None))])
        assert fired is not None
        assert fired.stamp_ns == 9 * MS


def test_what_fired_first_stays():
    watch = ConditionWatch(condition(above="2 A"), 0)
    assert watch.push([block([1, 3]), block([4], start_ms=3)]).value == 3.0
    assert watch.push([block([5], start_ms=4)]).value == 3.0


def test_only_one_source_of_a_role_counts():
    watch = ConditionWatch(condition(above="2 A"), 0, "m")
    other = block([3])
    other.source = "another message"
    assert watch.push([other, block([1, 4])]).value == 4.0


def test_other_roles_are_left_alone():
    assert ConditionWatch(condition(above="2 A"), 0).push([block([3], role="supply_voltage")]) is None


def test_a_signal_settles_when_its_trend_is_flat():
    time = np.arange(4000) * 1e-3
    warming = 20.0 + 30.0 * (1.0 - np.exp(-time / 0.5)) + np.random.default_rng(1).normal(0.0, 0.2, len(time))
    wanted = condition("temperature", settles_within="0.5 K", over="1 s")
    index = fired_at(wanted, warming, role="temperature")
    # the trend over a second is 0.5 K where 30 exp(-t/0.5) has fallen so far; the fit looks half a second back
    slope_at_middle = 60.0 * math.exp(-(index * 1e-3 - 0.5) / 0.5)
    assert slope_at_middle == pytest.approx(0.5, rel=0.35)
    assert fired_at(wanted, np.full(900, 20.0), role="temperature") is None  # not seen for a second yet
    assert fired_at(wanted, np.full(1100, 20.0), role="temperature") == 1000


@pytest.mark.parametrize(("within", "sign", "index"), [("5 A", 1.0, 20), ("5 A", -1.0, 20), ("4.9 A", -1.0, None)])
def test_a_signal_settles_within_what_its_trend_changes_by_in_either_direction(within, sign, index):
    """The ramp of 0.25 A a sample changes by 5 A in 20 ms."""
    assert fired_at(condition(settles_within=within, over="20 ms"), sign * 0.25 * np.arange(60)) == index


def test_half_a_kelvin_is_half_a_degree():
    for unit in ("K", "degC"):
        assert condition("temperature", settles_within=f"0.5 {unit}", over="1 s").settles_within == pytest.approx(0.5)


values = st.lists(st.one_of(st.floats(-3, 3), st.just(math.nan)), min_size=1, max_size=60)
conditions = st.sampled_from(
    [
        condition(above="1 A", for_="3 ms"),
        condition(rises_above="0.5 A"),
        condition(outside=["-1 A", "1 A"], for_="2 ms"),
        condition(settles_within="0.4 A", over="20 ms"),
    ]
)


@given(values, conditions, st.lists(st.integers(0, 60), max_size=8), st.lists(st.integers(0, 59), max_size=3))
def test_no_cut_of_the_stream_changes_what_fires(series, wanted, cuts, lost):
    whole = block(series, lost=[index for index in lost if index < len(series)])
    once = ConditionWatch(wanted, 4 * MS).push([whole])
    cut = ConditionWatch(wanted, 4 * MS)
    edges = sorted({0, len(series), *(c for c in cuts if c < len(series))})
    for start, end in pairwise(edges):
        cut.push([whole.select(slice(start, end))])
    assert cut.fired == once


def settled_at(series, within, bins=10, each=2):
    """Return the sample at which the line through the means of the last bins first changes by no more than that."""
    for end in range(bins * each, len(series), each):
        means = np.reshape(series[end - bins * each : end], (bins, each)).mean(axis=1)
        if abs(np.polyfit(np.arange(bins), means, 1)[0] * bins) <= within:
            return end
    return None


@given(st.lists(st.integers(-3, 3), min_size=1, max_size=90), st.integers(0, 12))
def test_a_trend_is_the_straight_line_through_the_means_of_its_tenths(steps, drift):
    """Whole numbers and a limit between those that a line through them can have."""
    series = np.cumsum(steps) + 0.37 * drift * np.arange(len(steps))
    within = 1.0 + 1e-7
    assert fired_at(condition(settles_within=f"{within} A", over="20 ms"), series) == settled_at(series, within)


@pytest.mark.parametrize(("gap_ns", "index"), [(3 * MS - 1, 19), (3 * MS, 30)])
def test_a_tenth_without_a_sample_starts_a_trend_anew(gap_ns, index):
    """Tenths of 2 ms begin at the first sample, at 1 ms: the one from 11 to 13 ms has a sample just so, or has none.

    20 ms then count from the first sample, or from the one at 13 ms.
    """
    whole = block(np.zeros(60))
    whole.time_ns[10:] += gap_ns - MS
    wanted = condition(settles_within="0.1 A", over="20 ms")
    assert ConditionWatch(wanted, 0).push([whole]).stamp_ns == whole.stamp_ns[index]


def test_a_bad_sample_neither_ends_a_trend_nor_counts_in_it():
    series = np.where(np.arange(30) % 2, math.nan, 5.0)
    assert fired_at(condition(settles_within="0.1 A", over="20 ms"), series) == 20
    late = np.zeros(40)
    late[20:] = math.nan
    assert fired_at(condition(settles_within="0.1 A", over="20 ms", for_="1 ms"), [*late[:20], 0.0, *late[21:]]) == 21
