"""A command of ours does not import asammdf with python-can, and still reads what only asammdf knows."""

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
