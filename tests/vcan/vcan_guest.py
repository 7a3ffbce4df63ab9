"""First process of a User Mode Linux guest: loads vcan, runs one command, switches the machine off.

Started by `vcan_machine.py` with a folder that holds `job.json`; needs the standard library only.
"""

from __future__ import annotations

import ctypes
import json
import os
import subprocess
import sys
from pathlib import Path

FINIT_MODULE = 313  # the number of the system call on x86-64
RB_POWER_OFF = 0x4321FEDC

libc = ctypes.CDLL(None, use_errno=True)


def check(result: int, what: str) -> None:
    if result != 0:
        number = ctypes.get_errno()
        raise OSError(number, f"{what}: {os.strerror(number)}")


def mount(kind: str, where: str, options: str = "") -> None:
    check(libc.mount(b"none", where.encode(), kind.encode(), 0, options.encode()), f"mount {kind} on {where}")


def insert_module(path: Path) -> None:
    with path.open("rb") as file:
        check(libc.syscall(FINIT_MODULE, file.fileno(), b"", 0), f"load {path.name}")


def run_job(folder: Path) -> None:
    # The root is the host's, so that the host's /proc and /sys show until the guest mounts its own over them.
    for kind, where in (("proc", "/proc"), ("sysfs", "/sys"), ("tmpfs", "/dev/shm"), ("tmpfs", "/run")):
        Path(where).is_dir() or Path(where).mkdir()
        mount(kind, where)
    Path("/run/lock").mkdir()
    Path("/run/lock").chmod(0o1777)  # as every machine has it
    # Commands may ask for real-time priority: no pause of 50 ms a second for the others, there are none that matter.
    Path("/proc/sys/kernel/sched_rt_runtime_us").write_text("-1")
    mount("hostfs", str(folder), str(folder))
    job = json.loads((folder / "job.json").read_text())
    for writable in job["writable"]:
        mount("hostfs", writable, writable)
    for module in job["modules"]:
        insert_module(Path(module))
    with (folder / "stdout").open("wb") as out, (folder / "stderr").open("wb") as err:
        done = subprocess.run(job["command"], env=job["env"], cwd=job["cwd"], stdout=out, stderr=err, check=False)
    (folder / "returncode").write_text(str(done.returncode))


if __name__ == "__main__":
    try:
        run_job(Path(sys.argv[1]))
    finally:  # whatever happened, the machine goes off: the host would wait for its time-out
        sys.stdout.flush()
        sys.excepthook(*sys.exc_info()) if sys.exc_info()[0] else None
        os.sync()
        libc.reboot(RB_POWER_OFF)
