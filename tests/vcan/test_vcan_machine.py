"""vcan0 is really there: classic and FD frames between two processes through the kernel's SocketCAN."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
import vcan_machine

HERE = Path(__file__).parent


@pytest.fixture(autouse=True)
def vcan():
    vcan_machine.require()


@pytest.mark.study
def test_two_processes_exchange_classic_and_fd_frames(tmp_path):
    done = vcan_machine.run([sys.executable, str(HERE / "vcan_echo.py")], tmp_path / "job")
    assert done.returncode == 0, done.stderr
    assert done.stdout == "200 frames answered\n"


def test_the_exit_code_and_the_error_text_come_back(tmp_path):
    done = vcan_machine.run(["sh", "-c", "echo wrong >&2; exit 10"], tmp_path / "job")
    assert (done.returncode, done.stderr) == (10, "wrong\n")


def test_a_command_that_hangs_is_ended(tmp_path):
    with pytest.raises(subprocess.TimeoutExpired):
        vcan_machine.run(["sleep", "600"], tmp_path / "job", timeout_s=4)
