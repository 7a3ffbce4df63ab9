"""No command's exit code changes, and none ends in a traceback, where its output is lost or cannot be encoded."""

import subprocess
import sys
from pathlib import Path

import output_study
import pytest

pytestmark = pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
LIGHT = [name for name in output_study.COMMANDS if name not in output_study.HEAVY]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("commands")
    output_study.prepare(folder)
    return folder


# Lost output is met at one place for all commands: some meet it here, all of them every night.
SOME = {"run", "run --batch", "replay SESSION", "export", "history", "check", "--help"}
ENDS = [
    pytest.param(name, "full disk", "cp932", marks=[] if name in SOME else pytest.mark.study, id=f"{name}-full disk")
    for name in LIGHT
]
ENDS += [(name, "closed pipe", "ascii") for name in ("run --json -", "replay SESSION", "check", "history", "--help")]


@pytest.mark.parametrize(("name", "sink", "encoding"), ENDS)
def test_a_command_ends_as_on_a_terminal(folder, name, sink, encoding):
    code, said = output_study.outcome(folder, name, sink, encoding)
    assert output_study.is_right(name, sink, code, said), f"{code}: {said}"
    if sink == "full disk":
        assert "standard output: cannot be written: No space left on device; make room, then repeat" in said


@pytest.mark.parametrize("name", ["replay SESSION", "history"])
def test_a_screen_without_our_characters_gets_the_whole_text(folder, name):
    code, said = output_study.outcome(folder, name, "head", "ascii")
    assert output_study.is_right(name, "head", code, said), f"{code}: {said}"


@pytest.mark.parametrize("command", ["run", "station", "new"])
def test_a_help_that_is_lost_is_no_answer_of_any_command(command):
    with Path("/dev/full").open("w", encoding="utf-8") as full:
        words = [sys.executable, "-m", "etb_hil", command, "--help"]
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
