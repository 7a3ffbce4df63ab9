"""From recordings and a model to the answer, and to the files that hold it."""

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
from etb_hil.discrepancy.answer.called import as_in_its_file
from etb_hil.discrepancy.answer.consequence import Judge, consequence
from etb_hil.discrepancy.answer.explanation import explanation
from etb_hil.discrepancy.answer.folder import ANSWER_NAME, MODEL_NAME, TEST_NAME, must_not_lose
from etb_hil.discrepancy.answer.holdout import Holdout, hold_out
from etb_hil.discrepancy.answer.quality import data_quality
from etb_hil.discrepancy.answer.too_little import nothing_to_judge, too_little_to_accuse
from etb_hil.discrepancy.answer.transfer import transfer
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.confounding import confounded
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.plausible import must_be_of_throttle
from etb_hil.discrepancy.measured.stretches import DRIVES, drive_roles, is_measured_on_drive, measurements_of
from etb_hil.discrepancy.measured.winding import must_be_of_winding
from etb_hil.discrepancy.plan.beside import narrow
from etb_hil.discrepancy.plan.nexttest import next_test
from etb_hil.discrepancy.plan.planned import Plan
from etb_hil.discrepancy.search.cut_short import CutShort, calibrated_so_far, stages
from etb_hil.discrepancy.search.extending import extended_model
from etb_hil.discrepancy.search.findings import Findings
from etb_hil.discrepancy.search.naming import search
from etb_hil.discrepancy.slow.coarse import Coarse, explain_coarsely
from etb_hil.discrepancy.slow.sweeps import is_slow, sweeps_of
from etb_hil.plant.drive_file import is_drive
from etb_hil.plant.effects.laws import laws
from etb_hil.plant.model_check import impossible
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector
from etb_hil.recording.recording import Recording
from etb_hil.results.explanation import Confounded, DataQuality, ExplanationResult, NextTest, ToldApart
from etb_hil.results.explanation_file import explanation_as_dict

P = ParamSpec("P")
T = TypeVar("T")


@dataclass(slots=True)
class Answer:
    """The result, and what it was made of: a search's findings, or of slow data their free runs."""

    explanation: ExplanationResult
    findings: Findings | None = None
    holdout: Holdout | None = None
    coarse: Coarse | None = None

    @property
    def model(self) -> Model | None:
        """The model with what was found, None where nothing was fitted."""
        if self.findings is not None:
            return extended_model(self.findings, _best(self.findings, self.holdout))
        is_judged = self.coarse is not None and self.explanation.verdict != "insufficient_data"
        return self.coarse.model if self.coarse is not None and is_judged else None


def explain(
    recordings: Sequence[Recording],
    model: Model,
    without: Sequence[str] = (),
    progress: Callable[[str], None] = lambda _: None,
    limits: Limits | None = None,
    judge: Judge | None = None,
    plans: Callable[[], Sequence[Plan]] | None = None,
    fit_on: Sequence[float] = (),
    *,
    is_same_unit: bool = False,
) -> Answer:
    """Explain the first of some recordings of one kind of unit by a model, and try the causes on the others.

    `without`: effects that are not looked for; with `limits` it says what the causes change in the diagnosis, as the
    bench would `judge` the first recording under a model, where it made it.
    `is_same_unit`: all recordings are of one unit, so that what one of them distinguishes is distinguished in the
    answer.
    `plans` makes the scenarios of which the next test is one, where one is wanted. An interrupt ends it with what is
    known by then, and the answer says so. Data that are too slow to name causes by are fitted in free run where a
    condition has the values `fit_on`, and judged elsewhere; InputError where none has, and where a recording of a
    throttle meets a drive's model or the other way round.
    """
    _must_be_of_one_kind(recordings, model)
    model = _obeying_its_laws(model, recordings)
    said = _Said(progress)
    together: list[Confounded] = []
    balances: list[Balances] = []
    try:
        together = [one for recording in recordings for one in confounded(recording)]
        stretches, others, missing = _read(recordings, model)
        if not stretches or fit_on:
            return _coarsely(recordings[0], model, fit_on, said, missing, together)
        balances = [Balances(measured, model) for measured in stretches]
        findings, why = _searched(stretches, balances, model, without, said)
        if findings is None:
            return _insufficient(why, balances, model, together, said)
    except KeyboardInterrupt as interrupt:
        return _before_the_search(said, model, balances, together, interrupt)
    told_apart = _told_apart(findings, others if is_same_unit else (), without, said)
    holdout = None if said.is_cut_short else _held_out(findings, said)
    answer = _put_together(findings, holdout, said)
    if plans and answer.next_test and not said.is_cut_short:
        test = said.unless_cut_short("choosing the next test", lambda: next_test(findings, plans(), said))
        answer = replace(answer, next_test=test or answer.next_test)
    if limits is not None and not said.is_cut_short:
        judged = said.unless_cut_short(
            "judging the unit", consequence, findings, limits, _best(findings, holdout), judge
        )
        answer = replace(answer, diagnosis=judged)
    if others and not said.is_cut_short:
        answer = _transferred(answer, findings, others, said)
    answer = replace(answer, told_apart_by_others=told_apart, confounded=tuple(together), left_out=tuple(missing))
    if said.is_cut_short:
        done = stages(answer, is_read=True, is_searched=not findings.is_cut_short)
        answer = replace(answer, interrupted=said.last, stages=done)
    return Answer(as_in_its_file(answer, model), findings, holdout)


