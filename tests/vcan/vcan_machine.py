"""Runs a command where vcan0 is up: in a network namespace of this kernel, else under User Mode Linux.

User Mode Linux is an ordinary process: Debian's kernel `linux.uml` with the host's own files as its root, read-only.
Where there is a C compiler, it is started with `vcan_host.c`, without which it panics on processors with AMX, and
which can slow its clock down on hosts that stall.
"""

from __future__ import annotations

import fcntl
import functools
import json
import os
import platform
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib as mpl
import pytest

CHECKOUT = Path(__file__).resolve().parents[2]
GUEST = Path(__file__).with_name("vcan_guest.py")
HOST = Path(__file__).with_name("vcan_host.c")
REQUIRED = "ETB_HIL_NEEDS_VCAN"  # set where all that a vcan0 needs was installed: then nothing is skipped
HANGS_S = 900.0  # a slow machine needs minutes; only what hangs takes so long
BESIDE = "VCAN_MACHINE"  # set for commands that `run` starts
MODULES = ("net/can/can", "net/can/can-raw", "net/can/can-bcm", "drivers/net/can/dev/can-dev", "drivers/net/can/vcan")
VCAN_UP = "ip link set lo up && ip link add dev vcan0 type vcan && ip link set vcan0 mtu 72 up"  # 72: CAN FD frames
# Each system call of the guest goes from one process of the host to another and back. Between two processors that takes
# three times as long, and with other work in between the guest cannot keep to milliseconds.
FIRST_ON_ONE_PROCESSOR = """
{ echo -20 >/proc/self/autogroup; } 2>/dev/null
exec taskset --cpu-list $1 nice -n -20 "${@:2}"
"""
ONE_GUEST = Path(tempfile.gettempdir()) / f"etb_hil_guest_{os.getuid()}.lock"
IN_NAMESPACE = ("unshare", "--map-root-user", "--net")
SYSTEM_PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"


def is_beside_vcan() -> bool:
    """Return whether this process was started by `run`, beside a vcan0 that is up."""
    return BESIDE in os.environ


def require() -> None:
    """Skip the test where there is no way to a vcan0; fail it where there has to be one."""
    try:
        machine()
    except RuntimeError as reason:
        if REQUIRED in os.environ:
            raise
        pytest.skip(str(reason))


@functools.cache
def machine() -> str:
    """Return `namespace` or `uml`, the way to a vcan0 on this machine; RuntimeError says why there is none."""
    if shutil.which("ip", path=SYSTEM_PATH) is None:
        raise RuntimeError("vcan0 needs the command `ip` (Debian package iproute2)")
    try:
        native = subprocess.run([*IN_NAMESPACE, "sh", "-c", VCAN_UP], capture_output=True, check=False, timeout=30)
        if native.returncode == 0:
            return "namespace"
    except OSError:
        pass  # no `unshare` here: User Mode Linux needs none
    try:
        require_guest()
    except RuntimeError as reason:
        raise RuntimeError(f"this kernel has no vcan, and {reason}") from None
    return "uml"


@functools.cache
def require_guest() -> None:
    """Raise RuntimeError with the reason where User Mode Linux does not run."""
    if platform.machine() != "x86_64" or shutil.which("linux.uml") is None:
        raise RuntimeError("there is no User Mode Linux (Debian package user-mode-linux)")
    with tempfile.TemporaryDirectory() as folder:
        try:
            _run_in_guest(["true"], Path(folder), {"MPLCONFIGDIR": folder}, timeout_s=60, slower=1)
        except (RuntimeError, subprocess.TimeoutExpired) as error:
            lacks = "" if shutil.which("cc") else "; with AMX it needs a C compiler (Debian packages gcc, libc6-dev)"
            raise RuntimeError(f"User Mode Linux does not start here{lacks}: {error}") from None


