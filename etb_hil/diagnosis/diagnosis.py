"""The diagnosis of a unit, fed by the stream: the same object live and in replay."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.outcome import UnitVerdict
from etb_hil.diagnosis.assessment import JUDGED, assess
from etb_hil.diagnosis.contradiction import (
    Widening,
    against_each_other,
    gain_range,
    heated,
    law_remarks,
    pushed_at_turn,
    remarks,
    resistance_at_rest,
    resistance_fits,
    withholding,
)
from etb_hil.diagnosis.current_zero import Zero, ZeroMeter
from etb_hil.diagnosis.direction import against_motor
from etb_hil.diagnosis.drift import by_place_and_time, drift_remarks
from etb_hil.diagnosis.exceedance import ExceedanceDetector
from etb_hil.diagnosis.findings import Findings
from etb_hil.diagnosis.fitted_numbers import fitted_numbers
from etb_hil.diagnosis.grounds import Coverage, Grounds, local_excess, unexplained
from etb_hil.diagnosis.hard_break_away import unread
from etb_hil.diagnosis.hot_motor import hot_motor_remarks
from etb_hil.diagnosis.limits import Limits, without_temperature
from etb_hil.diagnosis.local_friction import local_friction
from etb_hil.diagnosis.local_margin import local_shortfall
from etb_hil.diagnosis.measurement_registry import kind_of, phases_needed
from etb_hil.diagnosis.measuring import Measured, failed_remarks, measure
from etb_hil.diagnosis.phase_use import RunPhase, Use
from etb_hil.diagnosis.places_seen import seen_slowly, too_wide_unseen
from etb_hil.diagnosis.result import DiagnosisResult
from etb_hil.diagnosis.segments import SegmentCollector
from etb_hil.diagnosis.series import break_away_columns, plot_columns
from etb_hil.diagnosis.speed_misfit import speed_misfit, speed_remarks
from etb_hil.diagnosis.tally import LiveReading, Tally
from etb_hil.diagnosis.ticks import TickMaker
from etb_hil.diagnosis.uneven_way import uneven_remarks, uneven_way
from etb_hil.diagnosis.verdict import conclude, stands
from etb_hil.diagnosis.windows import share_that_follows
from etb_hil.observer.estimate import Observer, SensorNoise
from etb_hil.observer.guarded import fault_of
from etb_hil.observer.registry import DEFAULT, observer_kind
from etb_hil.plant.parameters import Model, ThrottleParameters
from etb_hil.plant.values import FAR_ABOVE
from etb_hil.recording.samples import Float64, SampleBlock
from etb_hil.results.measurement import Measurement, Measurements

if TYPE_CHECKING:
    from etb_hil.base.errors import PartFault
    from etb_hil.observer.compensation import Compensation


@dataclass(frozen=True, slots=True)
class Snapshot:
    """What the panel shows while a run goes on.

    It has the live reading, the limits of T_st and T_c in N·m at the throttle shaft, and the number of exceedances so
    far. A limit that is not stated is None.
    """

    reading: LiveReading | None
    stiction_limit: float | None
    coulomb_limit: float | None
    exceedances: int


class Diagnosis:
    """The diagnosis of a run, from joined samples to a verdict.

    The diagnosis sees the bench's model and limits and nothing of the unit's.
    """

    def __init__(self, model: Model, limits: Limits, observer: str = DEFAULT) -> None:
        if not model.device.is_throttle:
            what = f"the model '{model.name}' is a drive's, and friction is judged of throttles"
            raise InputError(Problem(what, remedy="give a throttle's model file (schema etb_hil/model/1)"))
        self._model, self._limits, self._observer_kind = model, limits, observer_kind(observer)
        self._gear_ratio = model.values.gear_ratio
        self._meter: ZeroMeter | None = None
        self._zero = Zero(math.nan, math.nan, math.nan, None, math.nan)
        self._ticks = TickMaker()
        self._running: _Running | None = None
        self.fault: PartFault | None = None  # of the observer, where it is a plug-in's
        self._finished: list[ExceedanceDetector] = []
        self._samples = self._lost = 0
        self._last: tuple[int, RunPhase] | None = None
        self._phases: set[str] = set()
        self._roles: set[str] = set()
        self._segments = SegmentCollector(phases_needed())
        self._longest_gap, self._gap_in = 0, ""
        self._lowest, self._highest, self._highest_current = math.inf, -math.inf, 0.0
        self._start_ns: int | None = None

    def push(self, samples: SampleBlock, phase: RunPhase) -> None:
        """Take samples of a phase.

        Roles `motor_current` and `motor_angle` are needed, `motor_voltage`, `throttle_angle` and `temperature` are used
        where they are there. KeyError where a needed role is missing.
        """
        if not len(samples):
            return
        if self._start_ns is None:
            self._start_ns = int(samples.time_ns[0])
        self._cover(samples, phase)
        self._phases.add(phase.kind)
        unseen = {role: column for role, column in samples.columns.items() if role not in self._roles}
        self._roles |= {role for role, column in unseen.items() if np.isfinite(column).any()}
        missing = np.full(len(samples), np.nan)
        current, motor_angle = samples.columns["motor_current"], samples.columns["motor_angle"]
        temperature = samples.columns.get("temperature", missing)
        encoder = motor_angle / self._gear_ratio
        plate_less_encoder = samples.columns.get("throttle_angle", missing) - encoder
        if phase.use is Use.ZERO:
            if self._meter is None:
                self._meter = ZeroMeter()
            self._meter.push(samples.time_ns, current, plate_less_encoder, temperature)
            return
        running = self._start_or_go_on(plate_less_encoder)
        angle = encoder + (self._zero.angle or 0.0)
        true_current = current - self._zero.current if self._zero.is_measured else current
        voltage = samples.columns.get("motor_voltage", missing)
        if running.compensation is not None:
            true_current, angle, voltage = running.compensation.push(
                samples.time_ns, true_current, angle, voltage, temperature
            )
        estimate = running.observer.push(samples.time_ns, true_current, angle)
        self.fault = self.fault or fault_of(running.observer)
        self._segments.push(
            phase,
            np.asarray((samples.time_ns - self._start_ns) * 1e-9, np.float64),
            {**samples.columns, "angle": angle, "motor_current": true_current},
        )
        judged = JUDGED if phase.use is Use.FITTED else 0
        self._ticks.push(
            samples.time_ns,
            angle,
            true_current,
            voltage,
            temperature,
            estimate.velocity,
            estimate.friction,
            judged,
        )
        if phase.is_watched:
            running.tally.push(true_current, angle, estimate.velocity, estimate.friction, estimate.delay_ns)
            running.detector.push(
                samples.time_ns,
                true_current,
                angle,
                temperature,
                estimate.velocity,
                estimate.friction,
                estimate.delay_ns,
                estimate.deviation,
                phase.kind,
            )
            self._count(angle, true_current)

    @property
    def current_zero(self) -> float:
        """What the current sensor showed in A while the bridge was off.

        The zero is 0 where that was not measured.
        """
        return self._zero.current if self._zero.is_measured else 0.0

    def snapshot(self) -> Snapshot:
        """Return what is known so far; cheap enough for every refresh of a panel."""
        detectors = self._detectors()
        episodes = sum(len(d.episodes) + d.open_episodes for d in detectors)
        reading = None if self._running is None else self._running.tally.reading()
        return Snapshot(reading, *self._upper_limits(), episodes)

    def finish(self, *, complete: bool = True) -> DiagnosisResult:
        """Fit the whole run and return the verdict with everything behind it.

        A run that was cut short never passes.
        """
        throttle = self._throttle()
        detectors = self._detectors()
        for detector in detectors:
            detector.close()
        exceedances = tuple(episode for detector in detectors for episode in detector.episodes)
        ticks = self._ticks.ticks()
        assessment = assess(ticks, self._model, throttle, self._zero)
        reading = Tally(throttle).reading() if self._running is None else self._running.tally.reading()
        fit = assessment.fit
        local = None if fit is None else local_friction(assessment.evidence, fit)
        sliding = None if fit is None else local_friction(assessment.evidence, fit, slides=True)
        hot = heated(assessment.balance, self._model, throttle, self._zero.temperature)
        untold = [
            *against_motor(ticks, self._model, throttle),
            *withholding(assessment, sliding, self._model, throttle, hot),
        ]
        withheld = [*untold, *without_temperature(self._limits, self._zero.temperature)]
        way = None if fit is None or withheld else uneven_way(assessment.evidence, fit)
        drift = None if withheld else assessment.drift
        is_bent = drift is not None and drift.is_bent
        # friction by place, or by time, would pass for friction by speed
        misfit = speed_misfit(assessment) if way is None and not withheld and not is_bent else None
        widening = Widening()
        if fit is not None:
            widening = Widening(
                gain_range(fit, assessment.balance, self._model, throttle, hot),
                by_place_and_time(way, drift),
                is_confounded=is_bent or (way is not None and way.is_fine),
                is_bent=is_bent,
            )
        unseen = too_wide_unseen(local, self._model, throttle, (self._lowest, self._highest))
        at_rest = resistance_at_rest(ticks) if fit is None else None
        fitted = fitted_numbers(assessment, throttle, misfit)
        speed = fitted.get("omega_s") if way is None and not widening.is_confounded else None
        fastest = reading.fastest if fit is None else assessment.fastest
        far = FAR_ABOVE * (throttle.stribeck_velocity if speed is None else speed.value)
        series = plot_columns(assessment, widening) | break_away_columns(assessment.broken_away)
        found = Findings(
            self._model, throttle, self._zero, assessment, MappingProxyType(fitted), widening, way, drift, misfit,
            unseen, fastest, far, self._limits.dwell, reading, hot, MappingProxyType(series),
            self._segments.segments(),
        )  # fmt: skip
        measured = list(measure(found, self._limits))
        is_above = stands(measured, "T_st") is UnitVerdict.FAIL
        band = self._limits.marginal_band
        grounds = Grounds(
            coverage=Coverage(self._samples, self._lost, self._longest_gap * 1e-9, self._gap_in),
            moved=max(self._highest - self._lowest, 0.0),
            windows=assessment.ways,
            follows=share_that_follows(ticks),
            seen=seen_slowly(local),
            unseen=unseen,
            current_verified=self._zero.is_measured,
            highest_current=self._highest_current,
            withholding=withheld,
            remarks=(
                *(() if fit is None else remarks(fit, assessment.balance, self._model, throttle)),
                *hot_motor_remarks(hot),
                *(() if fit is None or misfit is not None else law_remarks(fit)),
                *speed_remarks(misfit),
                *(() if fit is None or is_above else unread(assessment.pairs, self._phases)),
                *uneven_remarks(way),
                *drift_remarks(drift),
                *failed_remarks(measured),
            ),
            by_direction=0.0 if fit is None else against_each_other(fit, self._model),
            pushed=None if untold else pushed_at_turn(local),
            excess=local_excess(assessment, local, self._most()[0], band, widening.gain),
            shortfall=local_shortfall(assessment, local, throttle, self._least_margin(), band, widening.gain),
            unexplained=unexplained(exceedances, assessment, self._ticks.origin_ns, band),
            current_plausible=None if at_rest is None else resistance_fits(at_rest, 0.0, self._model, throttle),
            band=band,
            complete=complete,
            limited={name: kind for name in self._limits.by_id if (kind := kind_of(name)) is not None},
            phases=frozenset(self._phases),
            roles=frozenset(self._roles),
            has_curve=fit is not None,
        )
        verdict, reasons = conclude(measured, grounds)
        measurements = Measurements(_told(one, is_withheld=bool(withheld), is_untold=bool(untold)) for one in measured)
        start_ns = self._start_ns or 0
        if self._ticks.origin_ns is not None:  # ticks begin with the first phase of motion, the run before it
            series["time"] = series["time"] + (self._ticks.origin_ns - start_ns) * 1e-9
        return DiagnosisResult(verdict, reasons, measurements, exceedances, start_ns, series)

    def _throttle(self) -> ThrottleParameters:
        temperature = self._zero.temperature
        return self._model.values if math.isnan(temperature) else self._model.values_at(temperature)

    def _upper_limits(self) -> tuple[float | None, float | None]:
        """Return the limits of T_st and T_c in N·m at the throttle shaft.

        They are those at the temperature of the current zero.
        """
        of, temperature = self._limits.most, self._zero.temperature
        return of("T_st", self._gear_ratio, temperature), of("T_c", self._gear_ratio, temperature)

    def _most(self) -> tuple[float, float]:
        """Return the most that T_st and T_c may be, infinite where no limit is stated."""
        stiction, coulomb = self._upper_limits()
        return math.inf if stiction is None else stiction, math.inf if coulomb is None else coulomb

    def _least_margin(self) -> float:
        """Return the least allowed return margin in N·m, -inf where none is stated."""
        least = self._limits.least("return_margin", self._gear_ratio, self._zero.temperature)
        return -math.inf if least is None else least

    def _start_or_go_on(self, plate_less_encoder: Float64) -> _Running:
        """Return the running estimation, started where there is none.

        A current zero that has just ended starts it afresh with what it measured.
        """
        if self._meter is not None:
            self._zero, self._meter = self._meter.zero(), None
            if self._running is not None:
                self._finished.append(self._running.detector)
                self._running = None
        if self._running is None:
            if self._zero.angle is None and np.isfinite(plate_less_encoder[0]):
                self._zero = replace(self._zero, angle=float(plate_less_encoder[0]))
            throttle = self._throttle()
            self._running = _Running(
                self._observer_kind.make(self._model, throttle, SensorNoise.of_bench(self._model)),
                Tally(throttle),
                ExceedanceDetector(self._model, throttle, *self._most()),
                self._compensation(),
            )
        return self._running

    def _compensation(self) -> Compensation | None:
        if not self._model.effects:
            return None
        from etb_hil.observer.compensation import Compensation  # noqa: PLC0415 (all effects, compiled)

        return Compensation(self._model, is_zeroed=self._zero.is_measured)

    def _detectors(self) -> list[ExceedanceDetector]:
        return self._finished if self._running is None else [*self._finished, self._running.detector]

    def _cover(self, samples: SampleBlock, phase: RunPhase) -> None:
        """Count lost samples and follow gaps, in phases of motion and at their edges.

        Phases in which something is measured belong to them.
        """
        before_ns, before = self._last if self._last is not None else (int(samples.time_ns[0]), phase)
        lost, gap = samples.lost_before, np.diff(samples.time_ns, prepend=before_ns)
        if _is_covered(before) and not _is_covered(phase):
            lost, gap = lost[:1], gap[:1]
        if _is_covered(before) or _is_covered(phase):
            self._lost += int(np.sum(lost[lost > 0]))
            if int(gap.max()) > self._longest_gap:
                self._longest_gap = int(gap.max())
                at_edge = int(np.argmax(gap)) == 0 and _is_covered(before)
                self._gap_in = before.kind if at_edge else phase.kind
        self._last = (int(samples.time_ns[-1]), phase)

    def _count(self, angle: Float64, current: Float64) -> None:
        self._samples += len(angle)
        known = angle[np.isfinite(angle)]
        if len(known):
            self._lowest = min(self._lowest, float(known.min()))
            self._highest = max(self._highest, float(known.max()))
        flowing = np.abs(current[np.isfinite(current)])
        if len(flowing):
            self._highest_current = max(self._highest_current, float(flowing.max()))


def _is_covered(phase: RunPhase) -> bool:
    return phase.is_watched or (phase.use is not Use.ZERO and phase.kind in phases_needed())


@dataclass(frozen=True, slots=True)
class _Running:
    observer: Observer
    tally: Tally
    detector: ExceedanceDetector
    compensation: Compensation | None


def _told(one: Measured, *, is_withheld: bool, is_untold: bool) -> Measurement:
    """Return a measurement as far as the data determine it.

    What rests on the model is held against no limit where a verdict is withheld, and nothing bounds it where the data
    contradict the model.
    """
    if one.kind.is_model_free:
        return one.measurement
    found = replace(one.measurement, verdict=None) if is_withheld else one.measurement
    return replace(found, low=None, high=None) if is_untold else found
