"""UDS over real SocketCAN: bench and controller in two processes, at wall clock."""

import json
import sys
from pathlib import Path

import pytest
import vcan_machine

from etb_hil.base.stock import find
from etb_hil.results.json_file import result_from_dict

PAIR = Path(__file__).with_name("bench_on_vcan.py")
SHORT = """schema: etb_hil/scenario/1
name: Short
phases:
  - {id: ramp, kind: ramp, between: [10 deg, 20 deg], speed: 1 rad/s}
  - {id: return, kind: off, duration: 0.6 s}
"""


@pytest.mark.study
@pytest.mark.slow
def test_identity_routine_and_codes_over_vcan(tmp_path):
    vcan_machine.require()
    uds = find("bench", "virtual_uds").read_text("utf-8")
    bus = "bus: {interface: socketcan, channel: vcan0, bitrate: 1 Mbit/s}"
    (line,) = (line for line in uds.splitlines() if line.startswith("bus:"))
    bench, scenario = tmp_path / "vcan_uds.yaml", tmp_path / "short.yaml"
    bench.write_text(uds.replace(line, bus), "utf-8")
    scenario.write_text(SHORT, "utf-8")
    place = tmp_path / "out"
    command = [sys.executable, str(PAIR), str(bench), "faulty", str(place), str(scenario)]
    # A guest has one processor for both processes: at the clock of its host they would be late beside other tests.
    done = vcan_machine.run(command, place, slower=3 if vcan_machine.machine() == "uml" else 1)
    (path,) = (place / "sessions").glob("*/results.json")
    results = result_from_dict(json.loads(path.read_text("utf-8")))
    told = f"{results.bench}\n{done.stdout}{done.stderr}"
    if results.bench.reason_id in {"host_late", "frames_stopped", "answers_late"}:
        pytest.skip(f"this host stalls too often for a bench at wall clock\n{told}")
    found = results.unit_diagnostics
    assert [one.value for one in found.identity[:2]] == ["VIRTUAL", "default throttle, faulty"], told
    assert [(one.when, one.outcome) for one in found.routines] == [("before", "done")], told
    assert [code.code for code in found.codes_after] == ["P2119"], told
