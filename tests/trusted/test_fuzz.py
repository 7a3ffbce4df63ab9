"""The quick form of fuzzing: some seconds of wrong files of every kind, drawn from one seed."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest

FUZZ = Path(__file__).resolve().parents[2] / "benchmarks" / "fuzz.py"


def test_some_seconds_of_wrong_files_find_nothing():
    command = [sys.executable, FUZZ, "--seconds", "1", "--seed", "0"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "| session |" in done.stdout


@pytest.mark.study
def test_what_was_done_until_it_is_stopped_is_counted_and_goes_on_from_there():
    command = [sys.executable, FUZZ, "db", "--seconds", "600", "--seed", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:
        running.stdout.readline()  # once the header is there, the first case begins
        running.send_signal(signal.SIGTERM)
        said = running.communicate(timeout=300)[0]
    assert running.returncode == 0, said
    row, onward = said.splitlines()[-2:]
    cases = int(row.split("|")[2])
    assert cases < 100
    assert onward == f"stopped: go on with db --first {cases}"
