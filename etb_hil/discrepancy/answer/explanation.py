"""The typed answer from findings and held-out errors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from etb_hil.discrepancy.answer.detection_limits import detection_limits
from etb_hil.discrepancy.answer.holdout import Holdout
from etb_hil.discrepancy.answer.instability import unstable_range
from etb_hil.discrepancy.answer.quality import data_quality
from etb_hil.discrepancy.answer.sizes import sizes
from etb_hil.discrepancy.candidates.nonparametric import beyond_tolerances, in_their_own_balances
from etb_hil.discrepancy.fitting.balances import CHANNELS
from etb_hil.discrepancy.fitting.free_run import CURRENT_ROLE, POSITION, SEGMENT_S
from etb_hil.discrepancy.fitting.intervals import Estimate
from etb_hil.discrepancy.fitting.noise_floor import LEAST_SAMPLES
from etb_hil.discrepancy.fitting.unknowns import FIELDS, simulable
from etb_hil.discrepancy.measured.regimes import REGIMES
from etb_hil.discrepancy.plan.next_test import next_test
from etb_hil.discrepancy.search.bench_numbers import bench_numbers
from etb_hil.discrepancy.search.findings import Bristles, Compared, Findings, SelectionStep
from etb_hil.discrepancy.search.thresholds import excess
from etb_hil.hypotheses.terms import least_change
from etb_hil.plant.component import Component, component_of_parameter
from etb_hil.plant.drive_effects import unit_for
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import Vector
from etb_hil.plant.value_units import value_unit
from etb_hil.results.explained.causes import Candidate, Cause, ParameterEstimate
from etb_hil.results.explained.errors import Errors, ModelErrors, WorstSegment
from etb_hil.results.explained.models import LAST_FIT, CalibratedParameter, ModelFile, ModelledFriction, Nuisance
from etb_hil.results.explained.residual import BalanceResidual, DataQuality, Excess, Unexplained
from etb_hil.results.explanation import ExplanationResult

_OTHER_BRISTLES = {
    Bristles.ELASTO_PLASTIC: (
        "the record shows elasto-plastic bristles, and the model file has LuGre's: all numbers are of a model with "
        "friction_model: elasto-plastic; state it in the file"
    ),
    Bristles.OPEN: (
        "friction before the plate slides follows neither LuGre's law nor the elasto-plastic one, or a fault acts "
        "there: it was left open, and numbers are of elasto-plastic bristles, the nearest"
    ),
}
MOVED = 0.03  # share by which a base parameter that a term moves is flagged: it may have been stolen


def explanation(findings: Findings, holdout: Holdout | None) -> ExplanationResult:
    """Return the whole answer; `holdout` is None if no simulation could be run."""
    in_model = findings.final.fit.whole if holdout is None else holdout.best
    numbers = sizes(findings)
    found = ExplanationResult(
        verdict=findings.verdict,
        causes=causes(findings, in_model, numbers),
        measured=bench_numbers(findings.model),
        candidates=_candidates(findings),
        unexplained=_unexplained(findings),
        calibrated=_calibrated(findings, numbers, in_model),
        model_file=_model_file(holdout),
        nuisances=_nuisances(numbers),
        friction=_friction(findings, in_model),
        balances=_balances(findings),
        detection_limits=detection_limits(findings),
        next_test=next_test(findings),
        data_quality=_data_quality(findings),
    )
    if holdout is None:
        return found
    gain = replace(
        holdout.gains["calibrated"],
        of="free-run error of the throttle angle on held-out segments, calibrated without causes to model file",
        over_reference=holdout.gains["reference"],
    )
    return replace(found, errors=_errors(findings, holdout), gain=gain)


def _data_quality(findings: Findings) -> tuple[DataQuality, ...]:
    """Return the quality of each segment, and whether bristles are not the file's."""
    found = data_quality(findings.balances, findings.model)
    if findings.bristles is Bristles.AS_STATED:
        return found
    return tuple(replace(one, flags=(*one.flags, _OTHER_BRISTLES[findings.bristles])) for one in found)


