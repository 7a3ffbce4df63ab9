"""SocketCAN for real: the contracts and the faults again, beside a vcan0 that is up."""

import re
import sys
from pathlib import Path

import pytest
import vcan_machine

HERE = Path(__file__).parent
pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def vcan():
    vcan_machine.require()


def test_the_contracts_hold_on_socketcan(tmp_path):
    tests = [str(HERE / name) for name in ("test_bus_contract.py", "test_link.py")]
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-k", "socketcan", *tests]
    done = vcan_machine.run(command, tmp_path / "job")
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-1000:]
    assert "skipped" not in done.stdout
    assert re.search(r"\b\d\d passed", done.stdout), done.stdout[-300:]


def test_a_flooded_a_dead_and_a_deleted_interface_are_reported(tmp_path):
    done = vcan_machine.run([sys.executable, str(HERE / "vcan_link_job.py")], tmp_path / "job")
    assert done.returncode == 0, done.stderr[-3000:]
    assert done.stdout == "all faults seen\n"
