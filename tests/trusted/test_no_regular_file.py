"""What is no regular file is refused at once, whichever reader it is given to."""

import os
import shutil
import socket

import pytest
from whole_run import run_briskly_on

from etb_hil.base.errors import MOST_PROBLEMS, InputError, Place, Problem
from etb_hil.cli.main import main

KINDS = {"a FIFO": os.mkfifo, "a device": lambda path: path.symlink_to("/dev/zero"), "a folder": os.mkdir}
LOGS = ["x.blf", "x.asc", "x.log", "x.trc", "x.csv", "x.db", "x.mf4", "x.blf.gz", "x.asc.gz", "x.trc.gz", "x.db.gz"]
READERS = [
    *(["replay", name, "--bench", "virtual_fd"] for name in LOGS),
    ["export", "x.blf", "out.blf"],
    *(["plot", name, "--out", "out.png"] for name in ("x.csv", "x.txt", "x.mat", "x.parquet", "x.blf")),
    ["explain", "x.csv", "--model", "default"],
    ["simulate", "--voltage", "x.csv"],
    ["new", "x.dbc", "--out", "new"],
    ["history", "x.db"],
    ["replay", "session", "--model", "x.yaml"],
    ["replay", "session", "--limits", "x.yaml"],
    ["run", "x.yaml"],
    ["check", "x.yaml"],
]


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    return run_briskly_on(tmp_path_factory.mktemp("runs")).session.folder


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("words", READERS, ids=" ".join)
def test_it_is_refused(tmp_path, monkeypatch, capsys, session, words, kind):
    monkeypatch.chdir(tmp_path)
    if "session" in words:
        (tmp_path / "session").symlink_to(session)
    name = next(word for word in words if word.startswith("x."))
    KINDS[kind](tmp_path / name)
    assert main(words) == 2
    said = capsys.readouterr().err
    assert name in said or words[0] == "history"  # which takes folders
    assert len(said) < 2000


@pytest.mark.parametrize("kind", ["a FIFO", "a device"])
@pytest.mark.parametrize("part", ["session.json", "results.json", "events.jsonl", "raw.blf", "inputs/bench.yaml"])
@pytest.mark.parametrize("command", ["replay", "export", "history"])
def test_a_part_of_a_session_is_refused(tmp_path, capsys, session, command, part, kind):
    folder = tmp_path / "session"
    shutil.copytree(session, folder)
    (folder / part).unlink()
    KINDS[kind](folder / part)
    code = main([command, str(folder), *([str(tmp_path / "x.blf")] if command == "export" else [])])
    shutil.rmtree(folder)  # what looks at the runs of every test would wait for the FIFO
    assert code in {0, 2}
    said = capsys.readouterr().err
    assert "Error(" not in said
    needed = {("session.json", "replay"), ("session.json", "export"), ("raw.blf", "replay"), ("events.jsonl", "replay")}
    if (part, command) in needed:
        assert code == 2
        assert part in said


def test_a_socket_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind("x.blf")
        assert main(["replay", "x.blf", "--bench", "virtual_fd"]) == 2
    assert "x.blf: is a socket, no regular file" in capsys.readouterr().err


def test_messages_are_short_whatever_stands_in_a_file():
    long = "0" * 1_000_000
    problem = Problem(long, Place("file", 1, long), long, long, long)
    assert len(str(problem)) < 6000
    problems = InputError(*[Problem("is wrong", Place("file", line)) for line in range(1000)])
    assert str(problems).count("is wrong") == MOST_PROBLEMS
    assert f"and {1000 - MOST_PROBLEMS} more" in str(problems)
