"""A bus that goes away under a moving plate: drive off 30 ms after the last command, by the controller's clock."""

from __future__ import annotations

import re
import sys

import pytest
import vcan_machine

pytestmark = pytest.mark.slow

SAFE_STOP = vcan_machine.CHECKOUT / "benchmarks" / "safe_stop.py"


@pytest.mark.parametrize("cause", ["LINK_DOWN", "LINK_GONE"])
def test_a_link_that_goes_away_leaves_the_drive_off_in_time(tmp_path, cause):
    try:
        vcan_machine.machine()
    except RuntimeError as reason:
        pytest.skip(str(reason))
    words = ["--interface", "socketcan", "--channel", "vcan0", "--runs", "2", "--cause", cause]
    done = vcan_machine.run([sys.executable, str(SAFE_STOP), *words], tmp_path, timeout_s=900)
    found = re.search(r"(\d+) runs: median .* worst ([\d.]+) ms; reason (.*); (\d+) did not", done.stdout)
    if found is None:
        pytest.skip(f"this machine is too slow for a bench at wall clock: {done.stdout}{done.stderr}")
    assert float(found[2]) <= 30.0, done.stdout
    assert found[3] == "timeout"