def _errors(findings: Findings, holdout: Holdout) -> Errors:
    """Return errors with units, and remarks on a free run that errs unexpectedly."""
    units = {POSITION: "m" if findings.is_linear else "rad", CURRENT_ROLE: "A"}
    least, most = float(holdout.noise_floors.min()), float(holdout.noise_floors.max())
    left = holdout.table["free_run"][POSITION]["calibrated"]
    says = []
    if findings.verdict == "adequate" and not _besides(findings) and left > most:
        times, its = (1e3, "mm") if units[POSITION] == "m" else (math.degrees(1.0), "deg")
        says.append(
            f"the balances show no missing effect, but in free run the calibrated model errs by {times * left:.3g} "
            f"{its}, more than noise ({times * least:.3g} to {times * most:.3g} {its}); the reason is not known"
        )
    if away := unstable_range(simulable(holdout.best), findings.model.device):
        says.append(
            f"from {math.degrees(away[0]):.0f} to {math.degrees(away[1]):.0f} deg the closing "
            "torque falls as the plate opens: at a constant voltage it is unstable there, and errors of a free run grow"
        )
    return Errors(
        holdout={
            kind: {signal: ModelErrors(units[signal], **models) for signal, models in signals.items()}
            for kind, signals in holdout.table.items()
        },
        nrmse_free_run=holdout.nrmse,
        noise_floor_range=(least, most),
        free_run_worst=_worst(findings, holdout),
        text="; ".join(says),
    )


def _worst(findings: Findings, holdout: Holdout) -> WorstSegment:
    """Return the segment with the largest error of the model file's model."""
    errors = holdout.segments[holdout.in_file][POSITION]
    k = int(np.argmax(errors))
    longest = max(findings.balances, key=lambda b: b.samples).measured
    there = holdout.drawn[:, k]
    return WorstSegment(
        from_s=longest.start_s + k * SEGMENT_S,
        to_s=longest.start_s + (k + 1) * SEGMENT_S,
        error=float(errors[k]),
        share=float(errors[k] ** 2 / max(float(np.sum(errors**2)), 1e-30)),
        others=float(np.sqrt(np.sum(np.delete(errors, k) ** 2) / max(len(errors) - 1, 1))),
        noise_floor_range=(float(there.min()), float(there.max())),
    )


def _model_file(holdout: Holdout | None) -> ModelFile:
    """Return which of the two fits the model file holds."""
    if holdout is not None and holdout.is_refitted:
        says = (
            "the model file holds the values of the last fit in free run (in_model), whose error on held-out parts is "
            "smaller; values with intervals are those of the balances"
        )
        return ModelFile(LAST_FIT, says)
    return ModelFile("balances", "the model file holds the values that are given with intervals")


def causes(
    findings: Findings, in_model: Vector | None = None, numbers: Sequence[Estimate] | None = None
) -> tuple[Cause, ...]:
    """Return the accepted causes, most probable first.

    `in_model`: the whole vector that the model file holds, if it is not the balances' one. `numbers`: the sizes, if
    they are known by now.
    """
    whole = findings.final.fit.whole if in_model is None else in_model
    by_place = {e.place: e for e in (numbers or sizes(findings))}
    found = []
    for each, share in zip(findings.accepted, shares([each.gain for each in findings.accepted]), strict=True):
        winner = each.winner
        found.append(
            Cause(
                id=winner.id,
                probability=_probability(each, winner.id, is_cause=True),
                not_isolable_from=tuple(each.ambiguity_group),
                parameters=_parameters(each, by_place, whole, is_linear=findings.is_linear),
                finer_in_model=_finer(each, by_place, whole),
                share_of_error=share,
                held_out_t=each.t,
                component=_component([winner.id, *each.ambiguity_group]),
            )
        )
    return tuple(found)


def _component(ids: Sequence[str]) -> str:
    """Return the component that all of some causes sit in, empty where they differ."""
    found = {component for id_ in ids for component in _components(id_)}
    return found.pop().value if len(found) == 1 else ""


def _components(id_: str) -> frozenset[Component]:
    effect = CATALOGUE.get(id_)
    return effect.components if effect else frozenset({component_of_parameter(id_.removeprefix("parameter:"))})


def shares(gains: Sequence[float]) -> list[float]:
    """Return the share of the error that each cause explains, from its gain (n).

    A measured cause may leave more until the next is accepted: the share is that one's then.
    """
    least = np.minimum.accumulate(np.cumprod([1.0, *(1.0 - gain for gain in gains)]))
    return [float(share) for share in least[:-1] - least[1:]]


