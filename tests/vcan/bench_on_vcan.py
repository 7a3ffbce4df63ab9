"""Beside a vcan0: the controller and the bench as two processes at wall clock; exits as the bench does.

`python bench_on_vcan.py BENCH UNIT FOLDER [SCENARIO]`. The controller's log and what both printed are left in FOLDER.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ETB_HIL = (sys.executable, "-m", "etb_hil")


def main(bench: str, unit: str, folder: Path, scenario: str = "friction_check") -> int:
    events, sessions = str(folder / "controller.jsonl"), str(folder / "sessions")
    serve = [*ETB_HIL, "controller", "--bench", bench, "--unit", unit, "--log", events]
    with subprocess.Popen(serve, stdout=subprocess.PIPE, text=True) as controller:
        assert controller.stdout is not None
        print(controller.stdout.readline(), end="", flush=True)  # it says that it is ready
        run = [*ETB_HIL, "run", scenario, "--bench", bench, "--out", sessions]
        run += ["--serial", f"{Path(bench).stem} {unit}"]
        code = subprocess.run(run, check=False).returncode
        controller.terminate()
        print(controller.stdout.read(), end="")
    assert controller.returncode == 0, controller.returncode
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2], Path(sys.argv[3]), *sys.argv[4:]))
