"""Files of plug-ins, loaded for one test."""

import shutil
from pathlib import Path

import pytest

from etb_hil import plugins

EXAMPLE = Path(__file__).resolve().parents[2] / "docs" / "examples" / "plugin"
PARTS = EXAMPLE / "throttle_extras"


@pytest.fixture(autouse=True)
def none_left():
    """Take out what a test loaded."""
    yield
    for one in plugins.loaded():
        plugins.unload(one.file)


@pytest.fixture
def part(tmp_path):
    """Return what copies a file of the example package, to be loaded by itself."""

    def copied(name):
        return Path(shutil.copy(PARTS / f"{name}.py", tmp_path))

    return copied
