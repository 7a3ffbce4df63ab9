"""Exported files are of a session's latest data, and none is made while a test is under way."""

import asyncio
import os
import sys

import pytest

from etb_hil.page.session_files import BenchInUse, SessionFiles

EXPORTS = """
import pathlib, sys
session, table = map(pathlib.Path, sys.argv[-2:])
table.write_bytes(session.joinpath("raw.blf").read_bytes())
"""


@pytest.fixture
def session(tmp_path, monkeypatch):
    """A session, and an `etb-hil export` that copies its frames."""
    nice = tmp_path / "bin" / "nice"
    nice.parent.mkdir()
    nice.write_text(f"#!{sys.executable}\n{EXPORTS}")
    nice.chmod(0o755)
    monkeypatch.setenv("PATH", f"{nice.parent}:{os.environ['PATH']}")
    folder = tmp_path / "sessions" / "run-1"
    folder.mkdir(parents=True)
    (folder / "session.json").write_text("{}")
    (folder / "raw.blf").write_bytes(b"half")
    return folder


def test_a_session_that_was_still_written_is_exported_again(session, tmp_path):
    async def exported():
        files = SessionFiles(session.parent, tmp_path / "exports")
        path = await files.exported("run-1", "csv", lambda: False)
        assert path.read_bytes() == b"half"
        (session / "raw.blf").write_bytes(b"half and the rest")
        assert await files.exported("run-1", "csv", lambda: False) == path
        assert path.read_bytes() == b"half and the rest"
        path.write_bytes(b"kept")
        assert (await files.exported("run-1", "csv", lambda: True)).read_bytes() == b"kept"

    asyncio.run(exported())


def test_no_file_is_made_once_a_test_has_begun_while_another_one_was_made(session, tmp_path):
    testing = []

    async def exported():
        files = SessionFiles(session.parent, tmp_path / "exports")
        first = asyncio.create_task(files.exported("run-1", "csv", lambda: bool(testing)))
        await asyncio.sleep(0)
        second = asyncio.create_task(files.exported("run-1", "mf4", lambda: bool(testing)))
        await asyncio.sleep(0)
        testing.append(True)
        await first
        with pytest.raises(BenchInUse):
            await second

    asyncio.run(exported())
