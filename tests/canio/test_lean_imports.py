"""Commands of ours import neither asammdf nor scipy with python-can and numba, and still use both where needed."""

import subprocess
import sys

import asammdf
import numpy as np
from can.io.mf4 import STD_DTYPE

COMMAND = """
import sys
from etb_hil.cli.main import main
assert main() == 0
print(sorted({"can", "pandas"} & set(sys.modules)))
"""


def run(source, out):
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", COMMAND, "export", source, out],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_asammdf_is_imported_only_where_it_is_needed(tmp_path):
    line = "(1.5) can0 123#0011\n"
    (tmp_path / "log.log").write_text(line)
    assert "['can']" in run(tmp_path / "log.log", tmp_path / "out.asc")
    records = np.zeros(1, STD_DTYPE)
    records["CAN_DataFrame.ID"] = 0x123
    with asammdf.MDF(version="4.10") as mdf:
        bus = asammdf.blocks.source_utils.Source("CAN", "CAN", "", 2, 2)
        short = np.array([1.0], "<f4")  # times that our own reader does not take
        mdf.append([asammdf.Signal(records, short, name="CAN_DataFrame", source=bus)])
        mdf.save(tmp_path / "odd.mf4", overwrite=True)
    assert "1 frames read" in run(tmp_path / "odd.mf4", tmp_path / "out.log")


TESTER_OF_A_PLUGIN = """
import sys
from etb_hil.base.lean_imports import keep_imports_lean
keep_imports_lean()
import cantools
assert "can" not in sys.modules
print(cantools.tester.Tester.__module__, "can" in sys.modules)
from cantools.tester import Tester
assert Tester is cantools.tester.Tester
"""


def test_python_can_is_imported_only_for_who_uses_the_tester_of_cantools():
    done = subprocess.run([sys.executable, "-c", TESTER_OF_A_PLUGIN], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("cantools.tester True\n", "")


KERNEL_OF_A_PLUGIN = """
import sys
import numba
import numpy as np
from etb_hil.base.lean_imports import keep_imports_lean
keep_imports_lean()
from etb_hil.plant.exactmath import exp
assert exp(0.0) == 1.0
assert "scipy.linalg" not in sys.modules
print(numba.njit(lambda a: np.dot(a, a))(np.array([3.0, 4.0])), "scipy.linalg" in sys.modules)
"""


def test_linear_algebra_of_scipy_is_imported_only_where_a_kernel_calls_it():
    done = subprocess.run([sys.executable, "-c", KERNEL_OF_A_PLUGIN], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("25.0 True\n", "")


READER_OF_A_PLUGIN = """
import sys
from etb_hil.base.lean_imports import keep_imports_lean
keep_imports_lean()
import can
assert "asammdf" not in sys.modules
import asammdf
print(asammdf.MDF.__name__)
"""


def test_a_plugin_imports_asammdf_as_ever():
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", READER_OF_A_PLUGIN], capture_output=True, text=True, check=False
    )
    assert (done.stdout, done.stderr) == ("MDF\n", "")
