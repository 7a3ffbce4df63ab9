"""Two benches on one controller: the second is told who holds it; a killed holder holds nothing."""

import os
import signal
import subprocess
import sys

import pytest

from etb_hil.base.errors import BenchFault
from etb_hil.bench.controller_lock import controller_lock
from etb_hil.canio.bus.bus_settings import BusSettings

VCAN0 = BusSettings(interface="socketcan", channel="vcan0")
HOLD = """
import sys, time
from pathlib import Path
from etb_hil.bench.controller_lock import controller_lock
from etb_hil.canio.bus.bus_settings import BusSettings
with controller_lock(BusSettings(interface="socketcan", channel="vcan0"), 0, Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(600)
"""


def test_a_second_bench_is_told_the_holders_process(tmp_path):
    with (
        controller_lock(VCAN0, 0, tmp_path),
        pytest.raises(BenchFault, match=f"process {os.getpid()}"),
        controller_lock(VCAN0, 0, tmp_path),
    ):
        pass
    with controller_lock(VCAN0, 0, tmp_path):
        pass


@pytest.mark.parametrize(
    ("bus", "id_offset"),
    [
        (VCAN0, 0x100),
        (BusSettings(interface="socketcan", channel="vcan1"), 0),
        (BusSettings(interface="slcan", channel="/dev/../vcan0"), 0),
        (BusSettings(interface="udp_multicast", channel="239.74.163.2", options={"port": 43001}), 0),
    ],
)
def test_another_controller_is_free(tmp_path, bus, id_offset):
    with controller_lock(VCAN0, 0, tmp_path), controller_lock(bus, id_offset, tmp_path) as path:
        assert path.parent == tmp_path


def test_a_killed_bench_holds_nothing(tmp_path):
    with subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(BenchFault, match=f"process {holder.pid};"), controller_lock(VCAN0, 0, tmp_path):
            pass
        holder.send_signal(signal.SIGKILL)
    with controller_lock(VCAN0, 0, tmp_path):
        pass


def test_a_folder_that_cannot_be_used_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BenchFault, match="cannot be opened"), controller_lock(VCAN0, 0, tmp_path / "file"):
        pass