def _searched(
    stretches: Sequence[Measurement], balances: list[Balances], model: Model, without: Sequence[str], said: _Said
) -> tuple[Findings | None, list[str]]:
    """Return what a search finds, or why these data tell nothing."""
    if why := nothing_to_judge(balances):
        return None, why
    findings = search(model, balances, without, said)
    if findings.is_cut_short:
        said.cut_short()
    why = too_little_to_accuse(findings, stretches)
    return (None, why) if why else (findings, [])


def _insufficient(
    why: list[str], balances: Sequence[Balances], model: Model, together: Sequence[Confounded], said: _Said
) -> Answer:
    """Return the answer to data that tell nothing, with the reasons, also where an interrupt came before the end."""
    answer = _nothing((*why, *data_quality(balances, model)), together)
    if said.is_cut_short:
        done = stages(answer, is_read=True, is_searched=False)
        answer = replace(answer, interrupted=said.last, stages=done)
    return Answer(as_in_its_file(answer, model))


def _before_the_search(
    said: _Said,
    model: Model,
    balances: Sequence[Balances],
    together: Sequence[Confounded],
    interrupt: KeyboardInterrupt,
) -> Answer:
    """Return what is known where an interrupt came before anything was looked for."""
    answer = _nothing(data_quality(balances, model), together)
    if isinstance(interrupt, CutShort):
        answer = replace(answer, calibrated=calibrated_so_far(interrupt.calibration, model))
    done = stages(answer, is_read=bool(balances), is_searched=False)
    return Answer(as_in_its_file(replace(answer, interrupted=said.last, stages=done), model))


def _nothing(quality: Sequence[str | DataQuality], together: Sequence[Confounded]) -> ExplanationResult:
    return ExplanationResult("insufficient_data", data_quality=tuple(quality), confounded=tuple(together))


def _told_apart(
    findings: Findings, others: Sequence[Sequence[Measurement]], without: Sequence[str], said: _Said
) -> tuple[ToldApart, ...]:
    """Return what other recordings of the unit distinguish, and take that out of the classes."""
    found: list[ToldApart] = []
    for other in others:
        if said.is_cut_short or not any(each.alike for each in findings.accepted):
            break
        balances = [Balances(measured, findings.model) for measured in other]
        if nothing_to_judge(balances):
            continue
        judged = said.unless_cut_short(f"asking {other[0].origin}", search, findings.model, balances, without)
        if judged is None or judged.is_cut_short:
            said.cut_short()  # what a part of a search leaves open is nobody's class
        elif not too_little_to_accuse(judged, other):
            found += narrow(findings, judged)
    return tuple(found)


def _transferred(
    answer: ExplanationResult, findings: Findings, others: Sequence[Sequence[Measurement]], said: _Said
) -> ExplanationResult:
    """Return the answer with what the other recordings say of the causes, and what all of the data are worth."""
    tested = [Balances(measured, findings.model) for other in others for measured in other]
    judged = [b for b in tested if not nothing_to_judge([b])]
    found = said.unless_cut_short("trying the causes on the other recordings", transfer, findings, judged)
    quality = (*answer.data_quality, *data_quality(tested, findings.model))
    return replace(answer, data_quality=quality, transfer=found or ())


def _held_out(findings: Findings, said: _Said) -> Holdout | None:
    """Return the errors on held-out segments; without the last fit where an interrupt ended that."""
    holdout = said.unless_cut_short("running the models freely", hold_out, findings, said)
    if holdout is not None and holdout.is_cut_short:
        said.cut_short()
    return holdout


def _put_together(findings: Findings, holdout: Holdout | None, said: _Said) -> ExplanationResult:
    """Return the answer so far. It takes a moment: an interrupt then ends what would follow, and not the answer."""
    found = None
    if not said.is_cut_short:
        found = said.unless_cut_short("putting the answer together", explanation, findings, holdout)
    return explanation(findings, holdout) if found is None else found


