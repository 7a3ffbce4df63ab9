"""Every reason has words, and what is said of P2119 follows the numbers."""

from dataclasses import replace

import pytest
import sample_run

from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.report.model import Bench, Number, Unit
from etb_hil.report.wording import (
    BENCH_REASONS,
    UNIT_REASONS,
    bench_wording,
    further_reasons,
    spring_or_friction,
    unit_wording,
    with_words,
)


@pytest.mark.parametrize("reason_id", UNIT_REASONS)
def test_unit_reasons_are_sentences_with_their_numbers_filled_in(reason_id):
    results = sample_run.results(unit=Unit(UnitVerdict.FAIL, reason_id))
    words = unit_wording(results)
    for sentence in (words.reason, words.next_step):
        assert sentence.endswith(".")
        assert "{" not in sentence
    assert "not measured" not in words.reason


@pytest.mark.parametrize("reason_id", BENCH_REASONS)
def test_bench_reasons_say_what_was_measured_and_what_to_do(reason_id):
    results = sample_run.results(bench=Bench(BenchOutcome.FAULT, reason_id, "12.3 A"))
    words = bench_wording(results)
    assert words.reason == f"{BENCH_REASONS[reason_id].reason} (12.3 A)"
    assert words.next_step.endswith(".")


def test_numbers_that_are_missing_are_said_to_be():
    results = sample_run.results(unit=Unit(UnitVerdict.FAIL, "stiction_above_limit"), numbers=())
    assert unit_wording(results).reason == "Break-away friction is not measured; the limit is none."


def test_words_of_the_results_outrank_ours():
    results = sample_run.results(unit=Unit(UnitVerdict.FAIL, "stiction_above_limit", "Because.", "Do this."))
    assert unit_wording(results).reason == "Because."
    assert unit_wording(results).next_step == "Do this."


@pytest.mark.parametrize("verdict", UnitVerdict)
def test_unknown_reasons_still_say_what_to_do(verdict):
    words = unit_wording(sample_run.results(unit=Unit(verdict, "invented_later")))
    assert words.reason
    assert words.next_step


def test_further_reasons_come_after_the_first():
    unit = Unit(UnitVerdict.FAIL, "stiction_above_limit", also=("return_margin_low", "invented_later"))
    (sentence,) = further_reasons(sample_run.results(0.567, unit=unit))
    assert "-0.217 N·m" in sentence


def test_words_written_out_stay_the_same_when_read_again():
    results = sample_run.results(bench=Bench(BenchOutcome.FAULT, "current_limit", "12.3 A"))
    once = with_words(results)
    assert with_words(once) == once


def standing(*failed, springs=True):
    ids = ["T_st", "T_c", "return_margin", *(["preload_open", "preload_close"] if springs else [])]
    return sample_run.results(
        numbers=tuple(Number(i, i, 0.1, "N·m", verdict="fail" if i in failed else "pass") for i in ids)
    )


@pytest.mark.parametrize(
    ("results", "said"),
    [
        (standing("T_st"), "it is friction: it is above its limit, the return spring is within its limits"),
        (standing("T_c", springs=False), "The spring's torque was not measured on its own"),
        (standing("preload_close", "return_margin"), "it is the return spring"),
        (standing("preload_open", "T_st"), "it is both"),
        (standing("return_margin"), "too little margin over friction, though friction is within its limits"),
    ],
)
def test_p2119_names_spring_or_friction(results, said):
    sentence = spring_or_friction(results)
    assert "P2119" in sentence
    assert said in sentence


def test_p2119_is_not_spoken_of_for_a_good_unit():
    assert spring_or_friction(standing()) == ""
    assert spring_or_friction(replace(standing(), numbers=())) == ""
