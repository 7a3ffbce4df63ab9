"""A bench driven from own code: whatever happens inside the block, the drive is off at its end and seen to be off."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest

import etb_hil as etb

PATIENCE_S = 120.0  # for a loaded machine that has to compile first
IDLE_S = 600.0  # between two orders likewise, and other tests may run there


def sessions_of(folder):
    return sorted(path.parent for path in folder.glob("*/session.json"))


def results_of(folder):
    """Wait for the only session in a folder to have results, and return them."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        for session in sessions_of(folder):
            if (session / "results.json").is_file():
                return json.loads((session / "results.json").read_text())
        time.sleep(0.05)
    raise AssertionError(f"no results in {folder}: {list(folder.rglob('*'))}")


def ended_as(folder, reason_id):
    """Assert that a run ended before its time, for a reason, in a safe state that was seen."""
    results = results_of(folder)
    assert results["bench"]["reason_id"] == reason_id
    assert results["bench"]["outcome"] == "aborted"
    assert results["bench"]["safe_state"] is True
    assert results["unit"]["verdict"] is None
    return results


@pytest.fixture(scope="module")
def tested(tmp_path_factory):
    """A faulty unit, tested by a few motions of one's own."""
    folder = tmp_path_factory.mktemp("own")
    with etb.connect("virtual_classic", unit="faulty", folder=folder, serial="Q-1", idle=IDLE_S) as bench:
        zero = bench.current_zero("0.5 s")
        moved = bench.move("20 deg")
        bench.ramp(("20 deg", "60 deg"), "0.3 rad/s", repeat=2)
        held = bench.hold("0.2 s")
        so_far = bench.diagnose(limits="default")
        bench.phase(
            "dash", between=["25 deg", "65 deg"], against="0.5 rad/s", peak="7.5 rad/s", rise="40 ms", fall="40 ms",
            settle="0.1 s",
        )  # fmt: skip
        bench.off("0.3 s")
        released = bench.hold("0.2 s")
    return bench, so_far, (zero, moved, held, released)


def test_motions_are_made_and_seen(tested):
    bench, _, (zero, moved, held, released) = tested
    limp_home = etb.Model.load("default").values.limp_home
    assert zero.angle == pytest.approx(limp_home, abs=0.02)
    assert moved.angle == pytest.approx(0.349, abs=0.03)
    assert held.angle == pytest.approx(0.349, abs=0.03)
    assert released.current == pytest.approx(0.0, abs=0.05)
    assert zero.time < moved.time < held.time < released.time
    assert bench.seen == released


def test_the_verdict_so_far_and_in_the_end(tested):
    bench, so_far, _ = tested
    assert so_far.verdict is etb.UnitVerdict.FAIL
    assert so_far.measurements["T_st"].value == pytest.approx(0.567, rel=0.05)
    run = bench.run
    assert run.verdict is etb.UnitVerdict.FAIL
    assert run.result.bench.safe_state is True
    assert [phase.name for phase in run.result.phases] == ["current zero", "hold", "ramp", "hold", "dash", "off", "off"]
    assert bench.diagnose().measurements == run.measurements


def test_the_session_is_one_as_any_other(tested):
    bench, _, _ = tested
    (one,) = etb.replay(bench.run.folder)
    assert (one.verdict, one.differs, one.serial) == (etb.UnitVerdict.FAIL, "", "Q-1")
    assert etb.read(bench.run.folder)["motor_current"].values.size > 1000
    assert bench.run.report().is_file()


@pytest.mark.parametrize(
    ("order", "said"),
    [
        (lambda bench: bench.move("200 deg"), "outside the bench's limits"),
        (lambda bench: bench.move("30 deg", speed="900 rad/s"), "velocity is outside the bench's limits"),
        (lambda bench: bench.move("30 m"), "position"),
        (lambda bench: bench.hold("-1 s"), "duration"),
        (lambda bench: bench.phase("dance"), "dance"),
        (lambda bench: bench.phase("hold", position="20 deg", duration="1 s", nonsense=1), "nonsense"),
        (lambda bench: bench.phase("off", id="zero", duration="1 s"), "stands twice"),
        (lambda bench: bench.phase("prompt", text="?"), "scenario files"),
        (lambda bench: bench.phase("off", duration="1 s", until={"role": "temperature"}), "scenario files"),
        (lambda bench: bench.phase("off", duration=object()), "allowed: text, number"),
        (lambda bench: bench.__enter__(), "entered before"),
    ],
)
def test_a_wrong_order_is_refused_and_the_bench_goes_on(one_bench, order, said):
    before = one_bench.seen
    with pytest.raises(etb.InputError, match=said):
        order(one_bench)
    assert one_bench.seen == before


