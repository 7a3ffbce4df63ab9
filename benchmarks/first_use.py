"""What the Python interface costs a script: importing it, and the first use of each function, each in a new process.

    python benchmarks/first_use.py [--runs 5]

The least wall time of the runs; everything is compiled before. Beside it stands what Python and NumPy take themselves.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import etb_hil as etb

TIMED = "import time; begun = time.perf_counter(); {}; print(time.perf_counter() - begun)"
ALONE = {
    "python -c pass": "pass",
    "import numpy": "import numpy",
    "import etb_hil": "import etb_hil",
}
FIRST = {
    "read a session": "etb.read(session)",
    "run": "etb.run(folder=folder)",
    "simulate": "etb.simulate(rate='1 kHz')",
    "diagnose": "etb.diagnose(etb.read(session))",
    "replay": "next(etb.replay(session))",
    "history": "etb.history(sessions)",
    "connect, one motion": "exec('with etb.connect(folder=folder) as bench: bench.move(\"30 deg\")')",
    "explain": "etb.explain(session)",
}


def least(code, folder, runs):
    """Return the least seconds that a piece of code takes in a process of its own."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    words = [sys.executable, "-c", TIMED.format(code)]
    found = [
        subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, check=True)
        for _ in range(runs)
    ]
    return min(float(one.stdout.split()[-1]) for one in found)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=5)
    runs = parser.parse_args().runs
    with tempfile.TemporaryDirectory() as folder:
        sessions = Path(folder) / "sessions"
        session = etb.run(unit="faulty", folder=sessions).folder
        given = f"session, sessions, folder = {str(session)!r}, {str(sessions)!r}, {folder!r}"
        for name, code in ALONE.items():
            print(f"{name:24} {1e3 * least(code, folder, runs):8.1f} ms")
        for name, code in FIRST.items():
            print(f"{name:24} {1e3 * least(f'{given}; import etb_hil as etb; {code}', folder, runs):8.1f} ms")


if __name__ == "__main__":
    main()
