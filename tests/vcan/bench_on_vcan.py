"""Beside a vcan0: the controller and the bench as two processes at wall clock; exits as the bench does.

`python bench_on_vcan.py BENCH UNIT FOLDER`. The controller's log and what both printed are left in FOLDER.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path


def etb_hil(priority: int, *words: str) -> list[str]:
    """Return the command, before ordinary work where the guest has one processor for bench, controller and panel."""
    first = ["chrt", "--reset-on-fork", "--rr", str(priority)] if os.environ["VCAN_MACHINE"] == "uml" else []
    return [*first, sys.executable, "-m", "etb_hil", *words]


def main(bench: str, unit: str, folder: Path) -> int:
    events, sessions = str(folder / "controller.jsonl"), str(folder / "sessions")
    serve = etb_hil(2, "controller", "--bench", bench, "--unit", unit, "--log", events)
    with subprocess.Popen(serve, stdout=subprocess.PIPE, text=True) as controller:
        assert controller.stdout is not None
        print(controller.stdout.readline(), end="", flush=True)  # it says that it is ready
        run = etb_hil(1, "run", "friction_check", "--bench", bench, "--out", sessions, "--serial", f"{bench} {unit}")
        code = subprocess.run(run, check=False).returncode
        controller.terminate()
        print(controller.stdout.read(), end="")
    assert controller.returncode == 0, controller.returncode
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2], Path(sys.argv[3])))
