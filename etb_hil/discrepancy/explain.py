"""Explain recordings by a model, and write the answer's files."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ParamSpec, TypeVar

import numpy as np

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.files import make_folder, write_bytes, write_text
from etb_hil.base.stock import find
from etb_hil.diagnosis.limits import Limits
from etb_hil.discrepancy.answer.consequence import Judge, consequence
from etb_hil.discrepancy.answer.drive_names import as_in_its_file
from etb_hil.discrepancy.answer.explanation import explanation
from etb_hil.discrepancy.answer.folder import ANSWER_NAME, MODEL_NAME, TEST_NAME, must_not_lose
from etb_hil.discrepancy.answer.holdout import Holdout, hold_out
from etb_hil.discrepancy.answer.insufficient_data import nothing_to_judge, too_little_to_reject
from etb_hil.discrepancy.answer.quality import data_quality
from etb_hil.discrepancy.answer.transfer import transfer
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.confounding import confounded
from etb_hil.discrepancy.measured.device_roles import must_be_of_one_kind
from etb_hil.discrepancy.measured.drive_work import must_do_its_work
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.plausibility import must_be_of_throttle, must_be_of_winding
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.plan.narrowing import narrow
from etb_hil.discrepancy.plan.next_test import next_test
from etb_hil.discrepancy.plan.planned import Plan
from etb_hil.discrepancy.search.extended_model import extended_model
from etb_hil.discrepancy.search.findings import Bristles, Findings
from etb_hil.discrepancy.search.interruption import Interrupted, calibrated_so_far, stages
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.discrepancy.slow.coarse import Coarse, explain_coarsely
from etb_hil.discrepancy.slow.sweeps import is_slow, sweeps_of
from etb_hil.plant.effects.laws import laws
from etb_hil.plant.model_check import impossible
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector
from etb_hil.recording.recording import Recording
from etb_hil.results.explained.causes import Isolation
from etb_hil.results.explained.next_test import NextTest
from etb_hil.results.explained.residual import Confounded, DataQuality
from etb_hil.results.explanation import ExplanationResult
from etb_hil.results.explanation_file import explanation_as_dict

P = ParamSpec("P")
T = TypeVar("T")


@dataclass(slots=True)
class Answer:
    """The result with the findings of a search, or with the free runs of slow data."""

    explanation: ExplanationResult
    findings: Findings | None = None
    holdout: Holdout | None = None
    coarse: Coarse | None = None

    @property
    def model(self) -> Model | None:
        """The model with the accepted causes; None where nothing was fitted."""
        if self.findings is not None:
            return extended_model(self.findings, _best(self.findings, self.holdout))
        is_judged = self.coarse is not None and self.explanation.verdict != "insufficient_data"
        return self.coarse.model if self.coarse is not None and is_judged else None


def explain(
    recordings: Sequence[Recording],
    model: Model,
    progress: Callable[[str], None] = lambda _: None,
    limits: Limits | None = None,
    judge: Judge | None = None,
    plans: Callable[[], Sequence[Plan]] | None = None,
    fit_on: Sequence[float] = (),
    *,
    is_same_unit: bool = False,
) -> Answer:
    """Explain the first of some recordings by a model; test the causes on the others.

    All recordings are of one kind of unit. With `limits` the answer says what the causes change in the diagnosis;
    `judge` diagnoses the first recording as the bench does that made it. `is_same_unit`: all recordings are of one
    unit, so that what one of them isolates is isolated in the answer. `plans` makes the scenarios from which the next
    test is chosen.

    Data too slow to name causes are fitted in free run where a condition has the values `fit_on`, and judged elsewhere.
    An interrupt ends the work with what is known by then, and the answer says so. InputError where no run has a value
    of `fit_on`, and where a throttle's recording meets a drive's model or a drive's recording a throttle's.
    """
    must_be_of_one_kind(recordings, model)
    model = _obeying_its_laws(model, recordings)
    said = _Said(progress)
    confounding: list[Confounded] = []
    balances: list[Balances] = []
    try:
        confounding = [one for recording in recordings for one in confounded(recording)]
        segments, others, missing = _read(recordings, model)
        if not segments or fit_on:
            return _coarsely(recordings[0], model, fit_on, said, missing, confounding)
        balances = [Balances(measured, model) for measured in segments]
        findings, why = _searched(segments, balances, model, said)
        if findings is None:
            return _insufficient(why, balances, model, confounding, said)
    except KeyboardInterrupt as interrupt:
        return _before_the_search(said, model, balances, confounding, interrupt)
    distinguished = _distinguished_by_others(findings, others if is_same_unit else (), said)
    holdout = None if said.is_interrupted else _held_out(findings, said)
    answer = _put_together(findings, holdout, said)
    if plans and answer.next_test and not said.is_interrupted:
        test = said.unless_interrupted("choosing the next test", lambda: next_test(findings, plans(), said))
        answer = replace(answer, next_test=test or answer.next_test)
    if limits is not None and not said.is_interrupted:
        judged = said.unless_interrupted(
            "judging the unit", consequence, findings, limits, _best(findings, holdout), judge
        )
        answer = replace(answer, diagnosis=judged)
    if others and not said.is_interrupted:
        answer = _transferred(answer, findings, others, said)
    answer = replace(
        answer, isolations=distinguished, confounded=tuple(confounding), rejected_recordings=tuple(missing)
    )
    if said.is_interrupted:
        answer = _as_interrupted(answer, said, is_read=True, is_searched=not findings.is_interrupted)
    return Answer(as_in_its_file(answer, model), findings, holdout)


def _searched(
    segments: Sequence[Measurement], balances: list[Balances], model: Model, said: _Said
) -> tuple[Findings | None, list[str]]:
    """Return the findings of a search, or the reasons why these data are insufficient."""
    if why := nothing_to_judge(balances):
        return None, why
    findings = search(model, balances, progress=said)
    if findings.is_interrupted:
        said.interrupt()
    why = too_little_to_reject(findings, segments)
    return (None, why) if why else (findings, [])


def _insufficient(
    why: list[str], balances: Sequence[Balances], model: Model, confounding: Sequence[Confounded], said: _Said
) -> Answer:
    """Return the answer to insufficient data with the reasons, also if interrupted."""
    answer = _nothing((*why, *data_quality(balances, model)), confounding)
    if said.is_interrupted:
        answer = _as_interrupted(answer, said, is_read=True)
    return Answer(as_in_its_file(answer, model))


def _before_the_search(
    said: _Said,
    model: Model,
    balances: Sequence[Balances],
    confounding: Sequence[Confounded],
    interrupt: KeyboardInterrupt,
) -> Answer:
    """Return what is known where an interrupt came before the search for causes."""
    answer = _nothing(data_quality(balances, model), confounding)
    if isinstance(interrupt, Interrupted):
        answer = replace(answer, calibrated=calibrated_so_far(interrupt.calibration, model))
    return Answer(as_in_its_file(_as_interrupted(answer, said, is_read=bool(balances)), model))


def _as_interrupted(
    answer: ExplanationResult, said: _Said, *, is_read: bool, is_searched: bool = False
) -> ExplanationResult:
    """Return an answer that says where an interrupt ended the work, and what was done."""
    return replace(answer, interrupted=said.last, stages=stages(answer, is_read=is_read, is_searched=is_searched))


def _nothing(quality: Sequence[str | DataQuality], confounding: Sequence[Confounded]) -> ExplanationResult:
    return ExplanationResult("insufficient_data", data_quality=tuple(quality), confounded=tuple(confounding))


def _distinguished_by_others(
    findings: Findings, others: Sequence[Sequence[Measurement]], said: _Said
) -> tuple[Isolation, ...]:
    """Remove from the ambiguity groups what other recordings of the unit exclude.

    Returns what each of them excluded.
    """
    found: list[Isolation] = []
    for other in others:
        if said.is_interrupted or not any(each.ambiguity_group for each in findings.accepted):
            break
        balances = [Balances(measured, findings.model) for measured in other]
        if nothing_to_judge(balances):
            continue
        judged = said.unless_interrupted(f"asking {other[0].origin}", search, findings.model, balances)
        if judged is None or judged.is_interrupted:
            said.interrupt()  # what a part of a search leaves open is nobody's ambiguity group
        elif not too_little_to_reject(judged, other) and judged.bristles is findings.bristles is Bristles.AS_STATED:
            found += narrow(findings, judged)
    return tuple(found)


def _transferred(
    answer: ExplanationResult, findings: Findings, others: Sequence[Sequence[Measurement]], said: _Said
) -> ExplanationResult:
    """Return the answer with the test of the causes on the other recordings."""
    tested = [Balances(measured, findings.model) for other in others for measured in other]
    judged = [b for b in tested if not nothing_to_judge([b])]
    found = said.unless_interrupted("trying the causes on the other recordings", transfer, findings, judged)
    quality = (*answer.data_quality, *data_quality(tested, findings.model))
    return replace(answer, data_quality=quality, transfer=found or ())


def _held_out(findings: Findings, said: _Said) -> Holdout | None:
    """Return the errors on held-out segments; without the last fit after an interrupt."""
    holdout = said.unless_interrupted("running the models freely", hold_out, findings, said)
    if holdout is not None and holdout.is_interrupted:
        said.interrupt()
    return holdout


def _put_together(findings: Findings, holdout: Holdout | None, said: _Said) -> ExplanationResult:
    """Return the answer so far. An interrupt ends what would follow, not the answer."""
    found = None
    if not said.is_interrupted:
        found = said.unless_interrupted("putting the answer together", explanation, findings, holdout)
    return explanation(findings, holdout) if found is None else found


def _best(findings: Findings, holdout: Holdout | None) -> Vector:
    """Return the whole parameter vector that the model file holds."""
    return findings.final.fit.whole if holdout is None else holdout.best


def _coarsely(
    recording: Recording,
    model: Model,
    fit_on: Sequence[float],
    said: _Said,
    why: list[str],
    confounding: Sequence[Confounded],
) -> Answer:
    """Return what free runs alone show; InputError for an unusable `fit_on`."""
    nothing = _nothing(why, confounding)
    if not is_slow(recording):
        if fit_on:
            what = "--fit-on is for data that are sampled too slowly to name causes by"
            remedy = "leave it out: of fast data every segment is judged by a fit to the others"
            raise InputError(Problem(what, value=recording.origin, remedy=remedy))
        return Answer(nothing)
    try:
        sweeps = sweeps_of(recording, model)
    except InputError as error:
        more = [str(problem) for problem in error.problems]
        return Answer(replace(nothing, data_quality=(*why, *(one for one in more if one not in why))))
    found = said.unless_interrupted("making free runs", explain_coarsely, recording, sweeps, model, fit_on, said, why)
    if found is None:
        said.interrupt()
        return Answer(_as_interrupted(nothing, said, is_read=True))
    ahead = NextTest(confounding[0].test, confounding[0].pair) if confounding else None
    return Answer(replace(found.explanation, next_test=ahead, confounded=tuple(confounding)), coarse=found)


def _obeying_its_laws(model: Model, recordings: Sequence[Recording]) -> Model:
    """Return the model with its temperature laws as terms, if temperature is known."""
    is_known = all("temperature" in r.roles and np.isfinite(r.series("temperature").values).any() for r in recordings)
    if not is_known or not laws(model.parameters):
        return model
    middle = float(np.nanmedian(recordings[0].series("temperature").values))
    obeying = model.with_laws_as_terms(middle)
    if found := impossible(obeying.parameters):
        remedy = "check the model file's laws over the temperature, and the temperature that was recorded"
        what = f"at {middle:.3g} degC the model file states no throttle"
        raise InputError(*(replace(one, what=f"{what}: {one.what}", remedy=remedy) for one in found.values()))
    return obeying


def _read(
    recordings: Sequence[Recording], model: Model
) -> tuple[list[Measurement], list[list[Measurement]], list[str]]:
    """Return segments of the first recording, of each other one, and what is missing."""
    segments: list[Measurement] = []
    others: list[list[Measurement]] = []
    missing: list[str] = []
    for number, recording in enumerate(recordings):
        try:
            found = measurements_of(recording, model)
            must_be_of_throttle(found, model)
            must_be_of_winding(found, model)
            must_do_its_work(found, model)
        except InputError as error:
            missing += [str(problem) for problem in error.problems]
            continue
        if number == 0:
            segments = found
        else:
            others.append(found)
    return segments, others, missing


class _Said:
    """The last progress message, and whether an interrupt ended the work there."""

    def __init__(self, progress: Callable[[str], None]) -> None:
        self._progress = progress
        self.last = "making the data ready"
        self.is_interrupted = False

    def __call__(self, what: str) -> None:
        """Report the next step."""
        self.last = what
        self._progress(what)

    def interrupt(self) -> None:
        """Note that an interrupt ended the work."""
        self.is_interrupted = True

    def unless_interrupted(self, what: str, work: Callable[P, T], *arguments: P.args, **named: P.kwargs) -> T | None:
        """Return the result of some work, None if an interrupt ended it."""
        try:
            self(what)
            return work(*arguments, **named)
        except KeyboardInterrupt:
            self.interrupt()
            return None


def write(answer: Answer, folder: Path) -> list[Path]:
    """Write `explanation.json` and, if a model was fitted, `model.yaml`; return paths.

    Files of an earlier answer that this one does not have are deleted: they are not of these data. InputError where
    files of these names belong to no answer, or one cannot be written.
    """
    make_folder(folder)
    must_not_lose(folder, ())
    for name in (MODEL_NAME, TEST_NAME):
        (folder / name).unlink(missing_ok=True)
    paths = [folder / ANSWER_NAME]
    write_text(paths[0], json.dumps(explanation_as_dict(answer.explanation), indent=1, ensure_ascii=False))
    if (model := answer.model) is not None:
        paths.append(folder / MODEL_NAME)
        in_balances = "base parameters as calibrated, effects as found"
        description = in_balances if answer.findings is not None else "base parameters as fitted in free run"
        model.write(paths[1], description)
    test = answer.explanation.next_test
    if test is not None and test.scenario:
        paths.append(folder / TEST_NAME)
        write_bytes(paths[-1], find("scenario", test.scenario).read_bytes())
    return paths
