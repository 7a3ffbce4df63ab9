"""What the whole answer costs: `etb-hil explain` as its own process on files of 40 s at 2 kHz.

    python benchmarks/explain_cost.py FIRST COUNT [--kind strong]

Files come from the independent generator. Printed of each: seconds from the start to the name (imports, reading,
search) and to the end with report, the processor time that this took, and the most memory that was held. A run before
the first compiles what is not yet in the caches.
"""

import argparse
import contextlib
import os
import pty
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from explain_study import KINDS, drawn
from generator.case import make_case
from generator.files import sealed, write_case
from generator.size import OutOfReachError

NAMED = "running the models freely"  # what the command says once the search is over
STAGES = (
    "calibrating inside the stated tolerances", NAMED, "fitting a last time, in free run", "choosing the next test",
    "judging the unit",
)  # fmt: skip


def measured(folder):
    """Run the command on a terminal of its own.

    Returns seconds and processor time to each thing that it says, both to the end, and the most MiB that it held.
    """
    command = [sys.executable, "-m", "etb_hil", "explain", str(folder / "data.csv"), "--model"]
    command += [str(folder / "model.yaml"), "--out", str(folder / "answer")]
    terminal, its = pty.openpty()
    begin, said, text = time.monotonic(), {}, ""
    child = subprocess.Popen(command, stdout=its, stderr=its)
    os.close(its)
    with contextlib.suppress(OSError):  # the terminal closes with the process
        while part := os.read(terminal, 65536):
            now = time.monotonic() - begin, processor_time(child.pid)
            text += part.decode("utf-8", "replace")
            for line in text.split("\r\x1b[K"):
                said.setdefault(line.split("\r")[0], now)
    os.close(terminal)
    _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise RuntimeError(f"explain ended with {child.returncode}:\n{text}")
    return said, (time.monotonic() - begin, used.ru_utime + used.ru_stime), used.ru_maxrss / 1024.0


def processor_time(process):
    """Seconds of processor time that a process has had."""
    fields = Path(f"/proc/{process}/stat").read_text("utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("first", type=int)
    parser.add_argument("count", type=int)
    parser.add_argument("--kind", choices=[kind for kind in KINDS if kind != "mix"], default="strong")
    options = parser.parse_args()
    is_warm = False
    print("seed effect: s to the name (processor time), s to the end (processor time), memory at most")
    for seed in range(options.first, options.first + options.count):
        effects, level, form = drawn(options.kind, seed)
        with tempfile.TemporaryDirectory() as folder:
            at = Path(folder)
            try:
                case = make_case(seed, effects, level, form=form)
            except OutOfReachError:
                continue
            write_case(case, at / "open", at / "sealed.json")
            if not is_warm:
                measured(at / "open")
                is_warm = True
            said, (whole, processor), memory = measured(at / "open")
        name, its = said[NAMED]
        stages = [f"{what} at {its:.1f}" for what, (_, its) in said.items() if what in STAGES]
        hidden = ", ".join(each["effect"] for each in sealed(case)["effects"]) or "nothing"
        print(
            f"{seed} {hidden}: {name:.1f} ({its:.1f}) {whole:.1f} ({processor:.1f})",
            f"{memory:.0f} MiB; processor time:", ", ".join(stages), flush=True,
        )  # fmt: skip


if __name__ == "__main__":
    main()
