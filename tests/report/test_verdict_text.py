"""The verdict on a screen of 80 columns and in a log."""

from pathlib import Path

import pytest
import sample_run

from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.report.verdict import WIDTH, banner, verdict_of, verdict_text
from etb_hil.results.run_result import Bench, Unit

CASES = {
    "PASS": sample_run.results(),
    "FAIL": sample_run.results(0.567),
    "INCONCLUSIVE": sample_run.results(
        unit=Unit(UnitVerdict.INCONCLUSIVE, "too_little_motion", "the plate moved by 0.57 deg")
    ),
    "BENCH FAULT": sample_run.results(0.567, bench=Bench(BenchOutcome.FAULT, "frames_stopped", safe_state=False)),
    "ABORTED": sample_run.results(unit=Unit(None), bench=Bench(BenchOutcome.ABORTED, "aborted_by_operator")),
    "STOPPED": sample_run.results(unit=Unit(None), bench=Bench(BenchOutcome.ABORTED, "stopped_by_operator")),
}


@pytest.mark.parametrize("headline", CASES)
def test_says_it_large_and_why_and_what_next(headline):
    text = verdict_text(CASES[headline], Path("sessions/one/report.html"))
    lines = text.splitlines()
    assert max(len(line) for line in lines) <= WIDTH
    assert len(lines) < 24
    for row in banner(headline):
        assert f"  {row}" in lines
    assert f"Result   {headline} - " in text
    assert "Why      " in text
    assert "Next     " in text
    assert "Report   sessions/one/report.html" in text


def test_bench_fault_outranks_and_never_blames_the_unit():
    verdict = verdict_of(CASES["BENCH FAULT"])
    assert verdict.tone == "fault"
    assert "0.567" not in verdict.reason + " ".join(verdict.further)
    assert "switch the supply off" in verdict_text(CASES["BENCH FAULT"])


def test_names_cannot_steer_the_terminal():
    unit = Unit(UnitVerdict.PASS, "invented_later", serial="\x1b[2J\x07 1\r\n2", reason="a\x1b]0;title\x07b")
    text = verdict_text(sample_run.results(unit=unit))
    assert all(character.isprintable() or character == "\n" for character in text)


def test_values_stay_with_their_units():
    lines = verdict_text(CASES["PASS"]).splitlines()
    assert not any(line[-1:].isdigit() for line in lines)
    assert any(line.endswith("N·m") or "N·m)" in line for line in lines)


@pytest.mark.parametrize("headline", CASES)
@pytest.mark.parametrize("rows", [12, 16, 20])
def test_on_a_small_screen_further_reasons_give_way_and_nothing_else(headline, rows):
    full = verdict_text(CASES[headline])
    short = verdict_text(CASES[headline], rows=rows)
    assert len(short.splitlines()) <= max(rows, 15)  # headline, result, reason, caution and what to do always stand
    assert verdict_text(CASES[headline], rows=100) == full
    for row in banner(headline):
        assert row in short
    assert short.splitlines()[-1] == full.splitlines()[-1]  # what to do
    if short != full:
        assert "More stands in the report." in short or rows == 12


@pytest.mark.parametrize("headline", CASES)
def test_a_narrow_terminal_breaks_no_word(headline):
    text = verdict_text(CASES[headline], columns=60)
    assert max(map(len, text.splitlines())) <= 60
    assert f"  {headline}\n" in text or "###" in text
