"""Samples of several sources meet on one clock, however they arrive."""

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import LOSS_UNKNOWN, Joiner, SampleBlock


def block(source, role, times, stamp_after=0):
    time_ns = np.array(times, np.int64)
    values = time_ns * 0.5
    return SampleBlock(source, time_ns, time_ns + stamp_after, {role: values}, np.zeros(len(time_ns), np.int64))


def cut(samples, edges):
    edges = sorted({min(e, len(samples)) for e in edges} | {0, len(samples)})
    return [samples.select(slice(a, b)) for a, b in pairwise(edges)]


subset = st.sets(st.integers(0, 60), max_size=50).map(sorted)
cuts = st.lists(st.integers(0, 50), max_size=6)


@given(subset, subset, cuts, cuts, st.randoms())
def test_rows_are_the_common_instants_for_any_chunks(first, second, cuts_a, cuts_b, order):
    parts = [(0, b) for b in cut(block("a", "motor_current", first), cuts_a)]
    parts_b = [(1, b) for b in cut(block("b", "motor_angle", second), cuts_b)]
    queue = [parts, parts_b]
    joiner, rows = Joiner(["a", "b"]), []
    while any(queue):
        source = order.choice([q for q in queue if q])
        joined = joiner.push([source.pop(0)[1]])
        if joined is not None:
            rows.append(joined)
    got = [int(t) for joined in rows for t in joined.time_ns]
    assert got == sorted(set(first) & set(second))
    for joined in rows:
        assert list(joined.columns["motor_current"]) == [t * 0.5 for t in joined.time_ns]
        assert set(joined.columns) == {"motor_current", "motor_angle"}
    lost = [int(n) for joined in rows for n in joined.lost_before]
    assert lost == [missing_before(t, got, first, second) for t in got]


def missing_before(time, rows, *sources):
    """Count, per source, what lies between the row before and this one."""
    earlier = max((t for t in rows if t < time), default=-1)
    return max(sum(earlier < t < time for t in source) for source in sources)


def test_other_sources_are_left_alone_and_missing_instants_are_counted():
    joiner = Joiner(["a", "b"])
    assert joiner.push([block("c", "temperature", [1, 2])]) is None
    joined = joiner.push([block("a", "motor_current", [1, 2, 3], 5), block("b", "motor_angle", [1, 3], 7)])
    assert list(joined.time_ns) == [1, 3]
    assert list(joined.stamp_ns) == [8, 10]
    assert list(joined.lost_before) == [0, 1]


def test_losses_of_both_sources_add_up_and_unknown_stays_unknown():
    first, second = block("a", "motor_current", [1, 3, 4, 9]), block("b", "motor_angle", [1, 2, 4, 9])
    first.lost_before[1] = 1  # 2 was lost
    second.lost_before[2] = 1  # 3 was lost
    second.lost_before[3] = LOSS_UNKNOWN
    joined = Joiner(["a", "b"]).push([first, second])
    assert list(joined.time_ns) == [1, 4, 9]
    assert list(joined.lost_before) == [0, 2, LOSS_UNKNOWN]


def test_a_recording_gives_series_joins_and_gaps():
    recording = Recording("test", ClockGrade.SAMPLE_COUNTER)
    lossy = block("b", "motor_angle", [0, 10, 40])
    lossy.lost_before[2] = 2
    recording.append([block("a", "motor_current", [0, 10]), lossy])
    recording.append([block("a", "motor_current", [20, 40])])
    assert recording.roles == ["motor_current", "motor_angle"]
    assert list(recording.series("motor_current").time_ns) == [0, 10, 20, 40]
    assert list(recording.joined(["motor_current", "motor_angle"]).time_ns) == [0, 10, 40]
    (gap,) = recording.gaps()
    assert (gap.source, gap.start_ns, gap.end_ns, gap.lost) == ("b", 10, 40, 2)
