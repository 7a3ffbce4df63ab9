"""A fingerprint changes with everything that machine code holds, and with nothing else."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import NamedTuple

import numba
import numpy as np
import pytest

from etb_hil.base.fingerprint import fingerprint, options_fingerprint, type_fingerprint

SOURCE = '''
import math
import numpy as np
from numba import njit
from typing import NamedTuple
import {module} as other

SCALE = 2.0
TABLE = np.array([1.0, 2.0])
PLACES = (0, 1)
UNUSED = 1

@njit
def inner(x):
    return x * SCALE

@njit
def function(x, y=1.0):
    """Return a value."""
    return inner(x) + TABLE[PLACES[1]] + math.exp(y)
'''


def _compiled(source):
    space = {"__name__": "sample"}
    exec(source.format(module="math"), space)  # noqa: S102 (a source of our own)
    return fingerprint(space["function"].py_func)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("SCALE = 2.0", "SCALE = 3.0"),
        ("SCALE = 2.0", "SCALE = 2"),
        ("[1.0, 2.0]", "[1.0, 3.0]"),
        ("[1.0, 2.0]", "[[1.0], [2.0]]"),
        ("[1.0, 2.0]", "[1.0, 2.0], np.float32"),
        ("PLACES = (0, 1)", "PLACES = (1, 0)"),
        ("y=1.0", "y=2.0"),
        ("return x * SCALE", "return x / SCALE"),
        ("return x * SCALE", "return -x * SCALE"),
        ("math.exp", "math.log"),
        ("@njit\ndef inner", "@njit(fastmath=True)\ndef inner"),
        ("import math\n", "import cmath as math\n"),
    ],
)
def test_what_machine_code_holds_changes_it(old, new):
    assert old in SOURCE
    assert _compiled(SOURCE.replace(old, new)) != _compiled(SOURCE)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("Return a value.", "Return another text."),
        ("UNUSED = 1", "UNUSED = 2"),
        ("UNUSED = 1", "\n\n# a comment\n"),
    ],
)
def test_what_machine_code_does_not_hold_leaves_it(old, new):
    assert old in SOURCE
    assert _compiled(SOURCE.replace(old, new)) == _compiled(SOURCE)


def test_the_order_of_a_tuples_names_is_part_of_its_type():
    class Pair(NamedTuple):
        first: float
        second: float

    one = type_fingerprint(numba.typeof(Pair(1.0, 2.0)))
    Swapped = NamedTuple("Swapped", [("second", float), ("first", float)])  # noqa: UP014 (the names are what differs)
    Swapped.__module__, Swapped.__qualname__ = Pair.__module__, Pair.__qualname__
    assert type_fingerprint(numba.typeof(Swapped(2.0, 1.0))) != one
    assert type_fingerprint(numba.typeof((Swapped(2.0, 1.0),))) != type_fingerprint(numba.typeof((Pair(1.0, 2.0),)))
    assert type_fingerprint(numba.typeof(np.zeros(3))) == type_fingerprint(numba.typeof(np.ones(2)))


def test_a_functions_own_options_are_part_of_its_code():
    def half(x):
        return 0.5 * x

    options = {}, {"fastmath": True}, {"fastmath": {"nsz"}}
    found = [options_fingerprint(numba.njit(**one)(half).targetoptions) for one in options]
    assert all(found.count(one) == 1 for one in found)


EVERY = """
import importlib, pkgutil
from numba.core.dispatcher import Dispatcher
import etb_hil
from etb_hil.base.fingerprint import fingerprint, options_fingerprint
found = {}
for each in pkgutil.walk_packages(etb_hil.__path__, "etb_hil."):
    if each.name.endswith("__main__") or ".migrations." in each.name:  # programs of their own
        continue
    for name, value in vars(importlib.import_module(each.name)).items():
        if isinstance(value, Dispatcher):
            found[f"{each.name}.{name}"] = fingerprint(value.py_func), options_fingerprint(value.targetoptions)
for name, value in sorted(found.items()):
    print(name, value)
"""


def test_every_process_has_the_same_for_every_compiled_function_of_the_package():
    """Or a process would compile what others have compiled before it; sets have another order in each."""
    said = [
        subprocess.run(
            [sys.executable, "-c", EVERY], env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True, text=True, check=True,
        ).stdout.splitlines()
        for seed in ("1", "2")
    ]  # fmt: skip
    assert len(said[0]) > 100
    assert said[0] == said[1]
