"""How fast the plate moves: every sample is looked at, and the cuts of the stream change nothing."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from etb_hil.base.stock import find
from etb_hil.bench.bench_file import load_bench
from etb_hil.bench.speed_watch import SpeedWatch
from etb_hil.bench.supervision import Supervisor
from etb_hil.recording.samples import SampleBlock


def encoder(time_ns, angle):
    time_ns = np.asarray(time_ns, np.int64)
    return SampleBlock(
        "s", time_ns, time_ns, {"motor_angle": np.asarray(angle, float)}, np.zeros(len(time_ns), np.int64)
    )


@settings(max_examples=100)
@given(st.data())
def test_speed_is_that_of_every_sample_however_the_stream_is_cut(data):
    count = data.draw(st.integers(1, 60))
    gaps = data.draw(st.lists(st.integers(-9, 4), min_size=count, max_size=count))
    time_ns = np.cumsum([1_000_000 * (gap if gap >= 0 or gap == -9 else 1) for gap in gaps])
    angle = np.array(data.draw(st.lists(st.floats(-9, 9) | st.just(math.nan), min_size=count, max_size=count)))
    cuts = sorted(data.draw(st.lists(st.integers(0, count), max_size=8)))
    watch, whole = SpeedWatch(), SpeedWatch()
    parts = zip([0, *cuts], [*cuts, count], strict=True)
    seen = [watch.push(encoder(time_ns[a:b], angle[a:b])) for a, b in parts]
    newest, peak = whole.push(encoder(time_ns, angle))
    assert seen[-1][0] == newest
    assert max(abs(part) for _, part in seen) == abs(peak)
    assert abs(peak) == pytest.approx(max(_speeds(time_ns, angle), default=0.0))


def _speeds(time_ns, angle):
    """Yield the speed of each sample that another is 5 ms older than, since the clock was last set back."""
    rows = [row for row in zip(time_ns.tolist(), angle.tolist(), strict=True) if not math.isnan(row[1])]
    for at, (now, here) in enumerate(rows):
        back = max((k for k in range(1, at + 1) if rows[k][0] < rows[k - 1][0]), default=0)
        older = [row for row in rows[back:at] if now - row[0] >= 5_000_000]
        if older:
            yield abs(here - older[-1][1]) / ((now - older[-1][0]) * 1e-9)


def test_a_spike_of_speed_inside_a_beat_stops_the_run():
    limits = load_bench(find("bench", "virtual_classic")).bench.limits
    time_ns = np.arange(20) * 1_000_000
    calm = np.zeros(20)
    jump = np.where((time_ns > 5_000_000) & (time_ns < 12_000_000), 18.0 * limits.velocity * 6e-3, 0.0)
    for angle, trips in ((calm, False), (jump, True)):
        trip = Supervisor(limits, 18.0, 0).look([encoder(time_ns, angle)])
        assert (trip is not None and trip.reason_id == "velocity_limit") == trips


def test_a_speed_has_its_sign_and_is_zero_where_nothing_is_older():
    watch = SpeedWatch()
    assert watch.push(encoder([0, 4_999_999], [5.0, 7.0])) == (0.0, 0.0)
    assert watch.push(encoder([5_000_000], [5.0 - 2e-3])) == (pytest.approx(-0.4), pytest.approx(-0.4))
    assert watch.push(encoder([], np.empty(0))) == (pytest.approx(-0.4), 0.0)


def test_of_an_older_and_a_newer_sample_the_newer_one_counts():
    """The sample to compare with is 5 ms older or more, and the newest of these."""
    watch = SpeedWatch()
    watch.push(encoder([0, 1_000_000, 2_000_000], [0.0, 1.0, 3.0]))
    assert watch.push(encoder([6_000_000], [1.005]))[0] == pytest.approx(1.0)
    watch.push(encoder([6_500_000], [9.0]))
    newest, peak = watch.push(encoder([7_000_000, 11_500_000], [3.0 + 5e-4, 9.0]))
    assert (newest, peak) == (0.0, pytest.approx(0.1))
