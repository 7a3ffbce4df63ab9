"""The quick form of fuzzing: ten seconds of wrong files of every kind, drawn from one seed."""

import subprocess
import sys
from pathlib import Path

FUZZ = Path(__file__).resolve().parents[2] / "benchmarks" / "fuzz.py"


def test_ten_seconds_of_wrong_files_finds_nothing():
    command = [sys.executable, FUZZ, "--seconds", "10", "--seed", "0"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "| session |" in done.stdout
