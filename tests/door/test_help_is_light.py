"""`etb-hil --help` answers at once: it loads none of the heavy libraries."""

from __future__ import annotations

import subprocess
import sys

HEAVY = {"numpy", "numba", "llvmlite", "can", "cantools", "pydantic", "yaml", "rich", "matplotlib", "scipy"}
LOADED_BY_HELP = """
import sys
from etb_hil.cli.main import main
try:
    main(["--help"])
except SystemExit as left:
    assert left.code == 0, left.code
print(*sys.modules, file=sys.stderr)
"""


def test_help_loads_nothing_heavy():
    done = subprocess.run([sys.executable, "-c", LOADED_BY_HELP], capture_output=True, text=True, check=True)
    loaded = set(done.stderr.split())
    assert "etb_hil.cli.main" in loaded
    assert not loaded & HEAVY
    assert "run" in done.stdout
    assert "exit codes" in done.stdout
