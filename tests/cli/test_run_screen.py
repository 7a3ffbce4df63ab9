"""The run screen on a terminal of 80 x 24: keys, prompts, a queue of units, and a verdict that stays."""

import json
from pathlib import Path

import pytest
from terminal import ETB_HIL, HELD, Terminal

LONG = f"""schema: etb_hil/scenario/1
name: held
phases:
  - id: clamped
    kind: prompt
    text: Is the unit clamped and its connector locked?
    answers: [yes, no]
    timeout: 100 s
{HELD}"""
STATION = Path(__file__).resolve().parents[2] / "docs" / "examples" / "line.station.yaml"
COLOURS = [b"\x1b[3%dm" % colour for colour in range(8)] + [b"\x1b[1;3%dm" % colour for colour in range(8)]


@pytest.fixture
def scenario(tmp_path):
    path = tmp_path / "held.yaml"
    path.write_text(LONG)
    return path


def bench_of(folder):
    return [json.loads(path.read_text())["bench"] for path in sorted(folder.glob("sessions/*/results.json"))]


def test_a_queue_of_units_with_keys_to_stop_abort_and_repeat(tmp_path, scenario):
    terminal = Terminal(tmp_path, *ETB_HIL, "run", scenario.name, "--batch")
    terminal.until("Next serial number and Enter ('q' ends):")
    terminal.press("SN-0042\n")  # a scanner types, too
    shown = terminal.until("1 yes   2 no")
    assert "? Is the unit clamped and its connector locked?" in shown
    assert not terminal.keeps_line_mode
    terminal.press("1")
    shown = terminal.until("phase  held")
    assert "keys: s stop (plate led home)   r stop and repeat   a abort (drive off now)" in shown
    assert "held - serial SN-0042 - Virtual bench" in shown
    terminal.press("s")
    shown = terminal.until("('r' repeats SN-0042, 'q' ends):")
    assert "#####" in shown  # the verdict is large, and all of it is on the screen
    assert "STOPPED - serial SN-0042" in shown
    assert "The operator stopped the run (key s or r)." in shown
    assert "Next     Repeat the test when the bench is clear." in shown
    assert "1 unit: 1 stopped" in shown
    assert terminal.keeps_line_mode
    terminal.press("r\n")
    terminal.until("1 yes   2 no")
    assert "last: SN-0042 stopped; so far 1 unit: 1 stopped" in terminal.text
    terminal.press("1")
    terminal.until("phase  held")
    terminal.press("a")
    terminal.until("1 unit in 2 runs: 1 aborted")
    terminal.until("'q' ends):")
    terminal.press("r\n")
    terminal.until("so far 1 unit in 2 runs: 1 aborted")
    terminal.press("\x03")  # while a question is open, on a bench whose time is its own
    terminal.until("1 unit in 3 runs: 1 aborted")
    terminal.until("'q' ends):")
    terminal.press("q\n")
    assert terminal.end() == 5
    assert "aborted       SN-0042  (runs: stopped, aborted, aborted)" in terminal.text
    first, second, third = bench_of(tmp_path)
    assert (first["reason"], first["safe_state"]) == ("key s or r", True)
    assert (second["reason"], second["safe_state"]) == ("key a, Ctrl-C or STOP", True)
    assert (third["reason"], third["safe_state"]) == ("key a, Ctrl-C or STOP", True)


def test_a_key_repeats_one_unit_and_nothing_moves_until_enter(tmp_path, scenario):
    terminal = Terminal(tmp_path, *ETB_HIL, "run", scenario.name, "--serial", "SN-7")
    terminal.until("1 yes   2 no")
    terminal.press("1")
    terminal.until("phase  held")
    terminal.press("r")
    shown = terminal.until("Enter runs SN-7 again, 'q' ends:")
    assert "STOPPED - serial SN-7" in shown
    assert terminal.keeps_line_mode
    assert len(bench_of(tmp_path)) == 1
    terminal.press("\n")
    terminal.until("1 yes   2 no")
    terminal.press("1")
    terminal.until("phase  held")
    terminal.press("s")  # which does not ask
    assert terminal.end() == 5
    assert [(run["reason_id"], run["safe_state"]) for run in bench_of(tmp_path)] == [("stopped_by_operator", True)] * 2


def test_a_station_and_its_queue_of_units(tmp_path):
    terminal = Terminal(tmp_path, *ETB_HIL, "run", "--station", str(STATION), "--batch")
    shown = terminal.until("'q' ends):")
    assert "The bench may not judge units: the bench has not checked itself with the golden" in shown
    assert "serial number GOLD-1, first." in shown
    terminal.press("XYZ\n")
    assert "no part of this station has such a serial number (it is 'XYZ'); allowed:\n" in terminal.until("scan again")
    terminal.press("GOLD-1\n")
    shown = terminal.until("'r' repeats GOLD-1, 'q' ends):")
    assert "Next     Put the golden unit back; the bench is fit to judge units." in shown
    assert "Release" not in shown
    terminal.press("ETB-0001\n")
    # `r` is not offered: it would be refused.
    shown = terminal.until("Tally    2 units: 2 pass\n\nNext serial number and Enter ('q' ends):")
    assert "Next     Release the unit." in shown
    terminal.press("ETB-0001\n")
    terminal.until("scan again, or set it")
    assert "the unit was judged already (it is 'ETB-0001: pass on" in terminal.text
    terminal.press("q\n")
    assert terminal.end() == 0
    assert "Batch ended: 2 units: 2 pass" in terminal.text


def test_a_verdict_stays_without_colour_and_the_serial_number_is_typed(tmp_path):
    terminal = Terminal(tmp_path, *ETB_HIL, "run", "--unit", "faulty", "--serial", "-", NO_COLOR="1")
    terminal.until("Serial number, then Enter:")
    terminal.press("SN 7\n")
    assert terminal.end() == 10
    shown = terminal.text
    for expected in (
        "#####  ###  ### #",
        "FAIL - serial SN 7",
        "Break-away friction is",
        "Next     Do not fit",
        "Report",
    ):
        assert expected in shown
    assert not terminal.screen.cursor.hidden
    assert not [code for code in COLOURS if code in terminal.bytes]


def test_an_answer_may_be_typed_in_words_and_no_is_an_end(tmp_path, scenario):
    terminal = Terminal(tmp_path, *ETB_HIL, "run", scenario.name, TERM="dumb")
    terminal.until("1 yes   2 no")
    terminal.press("maybe\n")
    terminal.until("no answer to this; allowed: yes, no")
    terminal.press("n0\x7fo\n")
    assert terminal.end() == 5
    assert "The run was ended by the operator's answer (" in terminal.text
    assert b"\x1b" not in terminal.bytes
