"""A service manager or a closed terminal that ends `explain`: what was known by then is in its folder."""

import json
import signal
import subprocess

import pytest
from terminal import ETB_HIL, Terminal
from whole_run import run_on

from etb_hil.base.stock import find
from etb_hil.plant.parameters import load_model


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    return run_on(tmp_path_factory.mktemp("sessions"), unit="faulty").session.folder


@pytest.mark.parametrize("ending", [signal.SIGTERM, pytest.param(signal.SIGHUP, marks=pytest.mark.study)])
def test_what_was_known_is_kept(session, tmp_path, ending):
    terminal = Terminal(tmp_path, *ETB_HIL, "explain", str(session), "--model", "default", "--out", "answer")
    terminal.until("looking for a cause")
    terminal.program.send_signal(ending)
    assert terminal.end() == 5
    assert "interrupted while" in terminal.text
    answer = json.loads((tmp_path / "answer" / "explanation.json").read_text())
    assert answer["interrupted"]
    assert (tmp_path / "answer" / "explanation.html").is_file()


@pytest.mark.study
def test_what_nobody_ended_is_answered_whole(session, tmp_path):
    """Of a unit whose friction is too high, a base parameter of the model is what explains the session."""
    done = subprocess.run(
        [*ETB_HIL, "explain", str(session), "--model", "default", "--out", "answer"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    answer = json.loads((tmp_path / "answer" / "explanation.json").read_text())
    assert answer["interrupted"] == ""
    assert "parameter:stiction" in done.stdout
    extended = load_model(tmp_path / "answer" / "model.yaml").values
    stated = load_model(find("model", "default")).values
    assert extended.stiction > 1.2 * stated.stiction
