"""A healthy unit whose bristles bend by another law than its model file's LuGre is adequate."""

import numpy as np
import pytest
from independent_throttle import Unit, off_by_tolerances
from throttle_as_model import bench_model
from unit_faults import recorded as record_of

from etb_hil.discrepancy.answer.explanation import explanation
from etb_hil.discrepancy.explain import Answer, explain
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.model_file import FrictionModel
from etb_hil.plant.model_text import model_text
from etb_hil.plant.parameters import load_model
from etb_hil.plant.table_one import KINDS

RATE = 1000
TRIED = {"presliding_hysteresis", "parameter:stiction"}  # what bends as bristles do, and a number


@pytest.fixture(scope="module")
def recorded():
    """Return a healthy unit's friction check until the bridge opens, and the bench's model."""
    rng = np.random.default_rng(91)
    recording = record_of(Unit(law=1), 1.0, RATE, rng)
    return recording, bench_model(off_by_tolerances(Unit(), rng))


def _with_few_candidates(recording, model):
    balances = [Balances(one, model) for one in measurements_of(recording, model)]
    without = {*CATALOGUE, *(f"parameter:{name}" for name in KINDS)} - TRIED
    findings = search(model, balances, sorted(without))
    return Answer(explanation(findings, None), findings)


def _with_all_candidates(recording, model):
    return explain([recording], model)


@pytest.fixture(
    scope="module", params=[_with_few_candidates, pytest.param(_with_all_candidates, marks=pytest.mark.study)]
)
def answer(request, recorded):
    return request.param(*recorded)


def test_the_unit_is_adequate_with_the_law_that_the_record_shows(answer):
    found = answer.explanation
    assert (found.verdict, found.causes) == ("adequate", ())
    assert all(any("elasto-plastic" in flag for flag in one.flags) for one in found.data_quality)


def test_the_model_that_is_written_has_that_law(answer, tmp_path):
    path = tmp_path / "model.yaml"
    path.write_text(model_text(answer.model, "as found"), "utf-8")
    assert load_model(path).friction_model is FrictionModel.ELASTO_PLASTIC


@pytest.mark.parametrize(
    ("law", "answered"),
    [
        pytest.param(2, _with_few_candidates, id="Maxwell slip"),
        pytest.param(2, _with_all_candidates, id="Maxwell slip, every candidate", marks=pytest.mark.study),
        pytest.param(3, _with_all_candidates, id="GMS, every candidate", marks=pytest.mark.study),
    ],
)
def test_a_unit_whose_bristles_bend_by_no_known_law_is_adequate_and_that_is_said(law, answered):
    rng = np.random.default_rng(92)
    recording = record_of(Unit(law=law), 1.0, RATE, rng)
    found = answered(recording, bench_model(off_by_tolerances(Unit(), rng))).explanation
    assert (found.verdict, found.causes) == ("adequate", ())
    assert all(any("was left open" in flag for flag in one.flags) for one in found.data_quality)


@pytest.mark.study
def test_an_interrupt_while_the_other_law_is_tried_keeps_the_first_search(recorded):
    said = []

    def interrupting(what):
        said.append(what)
        if said.count("calibrating inside the stated tolerances") == 2:
            raise KeyboardInterrupt

    found = explain([recorded[0]], recorded[1], interrupting).explanation
    assert "trying bristles of another law" in said
    assert found.verdict == "unexplained"
    assert found.interrupted
    assert found.calibrated
