"""A terminal that is closed amid a run: the drive goes off, and all that is known of the unit is kept."""

import json
import os

import pytest
from terminal import ETB_HIL, HELD, Terminal

from etb_hil.base.output import Output
from etb_hil.cli.keyboard import Keyboard
from etb_hil.results.json_file import result_from_dict

SCENARIO = f"""schema: etb_hil/scenario/1
name: held
phases:
{HELD}"""


def test_a_closed_terminal_costs_neither_results_nor_report(tmp_path):
    (tmp_path / "held.yaml").write_text(SCENARIO)
    terminal = Terminal(tmp_path, *ETB_HIL, "run", "held.yaml", "--json", "out.json")
    terminal.until("phase  held")
    assert terminal.close() == 5
    (session,) = (path.parent for path in tmp_path.glob("sessions/*/session.json"))
    results = result_from_dict(json.loads((session / "results.json").read_text()))
    assert (results.bench.safe_state, results.bench.reason) == (True, "SIGHUP")
    assert (session / "report.html").is_file()
    assert result_from_dict(json.loads((tmp_path / "out.json").read_text())) == results


def test_a_terminal_closed_amid_a_queue_ends_it_with_what_was_known(tmp_path):
    (tmp_path / "held.yaml").write_text(SCENARIO)
    terminal = Terminal(tmp_path, *ETB_HIL, "run", "held.yaml", "--batch", "--json", "out.json")
    terminal.until("'q' ends):")
    terminal.press("SN-1\n")
    terminal.until("phase  held")
    terminal.press("s")
    terminal.until("('r' repeats SN-1, 'q' ends):")
    terminal.press("SN-2\n")
    terminal.until("phase  held")
    assert terminal.close() == 5
    sessions = [path.parent for path in tmp_path.glob("sessions/*/session.json")]
    results = {read.unit.serial: read.bench for read in map(_results, sessions)}
    reasons = {serial: (bench.safe_state, bench.reason) for serial, bench in results.items()}
    assert reasons == {"SN-1": (True, "key s or r"), "SN-2": (True, "SIGHUP")}
    assert all((session / "report.html").is_file() for session in sessions)


def test_a_terminal_closed_before_a_queue_begins_leaves_nothing_behind(tmp_path):
    (tmp_path / "held.yaml").write_text(SCENARIO)
    terminal = Terminal(tmp_path, *ETB_HIL, "run", "held.yaml", "--batch")
    terminal.until("'q' ends):")
    assert terminal.close() == 5
    assert not (tmp_path / "sessions").exists()


def test_a_terminal_closed_before_a_serial_number_is_typed_leaves_nothing_behind(tmp_path):
    (tmp_path / "held.yaml").write_text(SCENARIO)
    terminal = Terminal(tmp_path, *ETB_HIL, "run", "held.yaml", "--serial", "-")
    terminal.until("then Enter:")
    assert terminal.close() == 5
    assert not (tmp_path / "sessions").exists()


def _results(session):
    return result_from_dict(json.loads((session / "results.json").read_text()))


@pytest.fixture
def gone():
    """Return the side of a terminal whose other side is closed while it is entered as a keyboard."""
    main, side = os.openpty()
    with Keyboard(side) as keyboard:
        os.close(main)
        yield side, keyboard
    os.close(side)


def test_keys_of_a_terminal_that_is_gone_are_none(gone):
    assert gone[1].read() == ""


def test_words_for_a_terminal_that_is_gone_go_nowhere(gone):
    with pytest.raises(OSError, match="Input/output error"):
        os.write(gone[0], b"verdict")
    screen = Output(gone[0], "utf-8")
    print("verdict", file=screen)
    print("more", file=screen)
    assert screen.failure is None
