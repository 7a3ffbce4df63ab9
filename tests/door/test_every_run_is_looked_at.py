"""The look at the bus that ends each test reaches a test that loads the bench late, and runs alone."""

import os
import subprocess
import sys
from pathlib import Path

TESTS = Path(__file__).parents[1]
LATE = """
def test_that_loads_the_bench_late():
    from etb_hil.bench import job, results
    assert job.results_of is not results.results_of
"""


def test_a_bench_that_is_loaded_late_is_looked_at(tmp_path):
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers = spoilt: as in the project\n")
    (tmp_path / "test_late.py").write_text(LATE)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "conftest", "-p", "no:cacheprovider", str(tmp_path)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(TESTS), os.environ.get("PYTHONPATH", "")])},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert "1 passed" in done.stdout
