"""`etb-hil controller` on real SocketCAN: answers, keeps its samples, and its watchdog holds at wall clock."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
import vcan_machine

HERE = Path(__file__).parent


@pytest.fixture(autouse=True)
def vcan():
    vcan_machine.require()


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "step"), [pytest.param("classic", 20, marks=pytest.mark.study), ("fd", 10)])
def test_a_controller_in_its_own_process_answers_and_lets_go(tmp_path, kind, step):
    # A controller goes before all other work: in a guest, which has one processor, a slow host would starve its driver.
    slower = 5 if vcan_machine.machine() == "uml" else 1
    command = [sys.executable, str(HERE / "controller_vcan_checks.py"), kind]
    done = vcan_machine.run(command, tmp_path / "job", slower=slower)
    assert done.returncode == 0, done.stdout + done.stderr
    seen = json.loads(done.stdout)
    assert seen["code"] == 0
    assert seen["farewell"].startswith("stopped by SIGTERM")
    assert seen["samples"] > 100  # how many more depends on the host
    assert seen["steps"] == [step]
    assert (seen["dropped"], seen["error_frames"]) == (0, 0)
    events = [(event["event"], event.get("reason")) for event in seen["log"]]
    assert events[0] == ("power_on", None)
    assert events[-1] == ("power_off", "stopped")
    offs = [event for event in seen["log"] if event["event"] == "drive_off"]
    assert offs
    for off in offs:  # a host that stalls may cost more than the one at the end, and each must be in time
        assert off["reason"] == "timeout"
        assert off["since_command_ms"] <= 30.0
