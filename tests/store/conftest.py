"""The server that the tests of the store share."""

import os
import shutil
import tempfile
from pathlib import Path

import pytest
from postgres_cluster import BINARIES, Cluster


@pytest.fixture(scope="session")
def cluster():
    if not BINARIES:
        assert "ETB_HIL_NEEDS_POSTGRESQL" not in os.environ
        pytest.skip("PostgreSQL is not installed")
    folder = Path(tempfile.mkdtemp(prefix="etb-store-"))
    server = Cluster(folder)
    server.start()
    yield server
    server.stop()
    shutil.rmtree(folder, ignore_errors=True)
