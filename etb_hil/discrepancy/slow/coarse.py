"""Analysis of slow data: the model fitted to some runs, judged on the others.

No cause can be named without balances. What is wrong, where and by how much, can be said.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.roles import ROLES
from etb_hil.discrepancy.fitting.free_run import gain_of, rms
from etb_hil.discrepancy.fitting.unknowns import base_unknowns, start
from etb_hil.discrepancy.measured.measurement import plate_rms
from etb_hil.discrepancy.search.extended_model import calibrated_model
from etb_hil.discrepancy.slow.drive_samples import DriveSamples, drive_samples, is_held
from etb_hil.discrepancy.slow.sweep_fit import SweepFit, fit_sweeps
from etb_hil.discrepancy.slow.sweeps import Sweep, breaks_away, slow_remark
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.integrator import TICK
from etb_hil.plant.parameters import Model
from etb_hil.plant.value_units import value_unit
from etb_hil.recording.recording import Recording
from etb_hil.recording.samples import Float64
from etb_hil.results.explained.errors import Errors, ModelErrors, Starts
from etb_hil.results.explained.models import CalibratedParameter, Nuisance
from etb_hil.results.explained.residual import BreakAwayVoltages, DataQuality, FreeRun, Unexplained
from etb_hil.results.explanation import ExplanationResult

# Decision 0029. A published throttle by these: benchmarks/explain_tbcp.py.
_BLOCKS = 40
_Z = 2.02  # Student's 97.5 % of 40 blocks
_AT_NOISE_FLOOR = 2.0  # times the sensor's noise: a smaller error shows no missing effect
_FEWEST_RUNS = 5  # in which a trend is looked for
_SEEN = 1e-4  # of the squared residual: what a whole tolerance must change for the data to say anything of a number


@dataclass(frozen=True, slots=True)
class Coarse:
    """Runs with the angles (rad) of reference and fitted model, and which were fitted."""

    sweeps: list[Sweep]
    nominal: list[Float64]
    fitted: list[Float64]
    is_seen: list[bool]
    model: Model
    explanation: ExplanationResult


def explain_coarsely(
    recording: Recording,
    sweeps: list[Sweep],
    model: Model,
    fit_on: Sequence[float],
    progress: Callable[[str], None],
    why: Sequence[str],
) -> Coarse:
    """Fit a model to some runs by the voltage alone and judge it on the others.

    `fit_on`: the conditions of the runs to fit; without it two runs, a third of the way from either end. `why`: why no
    balances could be judged. InputError where the recording has no such runs.
    """
    is_seen = _chosen(sweeps, fit_on)
    unknowns = base_unknowns(model)
    found = fit_sweeps([s for s, seen in zip(sweeps, is_seen, strict=True) if seen], start(model), unknowns, progress)
    progress("running the models freely")
    stated, fitted = start(model)[:EXTENDED], found.whole[:EXTENDED]
    nominal = [s.simulated(stated) for s in sweeps]
    after = [s.simulated(fitted, late=found.late) for s in sweeps]
    answer = _answer_of(recording, drive_samples(recording, model), model, sweeps, is_seen, found, nominal, after, why)
    return Coarse(sweeps, nominal, after, is_seen, calibrated_model(model, found.whole), answer)


def _chosen(sweeps: Sequence[Sweep], fit_on: Sequence[float]) -> list[bool]:
    if not fit_on:
        places = {len(sweeps) // 3, 2 * len(sweeps) // 3}
        return [k in places for k in range(len(sweeps))]
    there = [s.condition for s in sweeps]
    unknown = [value for value in fit_on if value not in there]
    if unknown or len(set(fit_on)) == len(set(there)):
        allowed = ", ".join(f"{value:g}" for value in there if np.isfinite(value)) or "none: no condition was set"
        what = "--fit-on must name conditions of the data" if unknown else "--fit-on must leave a run to judge by"
        raise InputError(Problem(what, value=", ".join(f"{value:g}" for value in fit_on), allowed=allowed))
    return [s.condition in fit_on for s in sweeps]


def _answer_of(
    recording: Recording,
    samples: DriveSamples,
    model: Model,
    sweeps: Sequence[Sweep],
    is_seen: Sequence[bool],
    found: SweepFit,
    nominal: Sequence[Float64],
    after: Sequence[Float64],
    why: Sequence[str],
) -> ExplanationResult:
    """Return the answer of a fit to some runs; `why`: why no balances were judged.

    `nominal` and `after` are the runs' angles (rad) of the reference and the fitted model, `is_seen` marks the fitted
    runs.
    """
    noise = plate_rms(model.sensors)
    judged = [k for k, seen in enumerate(is_seen) if not seen]
    angles = [s.angle for s in sweeps]
    before_rms = np.array([rms(nominal[k] - angles[k]) for k in judged])
    after_rms = np.array([rms(after[k] - angles[k]) for k in judged])
    errors = {"reference": rms(before_rms), "calibrated": rms(after_rms), "noise_floor": noise}
    span = float(np.ptp(np.concatenate(angles)))
    gain = gain_of(before_rms, after_rms)
    runs = tuple(_run_of(*one) for one in zip(sweeps, after, is_seen, strict=True))
    is_adequate = errors["calibrated"] < _AT_NOISE_FLOOR * noise
    missed = [] if is_adequate else _may_miss_commands(recording.origin, samples, model)
    verdict = "adequate" if is_adequate else "insufficient_data" if missed else "unexplained"
    return ExplanationResult(
        verdict=verdict,
        judged_by="free runs only: " + "; ".join(why),
        unexplained=Unexplained(
            runs=_worst(runs) if verdict == "unexplained" else (), text="" if missed else _trend(runs)
        ),
        calibrated={} if missed else _calibrated(model, found),  # else it compensates for unrecorded commands
        nuisances={"voltage_time_offset": Nuisance(found.late * TICK, "s")},
        runs=runs,
        errors=Errors(
            holdout={"free_run": {"throttle_angle": ModelErrors("rad", **errors)}},
            nrmse_free_run={name: value / span for name, value in errors.items()},
        ),
        gain=replace(
            gain,
            of="free-run error of the throttle angle on runs that the fit did not use, reference to calibrated model",
        ),
        starts=Starts(tuple(found.ends), _starts(found.ends)),
        data_quality=(*missed, _quality(recording, samples, sweeps, found)),
    )


def _may_miss_commands(origin: str, samples: DriveSamples, model: Model) -> list[str]:
    """Say that commands between samples may explain the residual; empty if held."""
    if is_held(samples, model.sensors):
        return []
    its, rate = ("duty" if samples.is_duty else "voltage"), 1e9 / float(np.median(np.diff(samples.time_ns)))
    what = f"the residual exceeds the noise, and at {rate:.0f} Hz the {its} may change between samples"
    why = "the data cannot distinguish a fault from such a command"
    remedy = "hold each step for several samples, or record every command of the controller"
    return [f"{origin}: {what}; {why}: {remedy}"]


def _run_of(sweep: Sweep, simulated: Float64, seen: bool) -> FreeRun:
    off = simulated - sweep.angle
    there = float(np.sum((sweep.angle - sweep.angle.mean()) ** 2))
    measured, modelled = breaks_away(sweep, sweep.angle), breaks_away(sweep, simulated)
    return FreeRun(
        condition=sweep.role,
        value=sweep.condition if sweep.role else None,
        unit=ROLES[sweep.role].unit if sweep.role else "",
        start_s=sweep.start_s,
        used_in_fit=seen,
        r_squared=1.0 - float(off @ off) / max(there, 1e-30),
        rms_rad=rms(off),
        break_away_voltage=BreakAwayVoltages(measured, modelled),
    )


def _worst(runs: Sequence[FreeRun]) -> tuple[FreeRun, ...]:
    return tuple(sorted((run for run in runs if not run.used_in_fit), key=lambda run: run.r_squared)[:3])


def _trend(runs: Sequence[FreeRun]) -> str:
    """Say towards which end of a condition the error grows, if it does."""
    if not runs[0].condition or len(runs) < _FEWEST_RUNS:
        return ""
    rising = sorted(runs, key=lambda run: run.value or 0.0)
    errors = np.array([run.rms_rad for run in rising])
    worst = set(np.argsort(errors)[-2:].tolist())
    if worst not in ({0, 1}, {len(runs) - 1, len(runs) - 2}):
        return ""
    end = rising[0] if 0 in worst else rising[-1]
    half = [run.r_squared for run in (rising[len(runs) // 2 :] if 0 in worst else rising[: len(runs) // 2])]
    name = end.condition.replace("_", " ")
    text = (
        f"the error grows towards a {name} of {end.value:g} {end.unit}: R² {end.r_squared:.2f} there, "
        f"{min(half):.2f} to {max(half):.2f} in the other half"
    )
    at = end.break_away_voltage
    if at.measured_v is not None and at.model_v is not None:
        text += f"; there the plate breaks away at {at.measured_v:.2f} V, the model at {at.model_v:.2f} V"
    return text


def _calibrated(model: Model, found: SweepFit) -> Mapping[str, CalibratedParameter]:
    spread = _spread(found)
    shown = np.sum(found.jacobian**2, axis=0) > _SEEN * np.sum(found.residual**2)
    result = {}
    for k, unknown in enumerate(found.unknowns):
        value = float(found.whole[unknown.place])
        low, high = (unknown.centre + unknown.scale * end for end in (unknown.low, unknown.high))
        on_bound = unknown.is_on_edge(found.whole)
        reach = _Z * float(spread[k]) * unknown.scale if shown[k] and not on_bound else high - low
        flags = []
        if not shown[k]:
            flags.append("these data do not determine it")
        elif on_bound:
            flags.append("on a bound: these data do not determine it, or the model lacks an effect")
        result[unknown.name] = CalibratedParameter(
            unit=value_unit(unknown.name, is_linear=model.device.is_linear),
            nominal=float(getattr(model.values, unknown.name)),
            value=value,
            interval=(max(value - reach, low), min(value + reach, high)),
            tolerance=unknown.scale,
            flags=tuple(flags),
        )
    return result


def _spread(found: SweepFit) -> Float64:
    """Return each unknown's scaled standard deviation, from blocks of the fitted runs."""
    block = np.arange(len(found.residual)) * _BLOCKS // len(found.residual)
    scores = np.stack([found.jacobian[block == k].T @ found.residual[block == k] for k in range(_BLOCKS)])
    scores -= scores.mean(0)
    normal = found.jacobian.T @ found.jacobian
    half = scores @ np.linalg.pinv(normal + 1e-9 * np.eye(len(normal)), rcond=1e-12, hermitian=True)
    return np.asarray(np.sqrt((half**2).sum(0) * _BLOCKS / (_BLOCKS - 1.0)))