def _parameters(
    each: SelectionStep, numbers: dict[int, Estimate], whole: Vector, *, is_linear: bool
) -> Mapping[str, ParameterEstimate]:
    effect = each.winner.candidate.effect
    if effect is None:
        (name,) = each.winner.candidate.frees
        place = FIELDS.index(name)
        unit = value_unit(name, is_linear=is_linear)
        return {name: _size(numbers[place], unit, whole)}
    return {
        parameter.name: _size(numbers[place], unit_for(parameter, is_linear=is_linear), whole)
        for parameter, place in zip(effect.stated, effect.stated_indices, strict=True)
        if place in numbers
    }


def _size(estimate: Estimate, unit: str, whole: Vector) -> ParameterEstimate:
    return ParameterEstimate(
        float(estimate.value),
        unit,
        (float(estimate.low), float(estimate.high)),
        on_bound=bool(estimate.on_bound),
        flags=tuple(estimate.flags),
        in_model=float(whole[estimate.place]),
    )


def _finer(each: SelectionStep, numbers: dict[int, Estimate], whole: Vector) -> dict[str, float]:
    """Return the finer shapes (SI) that only the last fit has."""
    effect = each.winner.candidate.effect
    if effect is None:
        return {}
    stated = zip(effect.stated, effect.stated_indices, strict=True)
    return {one.name: float(whole[place]) for one, place in stated if place not in numbers and whole[place] != 0.0}


def _candidates(findings: Findings) -> tuple[Candidate, ...]:
    """Return every step's hypotheses with the evidence for and against them."""
    return tuple(
        _candidate(number, each, id_, one)
        for number, each in enumerate(findings.selection_steps, 1)
        for one in each.compared
        for id_ in one.ids
    )


def _candidate(number: int, step: SelectionStep, id_: str, one: Compared) -> Candidate:
    effect, is_winner = CATALOGUE.get(id_), one is step.compared[0]
    return Candidate(
        selection_step=number,
        id=id_,
        accepted=step.accepted and is_winner,
        rejection=step.rejection if is_winner else "",
        probability=_probability(step, id_, is_cause=is_winner),
        evidence=one.evidence,
        residual_share=one.misfit**2,
        looks_like=effect.looks_like if effect else "a base parameter outside its tolerance",
        check=effect.check if effect else "check the parameter and its tolerance in the model file",
    )


def _probability(step: SelectionStep, id_: str, *, is_cause: bool) -> float | None:
    """Return 1 for a cause, 0 for what it excludes, None in an ambiguity group."""
    if step.ambiguity_group and (is_cause or id_ in step.ambiguity_group):
        return None
    return float(step.accepted and is_cause)


