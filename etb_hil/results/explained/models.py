"""Models in the result of `explain`: parameters, friction, diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from etb_hil.results.explained.causes import Interval

LAST_FIT = "last fit in free run"  # of `ModelFile.values_from`


@dataclass(frozen=True, slots=True)
class CalibratedParameter:
    """A base parameter as fitted.

    `without_causes` is its value in the calibrated model, where `value` has causes. `in_model` is the value in the
    model file that is written.
    """

    unit: str
    nominal: float
    value: float
    interval: Interval | None
    tolerance: float
    flags: tuple[str, ...] = ()
    in_model: float | None = None
    without_causes: float | None = None


@dataclass(frozen=True, slots=True)
class Nuisance:
    """A fitted parameter of the measurement, not of the unit.

    Time offsets of signals and the zero of the plate's sensor are such parameters.
    """

    value: float
    unit: str
    interval: Interval | None = None
    on_bound: bool = False
    flags: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ModelFile:
    """Which of two fits the values in the written model file are from."""

    values_from: str
    text: str


@dataclass(frozen=True, slots=True)
class ModelledFriction:
    """Friction at the throttle shaft in each model."""

    unit: str
    reference: float | None = None
    calibrated: float | None = None
    extended: float | None = None


@dataclass(frozen=True, slots=True)
class JudgedMeasurement:
    """A measurement of the diagnosis with a model."""

    value: float
    unit: str
    interval: tuple[float | None, float | None]


@dataclass(frozen=True, slots=True)
class Judgement:
    """The diagnosis of the record with a model."""

    verdict: str
    reasons: tuple[str, ...] = ()
    measurements: Mapping[str, JudgedMeasurement] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Consequence:
    """What the causes change in the diagnosis of the same record."""

    text: str
    reference: Judgement | None = None
    extended: Judgement | None = None