def run(
    command: list[str], folder: Path, timeout_s: float = HANGS_S, *, slower: int = 1
) -> subprocess.CompletedProcess[str]:
    """Run a command beside a vcan0 that is up; `folder` and the package's folder (compiled kernels) are writable.

    With `slower`, one second of the command's clock is so many seconds of this machine's (`timeout_s` is the latter).
    The caller's kernel and other users' CAN interfaces are left alone. Raises subprocess.TimeoutExpired.
    """
    folder.mkdir(parents=True, exist_ok=True)
    in_guest = slower > 1 or machine() == "uml"
    if slower > 1:
        require_guest()
    scratch = "/dev/shm" if in_guest else str(folder)
    env = {
        "PATH": f"{Path(sys.executable).parent}:{SYSTEM_PATH}",
        "HOME": scratch,
        "TMPDIR": scratch,
        "LANG": "C.UTF-8",
        "PYTHONDONTWRITEBYTECODE": "1",
        "OMP_NUM_THREADS": "1",
        "MPLCONFIGDIR": mpl.get_cachedir(),  # building a font cache takes half a minute in the guest
        BESIDE: "uml" if in_guest else "namespace",
    }
    shell = ["sh", "-c", f'{VCAN_UP} && exec "$@"', "sh", *command]
    if in_guest:
        return _run_in_guest(shell, folder, env, timeout_s, slower)
    return subprocess.run(
        [*IN_NAMESPACE, *shell], env=env, cwd=CHECKOUT, capture_output=True, text=True, timeout=timeout_s, check=False
    )


def _run_in_guest(
    command: list[str], folder: Path, env: dict[str, str], timeout_s: float, slower: int
) -> subprocess.CompletedProcess[str]:
    kernel = Path(shutil.which("linux.uml") or "").resolve()
    modules = next((kernel.parent.parent / "lib/uml/modules").iterdir()) / "kernel"
    job = {
        "command": command,
        "env": env,
        "cwd": str(CHECKOUT),
        "modules": [str(modules / f"{name}.ko") for name in MODULES],
        "writable": [str(CHECKOUT / "etb_hil"), env["MPLCONFIGDIR"]],  # kernels are cached beside their source
    }
    (folder / "job.json").write_text(json.dumps(job))
    (folder / "returncode").unlink(missing_ok=True)
    boot = [
        "bash", "-c", FIRST_ON_ONE_PROCESSOR, "bash", str(max(os.sched_getaffinity(0))),
        str(kernel), "mem=1G", "root=/dev/root", "rootfstype=hostfs", "rootflags=/", "ro", "quiet", "con=null",
        "con0=null,fd:1", f"uml_dir={folder}", f"init={sys.executable}", "--", str(GUEST), str(folder),
    ]  # fmt: skip
    # One guest at a time, whichever process of the tests asks: they share a processor.
    with ONE_GUEST.open("w") as turn, (folder / "console").open("wb") as console:
        fcntl.flock(turn, fcntl.LOCK_EX)
        process = subprocess.Popen(
            boot,
            env=os.environ | _preloaded(folder, slower),
            stdin=subprocess.DEVNULL,
            stdout=console,
            stderr=console,
            start_new_session=True,
        )
        try:
            process.wait(timeout_s)
        finally:
            if process.poll() is None:
                process.terminate()  # lets the machine clean up; its children share the session
                try:
                    process.wait(10)
                except subprocess.TimeoutExpired:
                    os.killpg(process.pid, signal.SIGKILL)
                    process.wait()
    try:
        code = int((folder / "returncode").read_text())
    except FileNotFoundError:
        text = (folder / "console").read_text(errors="replace")
        raise RuntimeError(f"the guest ended before its command did; its console:\n{text}") from None
    out, err = ((folder / name).read_text(errors="replace") for name in ("stdout", "stderr"))
    return subprocess.CompletedProcess(command, code, out, err)


def _preloaded(folder: Path, slower: int) -> dict[str, str]:
    """Return the variables that load `vcan_host.c` into the guest's kernel; none without a compiler."""
    if shutil.which("cc") is None:
        if slower > 1:
            raise RuntimeError("a slower clock needs a C compiler (Debian packages gcc, libc6-dev)")
        return {}
    library = folder / "host.so"
    subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", str(library), str(HOST)], check=True, timeout=60)
    return {"LD_PRELOAD": str(library), "VCAN_SLOWER": str(slower)}
