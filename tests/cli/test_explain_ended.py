"""A service manager or a closed terminal that ends `explain`: what was known by then is in its folder."""

import json
import signal

import pytest
from terminal import ETB_HIL, Terminal
from whole_run import run_on


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    return run_on(tmp_path_factory.mktemp("sessions"), unit="faulty").session.folder


@pytest.mark.parametrize("ending", [signal.SIGTERM, signal.SIGHUP])
def test_what_was_known_is_kept(session, tmp_path, ending):
    terminal = Terminal(tmp_path, *ETB_HIL, "explain", str(session), "--model", "default", "--out", "answer")
    terminal.until("trying")
    terminal.program.send_signal(ending)
    assert terminal.end() == 5
    assert "interrupted while" in terminal.text
    answer = json.loads((tmp_path / "answer" / "explanation.json").read_text())
    assert answer["interrupted"]
    assert (tmp_path / "answer" / "explanation.html").is_file()
