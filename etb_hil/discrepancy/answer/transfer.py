"""Transfer of causes: whether another recording shows them, too."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from etb_hil.discrepancy.answer.angle_zero import SIZES, is_absolute, shifted_fit, shifts_for
from etb_hil.discrepancy.fitting import free_run
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import Calibration, calibrate
from etb_hil.discrepancy.fitting.noise_floor import noise_floor_of, weigh
from etb_hil.discrepancy.search.findings import Findings, SelectionStep
from etb_hil.plant.effects.effect import Effect
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import Vector
from etb_hil.results.explained.causes import ErrorWithAndWithout, Transfer

CARRIES = 0.02  # of the squared residual: what a cause must take of another recording to be carried over


@dataclass(slots=True)
class _Other:
    """Another recording with the causes that it shows so far.

    `balances` are of its angle (rad, or m) with the `shift` added; `placed`: its causes that depend on the angle.
    """

    balances: Balances
    model: Calibration
    shift: float
    placed: list[Effect] = field(default_factory=list)


def transfer(findings: Findings, others: Sequence[Balances]) -> tuple[Transfer, ...]:
    """Return for each cause and other recording the share of residual it explains.

    Base parameters are calibrated anew for the other recording, with and without the cause. In `free_run` they are not:
    all parameters are those of the search before the cause was found, and with it.

    An incremental encoder has another zero in each recording. A cause that depends on the angle is tried with the
    angle shifted, too. One shift holds for all causes of a recording. Effects that the model file states are taken
    where the first recording has them.
    """
    found: dict[int, list[Transfer]] = {}
    shifts: dict[str, float] = {}
    causes = [(each, effect) for each in findings.accepted if (effect := each.winner.candidate.effect) is not None]
    # Of one recording's segments, that with the longest way shows its zero best.
    for k in sorted(range(len(others)), key=lambda k: -float(np.ptp(others[k].measured.angle))):
        origin = others[k].measured.origin
        other = _calibrated(findings, others[k], shifts.get(origin, 0.0))
        gains = [_explained(findings, effect, other) for _, effect in causes]
        found[k] = [_said(findings, *cause, gain, other) for cause, gain in zip(causes, gains, strict=True)]
        shifts[origin] = other.shift
    return tuple(one for k in sorted(found) for one in found[k])


def _calibrated(findings: Findings, balances: Balances, shift: float) -> _Other:
    """Weigh another recording by its noise floor; calibrate it without causes."""
    segments = [balances.shifted(shift) if shift else balances]
    plain = calibrate(findings.model, segments)
    weigh(segments, noise_floor_of(findings.model, segments, plain.fit.whole, plain.unknowns).level)
    return _Other(segments[0], calibrate(findings.model, segments, plain.fit.whole), shift)


def _explained(findings: Findings, effect: Effect, other: _Other) -> float:
    """Return the share of residual that a cause explains.

    A cause that is carried over is added to the model of the other recording.
    """
    shift, with_it = _fitted(findings, effect, other)
    gain = 1.0 - with_it.fit.cost / other.model.fit.cost
    if gain > CARRIES:
        other.model = with_it
        if effect.depends_on_angle:
            other.placed.append(effect)
        if shift:
            other.balances, other.shift = other.balances.shifted(shift), other.shift + shift
    return gain


def _fitted(findings: Findings, effect: Effect, other: _Other) -> tuple[float, Calibration]:
    """Return the shift of the angle that a cause needs, and the calibration with it.

    The shift (rad, or m) is added to the known one. It must explain as much more as a cause has to.
    """
    model, before, balances = findings.model, other.model, other.balances
    begin = before.fit.whole.copy()
    for place in effect.stated_indices:
        begin[place] = findings.final.fit.whole[place]
    plain = calibrate(model, [balances], begin, before.unknowns)
    if not _may_be_shifted(findings, effect):
        return 0.0, plain
    first = np.concatenate([one.measured.angle for one in findings.balances])
    shifts = shifts_for([*other.placed, effect], begin, first, balances)
    shifted = shifted_fit(model, balances, before, begin, shifts)
    if shifted is None or plain.fit.cost - shifted[1].fit.cost <= CARRIES * before.fit.cost:
        return 0.0, plain
    return shifted


def _may_be_shifted(findings: Findings, effect: Effect) -> bool:
    return effect.depends_on_angle and not is_absolute(findings.model)


def _free_run(other: Balances, whole: Vector) -> float:
    """Return the rms error (rad, or m) of one free run over a whole recording."""
    angle = other.measured.angle
    return free_run.rms(free_run.trace(other, whole[:EXTENDED], 0, len(angle)) - angle)


def _said(findings: Findings, each: SelectionStep, effect: Effect, gain: float, other: _Other) -> Transfer:
    """Return the result of a cause, with the shift after all causes."""
    carried, may_be_shifted = bool(gain > CARRIES), _may_be_shifted(findings, effect)
    without, with_it = (_free_run(other.balances, whole) for whole in (each.before.fit.whole, each.winner.fit.whole))
    measured = other.balances.measured
    errors = ErrorWithAndWithout(without, with_it, "m" if measured.device.is_linear else "rad")
    shift = other.shift if may_be_shifted and carried and other.shift else None
    text = _carried(gain, errors, shift) if carried else _not_carried(may_be_shifted=may_be_shifted)
    return Transfer(effect.id, measured.origin, gain, carried, errors, text, shift)


def _not_carried(*, may_be_shifted: bool) -> str:
    least, most = SIZES
    sized = f", or at no zero of the angle has {least:g} to {most:g} times its size there," if may_be_shifted else ""
    return f"it explains less than {100.0 * CARRIES:g} % of the residual there{sized} and is not carried over"


def _carried(gain: float, errors: ErrorWithAndWithout, shift: float | None) -> str:
    times, shown = (1e3, "mm") if errors.unit == "m" else (math.degrees(1.0), "deg")
    zero = "" if shift is None else f"with {times * shift:.1f} {shown} added to the angle there, "
    explained = f"it explains {100.0 * gain:.0f} % of the residual there, with base parameters fitted to that recording"
    without, with_it = times * errors.without_cause, times * errors.with_cause
    freely = "with the first recording's parameters, the error of one free run is"
    return f"{zero}{explained}; {freely} {with_it:.3g} {shown} with it and {without:.3g} {shown} without it"