def _unexplained(findings: Findings) -> Unexplained:
    over = excess(findings.final_groups, findings.samples)
    if findings.verdict == "adequate" and _besides(findings):
        over[:] = 0.0  # the balances have neither a drift nor such bristles
    where = [
        Excess(CHANNELS[k // 3], REGIMES[k % 3], float(np.sqrt(findings.final_groups[k])))
        for k in np.argsort(-over)
        if over[k] > 0.0
    ]
    final = findings.final
    own = in_their_own_balances(findings.balances, final.jacobian, final.fit, final.unknowns)
    wrong = beyond_tolerances(
        final.jacobian, final.fit, final.unknowns, is_electrical=all(b.has[1] for b in findings.balances)
    )
    terms = sorted([*own, wrong], key=lambda one: -one.explained_share)
    return Unexplained(tuple(where), tuple(terms[:3]), text=_besides(findings))


def _besides(findings: Findings) -> str:
    """Return what was found and has no name: open bristles, and a drift."""
    said = [_OTHER_BRISTLES[Bristles.OPEN]] if findings.bristles is Bristles.OPEN else []
    if (drift := findings.drift) is not None:
        as_use = " and stays inside its tolerance, as use or warmth may make it do" if drift.is_use else ""
        least = f"{100.0 * least_change(drift.best.fit):.2g} % at least"
        said.append(f"friction changes along the record by {least}{as_use}: values are those of its mean")
    return "; ".join(said)


def _calibrated(findings: Findings, numbers: Sequence[Estimate], in_model: Vector) -> Mapping[str, CalibratedParameter]:
    found = {}
    for estimate in numbers:
        name = estimate.name
        if estimate.place >= EXTENDED or name not in FIELDS:
            continue
        first = float(findings.calibration.fit.whole[estimate.place])
        nominal = float(getattr(findings.model.values, name))
        half = findings.model.tolerance(name)
        moved = abs(estimate.value - first) / max(abs(first), half)
        flags = ["outside its tolerance"] if abs(estimate.value - nominal) > half * 1.03 else []
        flags += estimate.flags
        if findings.accepted and moved > MOVED:
            flags.append("changes when the causes come in")
        unit = value_unit(name, is_linear=findings.is_linear)
        found[name] = _number(findings, estimate, in_model, (nominal, half), unit, flags)
    return {**found, **_stated(findings, numbers, in_model)}


def _stated(findings: Findings, numbers: Sequence[Estimate], in_model: Vector) -> Mapping[str, CalibratedParameter]:
    """Return the fitted numbers of effects that the model file states.

    It states no tolerance of them.
    """
    by_place, whole = {one.place: one for one in numbers}, findings.model.vector()
    named = [step.winner.candidate.effect for step in findings.accepted]
    found = {}
    for effect in CATALOGUE.values():
        if effect in named or not whole[list(effect.acting_indices)].any():
            continue
        for parameter, place in zip(effect.stated, effect.stated_indices, strict=True):
            if place not in by_place:
                continue
            estimate, nominal = by_place[place], float(whole[place])
            flags = [] if estimate.low <= nominal <= estimate.high else ["not what the model file states"]
            unit = unit_for(parameter, is_linear=findings.is_linear)
            found[f"{effect.id}.{parameter.name}"] = _number(
                findings, estimate, in_model, (nominal, 0.0), unit, [*flags, *estimate.flags]
            )
    return found


def _number(
    findings: Findings, estimate: Estimate, in_model: Vector, stated: tuple[float, float], unit: str, flags: list[str]
) -> CalibratedParameter:
    """Return a fitted number beside what is `stated` of it: value and tolerance."""
    return CalibratedParameter(
        unit=unit,
        nominal=stated[0],
        value=estimate.value,
        interval=(estimate.low, estimate.high),
        in_model=float(in_model[estimate.place]),
        tolerance=stated[1],
        flags=tuple(flags),
        without_causes=float(findings.calibration.fit.whole[estimate.place]) if findings.accepted else None,
    )


def _nuisances(numbers: Sequence[Estimate]) -> Mapping[str, Nuisance]:
    """Return fitted nuisances: time offsets, and the plate sensor's zero."""
    return {
        e.name: Nuisance(
            e.value,
            "rad" if e.name.endswith("_zero") else "s",
            (e.low, e.high),
            on_bound=bool(e.on_bound),
            flags=tuple(e.flags),
        )
        for e in numbers
        if e.place >= EXTENDED and e.low < e.high
    }


def _friction(findings: Findings, in_model: Vector) -> Mapping[str, ModelledFriction]:
    """Return break-away and sliding friction of each model at the throttle shaft."""
    first, last = simulable(findings.calibration.fit.whole), simulable(in_model)
    return {
        name: ModelledFriction(
            unit="N" if findings.is_linear else "N·m",
            reference=float(getattr(findings.model.values, name)),
            calibrated=float(first[FIELDS.index(name)]),
            extended=float(last[FIELDS.index(name)]),
        )
        for name in ("stiction", "coulomb")
    }


def _balances(findings: Findings) -> Mapping[str, Mapping[str, BalanceResidual]]:
    """Return each balance's residual over the noise floor by regime, before and after."""
    first = findings.first_groups
    found: dict[str, dict[str, BalanceResidual]] = {}
    for k in range(9):
        if findings.samples[k] < LEAST_SAMPLES:
            continue
        found.setdefault(CHANNELS[k // 3], {})[REGIMES[k % 3]] = BalanceResidual(
            calibrated_over_noise_floor=float(np.sqrt(first[k])),
            extended_over_noise_floor=float(np.sqrt(findings.final_groups[k])),
            samples=int(findings.samples[k]),
        )
    return found
