"""A friction check over real SocketCAN: bench and controller in two processes, at wall clock."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
import vcan_machine
from whole_run import BRISK

from etb_hil.base.outcome import ExitCode
from etb_hil.base.stock import find
from etb_hil.plant.parameters import load_model
from etb_hil.results.json_file import result_from_dict

PAIR = Path(__file__).with_name("bench_on_vcan.py")
# One second of the bench is so many seconds here: a host that stalls is asked again with a slower clock, on which its
# stalls are shorter. At the last one a host may stall for two seconds. A guest has one processor for both processes,
# and beside other tests it misses every deadline at the clock of its host.
SLOWER = {"namespace": (1, 5, 25), "uml": (5, 25)}
# Half a wrap of 4-bit counters at 10 ms: who stands still for longer cannot tell late frames from lost ones.
HALF_A_WRAP_MS = 80.0
STALLED = {ExitCode.BENCH_FAULT, ExitCode.INCONCLUSIVE}  # what a host that stalls may cost; any other code is an answer

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def vcan():
    vcan_machine.require()


@pytest.fixture(scope="module")
def slower():
    """How much slower the clocks still to be tried are; shared, so that a stall costs one attempt of all tests."""
    return list(SLOWER[vcan_machine.machine()])


def run_until_answered(bench, unit, folder, slower):
    """Run; repeat more slowly where the host stalled. Return the exit code, the session and all that was printed."""
    told = ""
    while slower:
        place = folder / str(slower[0])
        command = [sys.executable, str(PAIR), bench, unit, str(place), str(folder / "brisk.yaml")]
        done = vcan_machine.run(command, place, slower=slower[0])
        told += f"{slower[0]} times slower: exit code {done.returncode}\n{done.stdout}{done.stderr}\n"
        if done.returncode not in STALLED:
            (manifest,) = (place / "sessions").glob("*/session.json")
            session = manifest.parent
            results = result_from_dict(json.loads((session / "results.json").read_text()))
            if results.bench.lateness.worst_ms < HALF_A_WRAP_MS:
                return done.returncode, session, told
        slower.pop(0)
    pytest.fail(f"no answer, however slow the clock\n{told}")


@pytest.mark.parametrize(
    ("bench", "unit", "expected"),
    [
        ("vcan_classic", "faulty", ExitCode.UNIT_FAILED),
        pytest.param("vcan_fd", "default", ExitCode.DONE, marks=pytest.mark.study),
    ],
)
def test_the_verdict_over_socketcan_is_right(tmp_path, slower, bench, unit, expected):
    (tmp_path / "brisk.yaml").write_text(BRISK)
    code, session, told = run_until_answered(bench, unit, tmp_path, slower)
    assert code == expected, told
    results = result_from_dict(json.loads((session / "results.json").read_text()))

    truth = load_model(find("model", unit)).values
    found = {number.id: number.value for number in results.measurements.values()}
    assert found["T_st"] == pytest.approx(truth.stiction, rel=0.05)
    assert found["T_c"] == pytest.approx(truth.coulomb, rel=0.05)

    bus = results.bus
    assert (bus.error_frames, bus.dropped) == (0, 0)
    for message in bus.messages:
        assert message.frames > 0, message
        assert not any(
            getattr(message, fault) for fault in ("lost", "crc_failures", "counter_jumps", "repeated_counters")
        ), message
    assert results.bench.safe_state is True

    again = [sys.executable, "-m", "etb_hil", "replay", str(session)]  # by this machine's own kernel
    done = subprocess.run(again, capture_output=True, text=True, check=False)
    assert done.returncode == expected
    assert "The same results as live, bit for bit." in done.stdout