@pytest.fixture(scope="module")
def one_bench(tmp_path_factory):
    with etb.connect(folder=tmp_path_factory.mktemp("own"), idle=IDLE_S) as bench:
        bench.phase("off", id="zero", duration="0.2 s")
        yield bench


def _fail(folder, error):
    with etb.connect(folder=folder, idle=IDLE_S) as bench:
        bench.move("30 deg")
        raise error


@pytest.mark.parametrize(
    "error",
    [ValueError("my mistake"), KeyboardInterrupt(), pytest.param(SystemExit(3), marks=pytest.mark.study)],
)
def test_an_exception_ends_the_run_in_the_safe_state_and_goes_on(tmp_path, error):
    with pytest.raises(type(error)) as caught:
        _fail(tmp_path, error)
    assert caught.value is error
    results = ended_as(tmp_path, "program_failed")
    assert type(error).__name__ in results["bench"]["reason"]


def _dawdle(folder):
    with etb.connect(folder=folder, idle=0.5) as bench:
        bench.move("30 deg")
        time.sleep(2.0)  # a call that hangs
        bench.move("40 deg")


def test_a_program_that_gives_no_order_is_not_waited_for(tmp_path):
    with pytest.raises(etb.BenchFault, match=r"no order for 0\.5 s"):
        _dawdle(tmp_path)
    ended_as(tmp_path, "nobody_commands")


@pytest.mark.parametrize(
    "end", ["os._exit(7)", "os.kill(os.getpid(), signal.SIGKILL)", "os.fork() or time.sleep(60); os._exit(7)"]
)
def test_a_program_that_is_gone_leaves_the_drive_off(tmp_path, end):
    """The last one leaves a child behind that has its pipes open still."""
    code = f"""
        import os, signal, time
        import etb_hil as etb
        with etb.connect(folder={str(tmp_path)!r}) as bench:
            bench.move("30 deg")
            {end}
    """
    program = subprocess.Popen([sys.executable, "-c", textwrap.dedent(code)], env=os.environ, start_new_session=True)
    try:
        assert program.wait(PATIENCE_S) in {7, -signal.SIGKILL}
        ended_as(tmp_path, "program_gone")
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(program.pid, signal.SIGKILL)


def children():
    return {int(pid) for pid in Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()}


def _go_on_without_it(folder):
    before = children()
    with etb.connect(folder=folder, idle=IDLE_S) as bench:
        bench.move("30 deg")
        (ours,) = children() - before
        os.kill(ours, signal.SIGKILL)
        bench.move("40 deg")


@pytest.mark.skipif(not Path(f"/proc/self/task/{os.getpid()}/children").exists(), reason="no list of children here")
def test_a_bench_whose_process_dies_is_not_said_to_be_off(tmp_path):
    with pytest.raises(etb.BenchFault, match="watchdog takes"):
        _go_on_without_it(tmp_path)


def test_an_unknown_file_is_refused_before_a_process_starts():
    before = children()
    with pytest.raises(etb.InputError, match="no bench file 'nosuch'"):
        etb.connect("nosuch")
    assert children() == before


def test_a_bench_that_was_not_entered_says_so():
    bench = etb.connect()
    with pytest.raises(etb.InputError, match="not entered"):
        _ = bench.seen
    with pytest.raises(etb.InputError, match="not entered"):
        bench.off("1 s")


def test_numbers_of_numpy_and_names_in_use_are_no_obstacle(tmp_path):
    with etb.connect(folder=tmp_path, idle=IDLE_S) as bench:
        bench.phase("off", id="off_2", duration="0.1 s")
        bench.off("0.1 s")
        seen = bench.phase("ramp", between=("20 deg", "22 deg"), speed="1 rad/s", repeat=np.int64(1))
        assert seen.angle == pytest.approx(np.deg2rad(20.0), abs=0.05)


@pytest.mark.parametrize("idle", [0.0, -1.0, float("nan")])
def test_no_time_to_give_an_order_in_is_refused(idle):
    with pytest.raises(etb.InputError, match=r"idle: .*allowed: above 0 s"):
        etb.connect(idle=idle)


def test_before_the_block_is_left_there_is_no_whole_run(one_bench):
    with pytest.raises(etb.InputError, match="the run goes on"):
        _ = one_bench.run
