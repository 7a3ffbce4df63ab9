"""A friction check over python-can's buses: bench and controller in two processes, at wall clock."""

import json
import os
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import can
import pytest
from whole_run import BRISK

from etb_hil.base.outcome import ExitCode
from etb_hil.base.stock import find
from etb_hil.plant.parameters import load_model
from etb_hil.replays.session_replay import replay
from etb_hil.results.json_file import result_from_dict
from etb_hil.session.differences import first_difference

pytestmark = pytest.mark.slow

ATTEMPTS = 3
WIRE = Path(__file__).with_name("slcan_wire.py")


def started(stack, *words):
    """Start a process that says a line when it is ready; it is ended with the test."""
    process = stack.enter_context(subprocess.Popen(words, stdout=subprocess.PIPE, text=True))
    stack.callback(lambda: (process.terminate(), process.communicate()))
    assert process.stdout.readline()
    return process


def bench_file(folder, stock, **changes):
    text = find("bench", stock).read_text()
    for before, after in changes.items():
        assert before in text
        text = text.replace(before, after)
    path = folder / f"{stock}.yaml"
    path.write_text(text)
    return path


@pytest.fixture
def stack():
    with ExitStack() as stack:
        yield stack


@pytest.fixture
def udp_multicast(tmp_path):
    port = 43200 + os.getpid() % 20_000
    try:
        can.Bus(interface="udp_multicast", channel="239.74.163.2", port=port).shutdown()
    except (ImportError, can.CanError, OSError) as error:
        pytest.skip(f"no multicast on this machine: {error}")
    return [bench_file(tmp_path, "udp_multicast", **{"43113": str(port)})] * 2


@pytest.fixture
def slcan(stack, tmp_path):
    pytest.importorskip("serial", reason="slcan needs pyserial")
    links = [str(tmp_path / name) for name in ("bench_tty", "controller_tty")]
    started(stack, sys.executable, str(WIRE), *links)
    benches = []
    for link in links:
        folder = Path(f"{link}_bench")
        folder.mkdir()
        benches.append(
            bench_file(folder, "slcan", **{"/dev/ttyACM0": link, "sleep_after_open: 0.5": "sleep_after_open: 0"})
        )
    return benches


@pytest.mark.parametrize(
    ("bus", "unit", "expected"),
    [
        pytest.param("udp_multicast", "default", ExitCode.DONE, marks=pytest.mark.study),
        ("slcan", "faulty", ExitCode.UNIT_FAILED),
    ],
)
def test_the_verdict_is_right_and_the_bus_truth_is_told(request, tmp_path, bus, unit, expected):
    here, there = request.getfixturevalue(bus)
    etb_hil = (sys.executable, "-m", "etb_hil")
    scenario = tmp_path / "brisk.yaml"
    scenario.write_text(BRISK)
    told = ""
    for attempt in range(ATTEMPTS):
        out = tmp_path / f"attempt{attempt}"
        words = (*etb_hil, "run", str(scenario), "--bench", str(here), "--out", str(out))
        with ExitStack() as attempt_stack:
            started(attempt_stack, *etb_hil, "controller", "--bench", str(there), "--unit", unit)
            done = subprocess.run(words, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
        told += f"exit code {done.returncode}\n{done.stdout}{done.stderr}\n"
        assert done.returncode in {expected, ExitCode.BENCH_FAULT, ExitCode.INCONCLUSIVE}, told
        (session,) = (path.parent for path in out.glob("*/session.json"))
        results = result_from_dict(json.loads((session / "results.json").read_text()))
        assert_bus_truth(results, timely=done.returncode == expected)
        assert first_difference(replay(session)) is None
        if done.returncode == expected:
            break
    else:
        pytest.skip(f"this machine is too slow for a bench at wall clock: no run of {ATTEMPTS} was timely\n{told}")
    truth = load_model(find("model", unit)).values
    found = {number.id: number.value for number in results.measurements.values()}
    assert found["T_st"] == pytest.approx(truth.stiction, rel=0.06)
    assert found["T_c"] == pytest.approx(truth.coulomb, rel=0.06)
    assert results.bench.safe_state is True
    for message in results.bus.messages:
        assert message.frames > 0, message


def assert_bus_truth(results, *, timely):
    """What these drivers cannot know is unknown; what can be counted is counted, in every outcome."""
    bus = results.bus
    assert (bus.state, bus.transmit_errors, bus.receive_errors, bus.dropped) == (None,) * 4
    assert bus.error_frames == 0
    if results.duration_s > 0.5:  # a run that ended before has seen no whole window
        assert bus.load_peak > 0.05
        assert bus.load_peak < 1.0 or not timely  # a controller that was stalled makes up for it at any rate here
        assert results.clock.drift_ppm is not None
    assert not any(message.crc_failures for message in bus.messages)
    assert results.timestamp_grade == "sample counter"
    assert results.bench.frame_age.mean_ms > 0.0
    assert results.bench.set_point_jitter.rms_us > 0.0
