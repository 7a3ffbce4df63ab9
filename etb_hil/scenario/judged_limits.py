"""Limits whose measurements can be taken: their kinds of phase exist."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.nearest import did_you_mean
from etb_hil.base.plugins import parts
from etb_hil.diagnosis.limits import Limits
from etb_hil.diagnosis.limits_file import load_limits
from etb_hil.diagnosis.measurement_kind import MeasurementKind
from etb_hil.diagnosis.measurement_registry import kind_of
from etb_hil.scenario.phases import phase_kinds


def load_judged_limits(path: Path, gear_ratio: float | None = None) -> Limits:
    """Read a limits file, and check that each of its measurements can be taken.

    InputError names a kind of phase that a measurement is taken from and that does not exist. A measurement without a
    limit may name one: its phases may come with a plug-in that this run does without.
    """
    limits = load_limits(path, gear_ratio)
    judged = {kind.id: kind for kind in map(kind_of, limits.by_id) if kind is not None}
    if problems := [problem for kind in judged.values() for problem in missing_phases(kind, Place(path))]:
        raise InputError(*problems)
    return limits


def missing_phases(kind: MeasurementKind, place: Place | None = None) -> Iterator[Problem]:
    """Yield a problem for each kind of phase of a measurement that does not exist.

    The problem names the plug-in that declares the measurement, or `place` where none does.
    """
    declared = next((part.place for part in parts("measurements") if part.value.id == kind.id), place)
    for phase in sorted(set(kind.phases) - phase_kinds().keys()):
        remedy = did_you_mean(phase, phase_kinds(), "correct it, or load the plug-in that brings this kind")
        yield Problem(f"`phases` of the measurement {kind.id} names no kind of phase", declared, phase, remedy=remedy)
