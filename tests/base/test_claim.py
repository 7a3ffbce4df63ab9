"""Of processes that need the same machine code one compiles it, and none waits for a process that has gone."""

import signal
import subprocess
import sys
import time
from collections import Counter

import pytest

from etb_hil.base.claim import Claim

COMPILE = """
import logging, sys
logging.basicConfig(stream=sys.stdout, format="%(message)s", level=logging.WARNING)
logging.getLogger("etb_hil.base.compiled").setLevel(logging.INFO)
import numpy as np
from etb_hil.controller.laws.choice import law_torque
print("torque", law_torque(0, np.array([2.0, 4.0, 8.0, 16.0]), np.array([1.0, 0.0]), 1.0, 0.5))
"""
HOLD = """
import pathlib, sys, time
from etb_hil.base.claim import Claim
claim = Claim(pathlib.Path(sys.argv[1]))
claim.take(lambda: False)
print("held", flush=True)
time.sleep(60.0)
"""

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="every process compiles its own there")


def test_what_three_processes_need_at_once_is_compiled_once(monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    started = [
        subprocess.Popen([sys.executable, "-c", COMPILE], stdout=subprocess.PIPE, text=True) for _ in range(3)
    ]  # fmt: skip
    said = [one.communicate(timeout=300)[0].splitlines() for one in started]
    assert len({lines[-1] for lines in said}) == 1
    compiled = Counter(line for lines in said for line in lines if line.startswith("compiling "))
    assert compiled
    assert set(compiled.values()) == {1}
    assert not list(tmp_path.rglob("*.claim"))


@pytest.fixture
def holder(tmp_path):
    """Start a process that holds the claim on a file."""
    path = tmp_path / "folder" / "code"
    with subprocess.Popen([sys.executable, "-c", HOLD, str(path)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "held\n"
        yield path, process
        process.kill()


def test_the_claim_of_a_process_that_was_killed_is_free(holder):
    path, process = holder
    process.send_signal(signal.SIGKILL)
    process.wait()
    claim = Claim(path)
    began = time.monotonic()
    claim.take(lambda: False)
    assert time.monotonic() - began < 60.0  # and not the longest that a process waits
    claim.end()


def test_who_waits_goes_on_as_soon_as_the_file_is_there(holder):
    path, process = holder
    path.write_text("made")
    claim = Claim(path)
    claim.take(path.exists)
    assert process.poll() is None
    claim.end()


def test_where_nothing_can_be_written_everyone_works_on(tmp_path):
    blocked = tmp_path / "a file"
    blocked.write_text("")
    claim = Claim(blocked / "code")
    claim.take(lambda: False)
    claim.end()
    assert blocked.read_text() == ""
