"""The quick form of fuzzing: some seconds of wrong files of every kind, drawn from one seed."""

import subprocess
import sys
from pathlib import Path

FUZZ = Path(__file__).resolve().parents[2] / "benchmarks" / "fuzz.py"


def test_some_seconds_of_wrong_files_find_nothing():
    command = [sys.executable, FUZZ, "--seconds", "4", "--seed", "0"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "| session |" in done.stdout
