"""The quick form of fuzzing: half a minute of wrong files of every kind, drawn from one seed."""

import subprocess
import sys
from pathlib import Path

import pytest

FUZZ = Path(__file__).resolve().parents[2] / "benchmarks" / "fuzz.py"


@pytest.mark.slow
def test_half_a_minute_of_wrong_files_finds_nothing():
    command = [sys.executable, FUZZ, "--seconds", "30", "--seed", "0"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "| session |" in done.stdout
