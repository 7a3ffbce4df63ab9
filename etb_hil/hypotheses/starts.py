"""Where fits begin: on the slope of the linear pass, or where none leads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np

from etb_hil.estimation import forces
from etb_hil.estimation.calibration import OnFew, first_disturbance, settled
from etb_hil.estimation.climbing import Fitted
from etb_hil.estimation.filtering import Disturbance, filtered
from etb_hil.estimation.prior import over
from etb_hil.estimation.record import Record
from etb_hil.estimation.unknown import Unknown, as_stated
from etb_hil.hypotheses.constants import GAIN, GIVES_WAY, HALVINGS, LEAST_STEP, PARAMETER
from etb_hil.hypotheses.linear import Start
from etb_hil.hypotheses.misfit import misfit
from etb_hil.plant.effects.effect import Effect
from etb_hil.plant.physics import STOP_HIGH, STOP_LOW
from etb_hil.recording.samples import Float64

# A first-order lag is as late as a delay of its size where motions are slow. So what is late by less than half of the
# likeliest delay or lag, or by half more, is not tried; `tests/hypotheses/test_strong_delays.py` has all channels.
_AROUND = 0.5
_ACROSS = 0.02  # samples beyond a jump of the likelihood, so that no rounding puts a start back before it


def from_elsewhere(record: Record, before: Fitted, start: Start, effects: Mapping[str, Effect]) -> Start:
    """Return a start of a fit, or a likelier one to which no slope leads."""
    if effect := effects.get(start.ids[0]):
        return _strength_elsewhere(record, before, start, effect)
    p = _likeliest(record, start.parameters, _stops_elsewhere(record, start))
    if p is start.parameters:
        return start
    gain = _gain(record, before, p, _likelier_disturbance(record, before, p))
    return Start(start.ids, p, p, max(start.evidence, gain))


def _gain(record: Record, before: Fitted, parameters: Float64, disturbance: Disturbance) -> float:
    """Return by how much parameters are likelier than a fit, in nats."""
    return filtered(record, parameters, disturbance).log_likelihood - before.filtered.log_likelihood


def beginning(record: Record, before: Fitted, start: Start, least: float) -> tuple[Float64, Disturbance]:
    """Return where a fit begins, and under which disturbances.

    A linear step may go too far: after it the model is at least as likely as the one before (`least`, in nats). A start
    from elsewhere begins as a first fit does. By the disturbances of a fit that lacks the cause, it may be the less
    likely model.
    """
    share, p = 1.0, start.parameters
    if p is start.origin:
        return p, first_disturbance(p)
    while share > LEAST_STEP and filtered(record, p, before.disturbance).log_likelihood < least:
        share *= 0.5
        p = start.origin + share * (start.parameters - start.origin)
    return p, _likelier_disturbance(record, before, p)


def _strength_elsewhere(record: Record, before: Fitted, start: Start, effect: Effect) -> Start:
    """Return a start at strengths to which no slope leads, where it is likelier.

    It is likelier under the disturbances of a first fit, or else of the fit before. Combinations of strengths are tried
    where one alone is likelier, those that are about as late. The base model is as fitted or as stated.
    """
    places = [effect.indices[k] for k in effect.strengths]
    alone, together = list[Float64](), list[Float64]()
    for values in product(*((0.0, *effect.parameters[k].elsewhere) for k in effect.strengths)):
        if any(values):
            p = start.origin.copy()
            p[places] = values
            (alone if np.count_nonzero(values) == 1 else together).append(p)
    if not alone:
        return start
    some = record.few
    p = _likeliest(some, alone[0], alone[1:])
    p = first = _likeliest(some, p, [as_stated(p, before.unknowns)])
    if _first_likelihood(some, first) > _first_likelihood(some, start.parameters):
        late = forces.lateness(p).sum(axis=1)
        near = [q for q in together if np.all(abs(forces.lateness(q).sum(axis=1) - late) <= _AROUND * late)]
        p = _nearer(some, _likeliest(some, p, near), effect)
        gain = _gain(record, before, p, _likelier_disturbance(record, before, p))
        start = Start(start.ids, p, p, max(start.evidence, gain))
        if gain > 0.0:
            return start
    gain = _gain(record, before, first, before.disturbance)
    return Start(start.ids, start.origin, first, max(start.evidence, gain)) if gain > 0.0 else start


def likelier(record: Record, fit: Fitted, ids: tuple[str, ...], aim: float) -> Fitted:
    """Return a fit, or a likelier one from starts to which no slope leads.

    Few of the samples try them first.
    """
    own = [(one, one.effect) for one in fit.unknowns if one.effect is not None and one.effect.id in ids]
    if not own:
        return fit
    best = OnFew.near(record, fit)
    for one, effect in own:
        stated = effect.stated[effect.stated_indices.index(one.place)]
        for value in () if stated.is_strength else stated.elsewhere:
            p = best.fit.parameters.copy()
            p[one.place] = value
            if filtered(record, p, best.fit.disturbance).log_likelihood == best.fit.filtered.log_likelihood:
                continue  # the record does not go there
            best = best.likelier_from(p, best.fit.disturbance, aim)
        reached = -np.inf
        while best.fit.posterior > reached + GAIN and not misfit(best.fit).is_nothing:
            reached = best.fit.posterior
            others = _across_samples(record, best.fit.parameters, one)
            others += _across_a_ridge(best.fit, one) if stated.is_strength else []
            for p in others:
                best = best.likelier_from(p, best.fit.disturbance, aim, held=one)
    return fit if best.fit is fit else settled(record, best.fit, aim)


def _across_samples(record: Record, parameters: Float64, unknown: Unknown) -> list[Float64]:
    """Return parameters that make a reading late by a sample less, and by one more.

    There are none where the unknown makes no reading late.

    The filter takes a late reading at the sample after it was true. So the likelihood jumps where it is late by whole
    samples, and no slope leads across.
    """
    moved = parameters.copy()
    moved[unknown.place] += 1.0
    late, dt = forces.lateness(parameters)[:, 0], float(np.median(record.dt))
    found = []
    for samples in {round(value / dt, 6) for value in late[forces.lateness(moved)[:, 0] != late]}:
        for across in (np.ceil(samples) - 1.0 - _ACROSS, np.floor(samples) + 1.0 + _ACROSS):
            p = parameters.copy()
            p[unknown.place] += (across - samples) * dt
            if unknown.low <= p[unknown.place] <= unknown.high:
                found.append(p)
    return found


def _across_a_ridge(fit: Fitted, unknown: Unknown) -> list[Float64]:
    """Return parameters with half and with twice a strength.

    There are none where base parameters are within their tolerances. Beyond them, they may stand for another strength:
    the fit ends on a ridge.
    """
    if not over(fit.parameters, fit.unknowns).any():
        return []
    found = []
    for times in (0.5, 2.0):
        value = float(np.clip(times * fit.parameters[unknown.place], unknown.low, unknown.high))
        if value != fit.parameters[unknown.place]:
            found.append(fit.parameters.copy())
            found[-1][unknown.place] = value
    return found


def _stops_elsewhere(record: Record, start: Start) -> list[Float64]:
    """Return starts with a stop where the motion ends.

    How far the plate went into it is unknown.
    """
    angle = record.readings[:, 1 if np.isfinite(record.readings[:, 1]).any() else 2]
    ends = {
        "stop_low": (STOP_LOW, float(np.nanmin(angle)), 1.0),
        "stop_high": (STOP_HIGH, float(np.nanmax(angle)), -1.0),
    }
    found = []
    for place, end, inside in (ends[name] for name in ends if PARAMETER + name in start.ids):
        for way in GIVES_WAY:
            found.append(start.origin.copy())
            found[-1][place] = end + inside * way
    return found


def _likeliest(record: Record, start: Float64, others: Sequence[Float64]) -> Float64:
    """Return the likeliest of a start and others; the start itself without any."""
    return max([start, *others], key=lambda one: _first_likelihood(record, one)) if others else start


def _nearer(record: Record, start: Float64, effect: Effect) -> Float64:
    """Return a likelier start between those that were tried.

    It is found by a compass search (Kolda, Lewis and Torczon 2003). So near to the truth, what remains is small, and
    small disturbances are the likelier ones.
    """
    best, most = start, _first_likelihood(record, start)
    for halving in range(1, HALVINGS + 1):
        for k in effect.strengths:
            one, place = effect.parameters[k], effect.indices[k]
            step = 0.5**halving * float(np.diff((0.0, *one.elsewhere)).min(initial=0.0))
            for by in (step, -step):
                p = best.copy()
                p[place] = np.clip(p[place] + by, one.low, one.high)
                if (found := _first_likelihood(record, p)) > most:
                    best, most = p, found
                    break
    return best


def _first_likelihood(record: Record, parameters: Float64) -> float:
    """Return the log-likelihood under the disturbances that a first fit begins with.

    Those of a fit that lacks the cause are larger, and hide how much starts differ.
    """
    return filtered(record, parameters, first_disturbance(parameters)).log_likelihood


def _likelier_disturbance(record: Record, before: Fitted, parameters: Float64) -> Disturbance:
    """Return the disturbances of the model before, or those of any fit's start.

    Where something else stood for the cause, the former have little to do with it.
    """
    each = before.disturbance, first_disturbance(parameters)
    return max(each, key=lambda one: filtered(record, parameters, one).log_likelihood)
