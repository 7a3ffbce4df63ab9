"""That strangers' type checkers know the interface."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import etb_hil

HERE = Path(__file__).parent
CACHE = HERE.parents[1] / ".mypy_cache" / "downstream"  # of every later run in this checkout
CHECKERS = [
    pytest.param(
        ["mypy", "--strict", "--config-file", "", "--cache-dir", str(CACHE)], id="mypy", marks=pytest.mark.study
    ),
    pytest.param(["basedpyright", "--level", "error"], id="basedpyright"),
]


@pytest.mark.parametrize("checker", CHECKERS)
def test_a_typed_program_of_somebody_else_checks(checker, tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(Path(etb_hil.__file__).parent.parent)}
    done = subprocess.run(
        [sys.executable, "-m", *checker, str(HERE / "downstream")],
        capture_output=True, text=True, check=False, cwd=tmp_path, env=environment,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
