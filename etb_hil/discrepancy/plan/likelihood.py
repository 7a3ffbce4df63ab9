"""Findings of a search, judged by the likelihood of the whole record.

Balances say by how much a cause lowers what a model leaves; hypotheses that lower it about as much are one group. The
filter's likelihood takes every sample with its own noise, and says what each hypothesis still needs a disturbance for
(decision 0038).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from etb_hil.discrepancy.candidates.candidate import MODEL_FILE_NAME, candidates_for
from etb_hil.discrepancy.candidates.refinement import Refined, unknowns_of
from etb_hil.discrepancy.fitting.calibration import residual_of
from etb_hil.discrepancy.fitting.fit import fit_of, gauss_newton
from etb_hil.discrepancy.fitting.noise_floor import group_means
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.sampling import open_bridge
from etb_hil.discrepancy.search import decision
from etb_hil.discrepancy.search.current_model import accept, continue_from
from etb_hil.discrepancy.search.findings import Findings, SelectionStep
from etb_hil.discrepancy.search.friction_drift import DRIFTS, WEARS
from etb_hil.discrepancy.search.rejection import reason_to_reject
from etb_hil.estimation.kalman import NOISE_VOLTAGE
from etb_hil.estimation.record import Record, joined, record
from etb_hil.hypotheses.candidates import is_in_filter
from etb_hil.hypotheses.comparison import Hypothesis, compared, misfit_of_model, misfit_with
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.parameters import Model
from etb_hil.results.explained.causes import Isolation

_OWN_NAME = {f"parameter:{stated}": f"parameter:{own}" for own, stated in MODEL_FILE_NAME.items()}
_NOTHING = 1.0  # a smaller misfit is immaterial: nothing is left to be explained
_ITERATIONS = 6
_NEAR = 2.0  # times what the balances' own winner leaves: a cause that they contradict is not put in its place
_IDLE = "the first cause explains the whole residual"


def weigh(findings: Findings) -> tuple[Isolation, ...]:
    """Judge findings by the likelihood of their record.

    Returns what that distinguishes. Removed from an ambiguity group is what the whole record makes unlikely. A likelier
    parameter takes the place of an effect that is the only cause. Later causes are dropped where the misfit with the
    first one is immaterial. With an immaterial misfit nothing is unexplained. Findings with a plug-in's effect, and
    those cut short, stay as they are.
    """
    measured = [b.measured for b in findings.balances]
    if not _is_open(findings):
        return ()
    made = joined([as_record(one, findings.model) for one in measured])
    if not findings.accepted:
        if misfit_of_model(made, findings.model) < _NOTHING:
            findings.verdict = "adequate"
        return ()
    if len(findings.accepted) > 1:
        _drop_idle(findings, made)
    misfit, found = np.inf, []
    for each in findings.accepted:
        if each.accepted:  # its joint parameter's may have been replaced with it
            step, winner, gone = _narrowed(findings, each, made)
            misfit = winner.misfit if winner is not None else np.inf
            if winner is not None and winner.explains_all_but_little:
                findings.curve = 0.0  # a spline over what numbers leave says nothing of the little that they leave
            found += [Isolation(step.winner.id, gone, measured[0].origin)] if gone else []
    findings.verdict = decision.verdict(findings)
    if misfit < _NOTHING and findings.verdict == "unexplained":
        findings.verdict = "ambiguous" if any(each.ambiguity_group for each in findings.accepted) else "explained"
    return tuple(found)


def as_record(measured: Measurement, model: Model) -> Record:
    """Return a measurement as the filter takes it.

    The force of a drive stands where a throttle has its voltage: a drive's winding has 1 ohm and no lag.
    """
    if measured.is_drive:
        time = np.arange(len(measured), dtype=np.float64) * measured.dt
        made = record(time, measured.voltage, model, motor=measured.angle)
        made.settings[NOISE_VOLTAGE] = measured.sensors.current_noise**2
        return made
    motor, plate = measured.motor_and_plate
    is_alone = measured.is_plates and measured.encoder is None
    # The voltage of an open bridge follows the back-EMF, and that of a bad sample may be any.
    unsure = np.where(open_bridge(measured) | ~measured.is_good, model.values.voltage_limit**2, 0.0)
    return record(
        np.arange(len(measured), dtype=np.float64) * measured.dt, measured.voltage, model, current=measured.current,
        motor=None if is_alone else motor, plate=measured.angle if is_alone else plate,
        temperature=measured.temperature, unsure=unsure,
    )  # fmt: skip


def _is_open(findings: Findings) -> bool:
    """Tell whether findings leave something open that a likelihood may decide."""
    if findings.is_interrupted or any(r.rejection in (DRIFTS, WEARS) for r in findings.selection_steps):
        return False
    involved = {one.id for one in findings.model.effects} | {each.winner.id for each in findings.accepted}
    if not all(is_in_filter(id_) for id_ in involved):
        return False
    is_doubted = findings.verdict == "unexplained" or len(findings.accepted) > 1
    return is_doubted or any(each.ambiguity_group for each in findings.accepted)


def _own_name(id_: str) -> str:
    return _OWN_NAME.get(id_, id_)


def _file_name(id_: str) -> str:
    return decision.parameter_id(id_.removeprefix("parameter:")) if id_.startswith("parameter:") else id_


def _narrowed(
    findings: Findings, step: SelectionStep, made: Record
) -> tuple[SelectionStep, Hypothesis | None, tuple[str, ...]]:
    """Remove from a group what its likeliest cause excludes.

    Returns that cause, its hypothesis, and what went. There is no hypothesis where nothing can be said of the cause.
    """
    judged = _judged(step, findings, made)
    winner = next((one for one in judged if one.ids == (_own_name(step.winner.id),)), None)
    if winner is None:
        return step, None, ()
    best, steps = judged[0], [step]
    if best is not winner and len(findings.accepted) == 1 and (best.is_of_numbers or best.excludes(winner)):
        replaced = _replaced(findings, step, best)
        if replaced:
            step, winner, steps = replaced[0], best, replaced
    if best.excludes(winner):
        return step, None, ()
    gone = _excluded(step, judged, winner)
    for one in steps:
        one.ambiguity_group = [id_ for id_ in one.ambiguity_group if id_ not in gone]
    return step, winner, gone


def _judged(step: SelectionStep, findings: Findings, made: Record) -> list[Hypothesis]:
    """Return the hypotheses for a cause and its group, the likeliest first."""
    ids = [_own_name(id_) for id_ in (step.winner.id, *step.ambiguity_group)]
    others = [one.winner.id for one in findings.accepted if one is not step and one.winner.id in CATALOGUE]
    return compared(made, findings.model, ids, findings.final.fit.whole[:EXTENDED], others)


def _excluded(step: SelectionStep, judged: Sequence[Hypothesis], winner: Hypothesis) -> tuple[str, ...]:
    """Return the ids of a group of which every hypothesis is excluded by the winner."""
    found = []
    for id_ in step.ambiguity_group:
        own = [one for one in judged if _own_name(id_) in one.ids]
        if own and all(winner.excludes(one) for one in own):
            found.append(id_)
    return tuple(found)


def _drop_idle(findings: Findings, made: Record) -> None:
    """Drop later causes where the misfit with the first one is immaterial."""
    first, *later = findings.accepted
    if misfit_with(made, findings.model, _own_name(first.winner.id), findings.final.fit.whole[:EXTENDED]) < _NOTHING:
        for one in later:
            one.accepted, one.rejection = False, _IDLE
        continue_from(findings, first.winner.fit.whole, first.winner.unknowns)


def _replaced(findings: Findings, old: SelectionStep, by: Hypothesis) -> list[SelectionStep]:
    """Accept another member of a group as the only cause; return its steps.

    There are none where the balances object.
    """
    residual, base = residual_of(findings.balances), old.before
    names = [_file_name(id_) for id_ in by.ids]
    freed = frozenset(id_.removeprefix("parameter:") for id_ in by.ids if by.is_of_numbers)
    known = candidates_for(findings.balances, base.unknowns).get(names[0], [])
    candidate = next((one for one in known if one.freed == freed), None)
    if candidate is None:
        return []
    whole = base.fit.whole.copy()
    whole[:EXTENDED] = by.fit.parameters[:EXTENDED]
    unknowns = unknowns_of(base.unknowns, candidate, whole, findings.balances[0].load)
    fit, _ = gauss_newton(residual, fit_of(residual, whole), unknowns, _ITERATIONS)
    if fit.cost > _NEAR * old.winner.fit.cost:
        return []
    winner = Refined(candidate, fit, unknowns)
    after = group_means(findings.balances, fit.whole)[0] / findings.final_noise_floor.level
    found = replace(
        old, refined=[winner, *old.refined], after_groups=after, best_finer_shapes=winner, accepted=False,
        ambiguity_group=[id_ for id_ in (old.winner.id, *old.ambiguity_group) if id_ not in names],
    )  # fmt: skip
    old.accepted = False
    if reason_to_reject(found, findings):
        old.accepted = True
        return []
    findings.selection_steps[findings.selection_steps.index(old)] = found
    accept(findings, found)
    return findings.accepted