def _best(findings: Findings, holdout: Holdout | None) -> Vector:
    """Return the whole vector that the model file holds."""
    return findings.final.fit.whole if holdout is None else holdout.best


def _must_be_of_one_kind(recordings: Sequence[Recording], model: Model) -> None:
    """Refuse a throttle's recording for a drive's model, and a drive's for a throttle's."""
    problems = []
    for recording in recordings:
        of_drive = is_measured_on_drive(recording)
        if is_drive(model) and not drive_roles(recording, is_linear=model.is_linear):
            motion, roles = DRIVES[0 if model.is_linear else 1]
            what = f"{recording.origin} is not measured on a {motion} drive, but the model '{model.name}' is one's"
            remedy = "give the model file of what was measured: a drive's (schema etb_hil/drive/1, with its 'motion'), "
            remedy += "a throttle's (schema etb_hil/model/1), or a stock one such as --model default"
            problems.append(Problem(what, allowed=f"data with the roles {' and '.join(roles[:2])}", remedy=remedy))
        if of_drive and not is_drive(model):
            what = f"{recording.origin} is measured on a drive, but the model '{model.name}' is a throttle's"
            problems.append(Problem(what, remedy="give a drive's model file (schema etb_hil/drive/1)"))
    if problems:
        raise InputError(*problems)


def _coarsely(
    recording: Recording,
    model: Model,
    fit_on: Sequence[float],
    said: _Said,
    why: list[str],
    together: Sequence[Confounded],
) -> Answer:
    """Return what free runs alone tell; InputError with a `fit_on` that is wrong or asks it of fast data."""
    nothing = _nothing(why, together)
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
    found = said.unless_cut_short("making free runs", explain_coarsely, recording, sweeps, model, fit_on, said, why)
    if found is None:
        said.cut_short()
        done = stages(nothing, is_read=True, is_searched=False)
        return Answer(replace(nothing, interrupted=said.last, stages=done))
    ahead = NextTest(together[0].test, together[0].pair) if together else None
    return Answer(replace(found.explanation, next_test=ahead, confounded=tuple(together)), coarse=found)


def _obeying_its_laws(model: Model, recordings: Sequence[Recording]) -> Model:
    """Return a model that obeys its laws over the temperature, where that was recorded."""
    is_known = all("temperature" in r.roles and np.isfinite(r.series("temperature").values).any() for r in recordings)
    if not is_known or not laws(model.parameters):
        return model
    middle = float(np.nanmedian(recordings[0].series("temperature").values))
    obeying = model.with_laws_as_terms(middle)
    if found := impossible(obeying.parameters):
        remedy = "look at the model file's laws over the temperature, and at the temperature that was recorded"
        what = f"at {middle:.3g} degC the model file states no throttle"
        raise InputError(*(replace(one, what=f"{what}: {one.what}", remedy=remedy) for one in found.values()))
    return obeying


def _read(
    recordings: Sequence[Recording], model: Model
) -> tuple[list[Measurement], list[list[Measurement]], list[str]]:
    """Return the segments of the first recording, those of each other, and what is missing in any of them."""
    stretches: list[Measurement] = []
    others: list[list[Measurement]] = []
    missing: list[str] = []
    for number, recording in enumerate(recordings):
        try:
            found = measurements_of(recording, model)
            must_be_of_throttle(found, model)
            must_be_of_winding(found, model)
        except InputError as error:
            missing += [str(problem) for problem in error.problems]
            continue
        if number == 0:
            stretches = found
        else:
            others.append(found)
    return stretches, others, missing


class _Said:
    """What was last said of the progress, and whether an interrupt ended the work there."""

    def __init__(self, progress: Callable[[str], None]) -> None:
        self._progress = progress
        self.last = "making the data ready"
        self.is_cut_short = False

    def __call__(self, what: str) -> None:
        """Say what comes next."""
        self.last = what
        self._progress(what)

    def cut_short(self) -> None:
        """Note that an interrupt ended the work."""
        self.is_cut_short = True

    def unless_cut_short(self, what: str, work: Callable[P, T], *arguments: P.args, **named: P.kwargs) -> T | None:
        """Return what some work gives, None where an interrupt ended it."""
        try:
            self(what)
            return work(*arguments, **named)
        except KeyboardInterrupt:
            self.cut_short()
            return None


def write(answer: Answer, folder: Path) -> list[Path]:
    """Write `explanation.json` and, where something was fitted, `model.yaml`; return the paths.

    What an earlier answer left in the folder and this one does not have goes: it is not of these data. InputError
    where files of these names are nobody's answer, or one cannot be written.
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
