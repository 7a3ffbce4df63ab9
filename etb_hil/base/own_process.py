"""Start processes of this package, with few imports and BLAS in one thread.

`python -m etb_hil.base.own_process MODULE ARGUMENTS` runs a module in one.
"""

from __future__ import annotations

import os
import runpy
import sys

from etb_hil.base.collector import collect_rarely
from etb_hil.base.lean_imports import keep_imports_lean


def begin_own_process() -> None:
    """Make this process one of ours.

    It is called before NumPy is loaded: its BLAS starts a thread a core, which spin between small products beside our
    own threads.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    collect_rarely()
    keep_imports_lean()


def command_of(module: str, *arguments: str) -> list[str]:
    """Return the command that runs a module of ours in a process of its own.

    The folder that it is started in is no place to import from.
    """
    return [sys.executable, "-P", "-m", __name__, module, *arguments]


if __name__ == "__main__":
    begin_own_process()
    sys.argv = sys.argv[1:]
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