def _starts(ends: Sequence[float]) -> str:
    best, worst = min(ends), max(ends)
    if worst < 1.05 * best:
        return f"all {len(ends)} starts ended at the same error within 5 %"
    low, high = math.degrees(best), math.degrees(worst)
    return f"{len(ends)} starts ended at {low:.3g} to {high:.3g} deg: the best was taken, there may be better ones"


def _quality(recording: Recording, samples: DriveSamples, sweeps: Sequence[Sweep], found: SweepFit) -> DataQuality:
    rate = 1.0 / float(np.median(np.diff(sweeps[0].seconds)))
    flags = [slow_remark(recording), *samples.angles.flags]
    flags += ["no balances: no cause can be named; fitted parameters may compensate a missing effect"]
    roles = recording.roles
    if "motor_current" not in roles:
        flags.append("motor_current is missing: the scale of torques and of inertia is the model file's motor constant")
    if "motor_duty" in roles and "motor_voltage" not in roles:
        flags.append(
            "motor_voltage is duty times supply"
            + ("" if "supply_voltage" in roles else " of the model file: the supply was not measured")
        )
    if "temperature" not in roles:
        flags.append("no temperature: effects of temperature cannot be distinguished from changes over time")
    if found.late:
        flags.append(
            f"the voltage acts {1e3 * found.late * TICK:.1f} ms after its sample, or the angle was taken earlier"
        )
    seconds = sweeps[-1].start_s + float(sweeps[-1].seconds[-1])
    return DataQuality(recording.origin, rate, seconds, (*flags, *recording.notes))
