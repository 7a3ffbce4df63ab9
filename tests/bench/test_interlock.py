"""The interlock: the bridge goes on only behind a closed guard, and off when it opens or is not heard of."""

import numpy as np
import pytest
from guards import Guard, guarded_bench
from whole_run import files

from etb_hil.base.stock import find
from etb_hil.bench import job as job_room
from etb_hil.bench.bench_file import load_bench
from etb_hil.bench.interlock import Interlock
from etb_hil.bench.job import execute, prepare
from etb_hil.canio.bus.link import VirtualLink
from etb_hil.canio.bus.virtual_network import VirtualNetwork
from etb_hil.controller.virtual_controller import VirtualController
from etb_hil.recording.samples import SampleBlock

MS = 1_000_000


@pytest.fixture
def guarded(tmp_path):
    return guarded_bench(tmp_path)


def run_behind(guard, guarded, tmp_path, monkeypatch):
    job = prepare(files(bench=guarded, scenario="paper_step"))
    bus = job.setup.bench.bus
    network = VirtualNetwork(int(bus.bitrate), int(bus.data_bitrate), fd=bus.fd)
    unguarded = load_bench(find("bench", "virtual_classic")).dialect
    network.attach(VirtualController(job.unit, unguarded, 1, nominal=job.model))
    network.attach(guard, answers=False)
    monkeypatch.setattr(job_room, "connect", lambda _job, _seed: (VirtualLink(network), network.clock))
    return execute(job, tmp_path, "", 1)


def test_a_virtual_bench_has_its_guard_closed(guarded, tmp_path):
    finished = execute(prepare(files(bench=guarded, scenario="paper_step")), tmp_path, "", 1)
    assert finished.results.bench.outcome == "ok"


@pytest.mark.parametrize(
    ("guard", "reason"), [(Guard(2.0), "interlock_open"), (Guard(9.0, ends=2.0), "interlock_silent")]
)
def test_a_guard_that_opens_ends_the_run_with_the_drive_off(guard, reason, guarded, tmp_path, monkeypatch):
    finished = run_behind(guard, guarded, tmp_path, monkeypatch)
    bench = finished.results.bench
    assert (bench.outcome, bench.reason_id, bench.safe_state) == ("fault", reason, True)
    enabled = finished.analysis.recording.series("enable")
    origin = finished.record.start_ns
    off = enabled.time_ns[np.flatnonzero(enabled.values == 1.0)[-1]]
    slack = 0.12 if reason == "interlock_silent" else 0.03  # a frame of the guard, two beats and a status
    assert 1.9 < (off - origin) * 1e-9 < 2.0 + slack


def test_behind_an_open_guard_nothing_ever_moves(guarded, tmp_path, monkeypatch):
    finished = run_behind(Guard(0.0), guarded, tmp_path, monkeypatch)
    assert finished.results.bench.reason_id == "interlock_open"
    assert finished.analysis.recording.series("enable").values.max() == 0.0


def block(stamp_ns, *values):
    stamps = np.full(len(values), stamp_ns)
    return SampleBlock("CellGuard", stamps, stamps, {"interlock": np.array(values)}, np.zeros(len(values), np.int64))


def test_one_open_or_bad_sample_is_enough():
    interlock = Interlock(100 * MS)
    assert interlock.trip(0).reason_id == "interlock_silent"
    interlock.push([block(10 * MS, 1.0, 1.0)])
    assert interlock.trip(50 * MS) is None
    assert interlock.trip(111 * MS).reason_id == "interlock_silent"
    for values in ((1.0, 0.0, 1.0), (np.nan,)):
        interlock.push([block(20 * MS, *values)])
        assert interlock.trip(21 * MS).reason_id == "interlock_open"
    interlock.push([block(30 * MS, 1.0)])
    assert interlock.trip(31 * MS) is None


@pytest.mark.parametrize(("value", "is_closed"), [(0.4, False), (0.5, False), (0.6, True)])
def test_an_interlock_is_closed_above_one_half(value, is_closed):
    interlock = Interlock(100 * MS)
    interlock.push([block(10 * MS, value)])
    assert (interlock.trip(11 * MS) is None) is is_closed


def test_a_sample_stamped_in_the_future_does_not_keep_a_silent_interlock_closed():
    interlock = Interlock(100 * MS)
    interlock.push([block(500 * MS, 1.0)])
    assert interlock.trip(399 * MS).reason_id == "interlock_silent"
    assert interlock.trip(401 * MS) is None


def test_blocks_without_a_sample_of_the_interlock_say_nothing():
    interlock = Interlock(100 * MS)
    interlock.push([block(10 * MS, 1.0)])
    other = SampleBlock("EtbStatus", np.array([20 * MS]), np.array([20 * MS]), {}, np.zeros(1, np.int64))
    interlock.push([block(20 * MS), other])
    assert interlock.trip(110 * MS) is None
    assert interlock.trip(110 * MS + 1).reason_id == "interlock_silent"


def test_an_interlock_that_opens_and_closes_between_two_beats_has_opened():
    interlock = Interlock(100 * MS)
    interlock.push([block(1 * MS, 0.0), block(2 * MS, 1.0)])
    assert interlock.trip(3 * MS).reason_id == "interlock_open"
    interlock.push([block(4 * MS, 1.0)])
    assert interlock.trip(5 * MS) is None
