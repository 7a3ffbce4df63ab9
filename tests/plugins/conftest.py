"""Files of plug-ins, loaded for one test."""

import shutil
from pathlib import Path

import pytest
from whole_run import BRISK

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


@pytest.fixture(scope="session")
def brisk(tmp_path_factory):
    """Return a scenario with what a verdict needs and no more."""
    path = tmp_path_factory.mktemp("scenario") / "brisk.yaml"
    path.write_text(BRISK, "utf-8")
    return path
