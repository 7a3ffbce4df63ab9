"""UDS over real SocketCAN against other implementations: can-isotp with udsoncan, and the kernel's ISO-TP."""

import json
import sys
from pathlib import Path

import pytest
import vcan_machine

from etb_hil.base.stock import find

STACKS = Path(__file__).with_name("other_stacks_on_vcan.py")
SERIAL = "ETB-0042-AB-12345"

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    vcan_machine.require()
    folder = tmp_path_factory.mktemp("stacks")
    text = find("bench", "virtual_uds").read_text("utf-8")
    (line,) = (line for line in text.splitlines() if line.startswith("bus:"))
    bench = folder / "bench.yaml"
    bus = "bus: {interface: socketcan, channel: vcan0, bitrate: 1 Mbit/s}"
    bench.write_text(text.replace(line, bus), "utf-8")
    out = folder / "out"
    done = vcan_machine.run([sys.executable, str(STACKS), str(bench), str(out)], out)
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_their_client_reads_our_controller(found):
    assert found["client"] == {"serial": SERIAL, "codes": []}


def test_our_client_reads_their_server(found):
    assert found["server"]["identity"] == [SERIAL, "a part number that is too long for one frame", "1.4.2"]
    assert found["server"]["codes"] == ["P2119"]


def test_the_kernels_client_reads_our_controller(found):
    if found["kernel_reason"]:
        pytest.skip(found["kernel_reason"])
    assert found["kernel"] == {"serial": SERIAL, "codes": []}
