"""Models in the result of `explain`: parameters, friction, diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from etb_hil.results.explained.causes import Interval

LAST_FIT = "last fit in free run"  # of `ModelFile.values_from`


@dataclass(frozen=True, slots=True)
class CalibratedParameter:
    """A base parameter as fitted, or a number of an effect that the model states.

    `without_causes` is its value in the calibrated model, where `value` has causes. `in_model` is the value in the
    model file that is written.
    """

    unit: str
    """Unit of all values."""
    nominal: float
    """Value in the reference model."""
    value: float
    """Value in the model with all causes."""
    interval: Interval | None
    """95 % interval of `value`; null where it is unknown."""
    tolerance: float
    """Tolerance in the model file; 0 of an effect's numbers, which have none."""
    flags: tuple[str, ...] = ()
    """Remarks on the estimate."""
    in_model: float | None = None
    """Value in the model file that is written."""
    without_causes: float | None = None
    """Value in the calibrated model, without causes."""


@dataclass(frozen=True, slots=True)
class Nuisance:
    """A fitted parameter of the measurement, not of the unit.

    Time offsets of signals and the zero of the plate's sensor are such parameters.
    """

    value: float
    """Estimate, in `unit`."""
    unit: str
    """Unit of all values."""
    interval: Interval | None = None
    """95 % interval; null where it is unknown."""
    on_bound: bool = False
    """Whether the estimate lies on a bound."""
    flags: tuple[str, ...] = ()
    """Remarks on the estimate."""


@dataclass(frozen=True, slots=True)
class ModelFile:
    """Which of two fits the values in the written model file are from."""

    values_from: str
    """Fit that the values are from: balances, or last fit in free run."""
    text: str
    """The same as a sentence."""


@dataclass(frozen=True, slots=True)
class ModelledFriction:
    """Friction at the throttle shaft in each model."""

    unit: str
    """Unit of all values."""
    reference: float | None = None
    """Value of the reference model."""
    calibrated: float | None = None
    """Value of the calibrated model."""
    extended: float | None = None
    """Value of the model with causes."""


@dataclass(frozen=True, slots=True)
class JudgedMeasurement:
    """A measurement of the diagnosis with a model."""

    value: float | None
    """Value, in `unit`; null where it is known to be at most the end of the interval."""
    unit: str
    """Unit of all values."""
    interval: tuple[float | None, float | None]
    """95 % interval; an unknown end is null."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """The diagnosis of the record with a model."""

    verdict: str
    """Verdict of the unit."""
    reasons: tuple[str, ...] = ()
    """Ids of the reasons."""
    measurements: Mapping[str, JudgedMeasurement] = field(default_factory=dict)
    """Measurements by id."""


@dataclass(frozen=True, slots=True)
class Consequence:
    """What the causes change in the diagnosis of the same record."""

    text: str
    """The change as a sentence."""
    reference: Judgement | None = None
    """Diagnosis with the reference model."""
    extended: Judgement | None = None
    """Diagnosis with the model with causes."""
