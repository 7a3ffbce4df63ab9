"""Fit unknowns, disturbances and noise to a record, from far off.

The disturbances start large: with small ones from the start a wrong model locks the filter out. No slope leads to some
of the best fits: they have other starts, which few of the samples try first.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from etb_hil.estimation.climbing import (
    AT_ONCE,
    NEARER,
    NOISE_DEVIATION,
    SETTLED,
    Fitted,
    begun,
    breaking_away,
    climbed,
    least_disturbances,
)
from etb_hil.estimation.filtering import Disturbance, filtered
from etb_hil.estimation.record import Record
from etb_hil.estimation.unknown import Unknown, as_stated
from etb_hil.estimation.variances import VARIANCES
from etb_hil.plant.physics import COULOMB, STOP_HIGH, STOP_LOW
from etb_hil.recording.samples import Float64

# Disturbances at the start of a fit: torque as a share of T_c, and voltage as a share of that which overcomes T_c at
# rest (Kristensen, Madsen and Jorgensen 2004). With ten times as much nothing is visible.
_FIRST = (0.1, 0.5)
# The share of them with which a fit begins again that ended with a large torque: they hid what the motion tells. With a
# share of 0.03 to 0.3 of the torque two records with coarse encoders ended at one place, with all of it one did not.
# `tests/hypotheses/test_coarse_encoders.py` checks it.
_BEGUN_AGAIN = 0.1
# Multiple of the first torque up to which a smaller one is tried on all samples: few of them may miss it. With 1 a
# cause beside a coarse encoder ended 150 nats too early (`python benchmarks/explain_study.py strong FIRST COUNT --view
# coarse_encoder`).
_LARGE = 3.0
_LED = 3  # steps after which a fit that few samples led there is the likelier one, or is given up
# Multiple of the least disturbances below which smaller ones change nothing: a tenth of what sensors can show.
_UNSEEN = 100.0
# Places of each stop that are tried over its tolerance: before it is met, no slope leads there.
_STOPS_TRIED = 6


def settled(record: Record, fit: Fitted, aim: float = -np.inf) -> Fitted:
    """Return a fit to its end; `aim` as in `climbed`.

    Disturbances that are too large hide what an unknown does, and no slope leads to smaller ones. So smaller ones are
    tried, as long as the posterior grows: how large they are in the end tells what is missing.
    """
    fit = climbed(record, fit, aim=aim)
    if max(fit.disturbance.noise[:-1]) > math.exp(NOISE_DEVIATION) or _is_large(fit):
        fit = _likelier_elsewhere(record, fit, aim)
    while not _is_large(fit, _LARGE) and (lower := _lower(fit)) != fit.disturbance:
        found = climbed(record, begun(record, fit.parameters, fit.unknowns, lower), aim=aim)
        if not _gains(found, fit, aim):
            break
        fit = found
    return fit


def _likelier_elsewhere(record: Record, fit: Fitted, aim: float) -> Fitted:
    """Return a likelier fit than one with much noise or a large torque.

    These stand for what is missing. The fit begins again with a large disturbance in place of the noise, with smaller
    disturbances, or as stated with small ones: that fit is the better one where it needs no large torque.
    """
    end = _led_by_few(record, fit)
    if max(end.fit.disturbance.noise[:-1]) > math.exp(NOISE_DEVIATION):
        end = end.likelier_from(end.fit.parameters, first_disturbance(end.fit.parameters), aim)
    while _is_large(end.fit, _LARGE):
        found = end.likelier_from(end.fit.parameters, _lower(end.fit), aim)
        if not _gains(found.fit, end.fit, aim):
            break
        end = found
    if _is_large(end.fit):
        first = first_disturbance(end.fit.parameters)
        small = replace(first, torque=_BEGUN_AGAIN * first.torque, voltage=_BEGUN_AGAIN * first.voltage)
        stated = as_stated(end.fit.parameters, end.fit.unknowns)
        end = end.likelier_from(stated, small, aim, most_torque=first.torque)
    return end.fit


def _is_large(fit: Fitted, times: float = 1.0) -> bool:
    """Tell whether a fit needs a torque so many times larger than the first one."""
    return fit.disturbance.torque > times * first_disturbance(fit.parameters).torque


def _gains(found: Fitted, fit: Fitted, aim: float) -> bool:
    """Tell whether a fit is likelier by enough; `aim` as in `climbed`."""
    return found.posterior >= fit.posterior + max(SETTLED, NEARER * (aim - fit.posterior))


@dataclass(frozen=True, slots=True)
class OnFew:
    """A fit, and as few of the samples have it.

    They tell first whether another start leads to a likelier one. `fit`: of the whole `record`; `here`: that of `few`
    of its samples, near it.
    """

    record: Record
    fit: Fitted
    few: Record
    here: Fitted

    @classmethod
    def near(cls, record: Record, fit: Fitted) -> OnFew:
        """Return a fit with that of few of the samples near it."""
        few = record.few
        return cls(record, fit, few, climbed(few, begun(few, fit.parameters, fit.unknowns, fit.disturbance)))

    def likelier_from(
        self,
        parameters: Float64,
        disturbance: Disturbance,
        aim: float,
        most_torque: float = np.inf,
        held: Unknown | None = None,
    ) -> OnFew:
        """Return the fit, or a likelier one from another start.

        `aim`: as in `climbed`. `most_torque`: what the other fit needs at most, in N·m. `held`: an unknown that is held
        at first, where all others would take it back.
        """
        unknowns, reached = self.fit.unknowns, self.here.posterior
        if held is not None:
            others = [one for one in unknowns if one is not held]
            first = climbed(self.few, begun(self.few, parameters, others, disturbance), aim=reached)
            parameters, disturbance = first.parameters, first.disturbance
        there = climbed(self.few, begun(self.few, parameters, unknowns, disturbance), aim=reached)
        if there.posterior < reached + SETTLED or there.disturbance.torque > most_torque:
            return self
        start = begun(self.record, there.parameters, unknowns, there.disturbance)
        found = climbed(self.record, start, aim=max(aim, self.fit.posterior))
        if found.posterior <= self.fit.posterior or found.disturbance.torque > most_torque:
            return self
        return OnFew(self.record, found, self.few, there)


def _led_by_few(record: Record, fit: Fitted) -> OnFew:
    """Return a fit with that of few of the samples near it.

    Where they gain more by it than by chance, they may lead all samples to where those are likelier, too.
    """
    end = OnFew.near(record, fit)
    few, here = end.few, end.here
    # A quarter of the samples gains 3/8 nats a parameter by chance: the expectation of half a chi-square.
    begin = begun(few, fit.parameters, fit.unknowns, fit.disturbance)
    if here.posterior > begin.posterior + len(fit.unknowns) + VARIANCES:
        led = climbed(record, begun(record, here.parameters, fit.unknowns, here.disturbance), _LED)
        if led.posterior > fit.posterior:
            return replace(end, fit=climbed(record, led))
    return end


def _lower(fit: Fitted) -> Disturbance:
    """Return disturbances a step lower, where sensors could show that."""
    step = math.sqrt(AT_ONCE)
    torque, voltage = (
        max(one / step, least) if one > _UNSEEN * least else one
        for one, least in zip((fit.disturbance.torque, fit.disturbance.voltage), least_disturbances(fit), strict=True)
    )
    return replace(fit.disturbance, torque=torque, voltage=voltage)


def calibrated(record: Record, parameters: Float64, unknowns: Sequence[Unknown]) -> Fitted:
    """Return the fit of base parameters, from as far off as their tolerances allow.

    Few of the samples lead the way, where all of them are likelier there.
    """
    first = first_disturbance(parameters)
    p = _at_stops(record, parameters, unknowns, first)
    placed = record.placed(p)
    few = placed.few
    led = climbed(few, begun(few, p, unknowns, first))
    begins = [begun(placed, p, unknowns, first), begun(placed, led.parameters, unknowns, led.disturbance)]
    return settled(placed, max(begins, key=lambda one: one.posterior))


def first_disturbance(parameters: Float64) -> Disturbance:
    """Return disturbances and noise at the start of a fit."""
    return Disturbance(_FIRST[0] * float(parameters[COULOMB]), _FIRST[1] * breaking_away(parameters))


def _at_stops(record: Record, parameters: Float64, unknowns: Sequence[Unknown], first: Disturbance) -> Float64:
    """Return parameters with the likeliest stops of some within tolerances."""
    p = parameters
    for one in unknowns:
        if one.place in (STOP_LOW, STOP_HIGH):
            tried = [
                _replaced(p, one.place, one.mean + share * one.reach) for share in np.linspace(-1, 1, _STOPS_TRIED)
            ]
            p = max(tried, key=lambda q: filtered(record, q, first).log_likelihood)
    return p


def _replaced(parameters: Float64, place: int, value: float) -> Float64:
    """Return parameters with another value at one place."""
    found = parameters.copy()
    found[place] = value
    return found
