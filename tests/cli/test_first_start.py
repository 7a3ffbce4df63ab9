"""A first start shares what has to be compiled with a second process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

SESSION = Path(__file__).resolve().parents[1] / "releases" / "0.1.0" / "session"

COMPILED_BY_REPLAY = f"""
import sys
from numba.core.dispatcher import Dispatcher
import etb_hil
from etb_hil.bench.analysis_kernels import compile_analysis

def signatures():
    modules = [module for name, module in sys.modules.items() if name.startswith("etb_hil.")]
    kernels = {{one for module in modules for one in vars(module).values() if isinstance(one, Dispatcher)}}
    return {{(one.__module__, one.__name__, str(types)) for one in kernels for types in one.signatures}}

compile_analysis()
before = signatures()
etb_hil.replay({str(SESSION)!r})
print(sorted(signatures() - before))
"""

CHILDREN = """
import os
from etb_hil.cli.compiling import announce_compiling
from etb_hil.cli.first_start import compiling_shared

def has_child():
    try:
        return os.waitpid(-1, os.WNOHANG) == (0, 0)
    except ChildProcessError:
        return False

announce_compiling()
with compiling_shared():
    found = [has_child()]
    from etb_hil.plant.exactmath import exp
    exp(1.0)
    found.append(has_child())
found.append(has_child())
print(found)
"""


def _printed(code, **environment):
    done = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, **environment}, capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


def test_the_second_process_compiles_all_that_judging_a_unit_needs():
    assert _printed(COMPILED_BY_REPLAY) == "[]"


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="needs two processors")
def test_the_second_process_lives_from_the_first_compiled_function_to_the_end_of_the_block(tmp_path):
    assert _printed(CHILDREN, NUMBA_CACHE_DIR=str(tmp_path)) == "[False, True, False]"


def test_nothing_is_started_where_everything_is_compiled(tmp_path):
    warm = {"NUMBA_CACHE_DIR": str(tmp_path)}
    _printed("from etb_hil.plant.exactmath import exp; exp(1.0)", **warm)
    assert _printed(CHILDREN, **warm) == "[False, False, False]"
