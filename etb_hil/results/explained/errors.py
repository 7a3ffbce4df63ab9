"""Errors of the models in the result of `explain`, on data that no fit used."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from etb_hil.results.explained.causes import Interval


@dataclass(frozen=True, slots=True)
class ModelErrors:
    """Root mean square errors of a signal with each model that was run.

    `fitted_in_free_run` is the model with the smallest residual in free run, fitted there.
    """

    unit: str
    reference: float | None = None
    calibrated: float | None = None
    extended: float | None = None
    fitted_in_free_run: float | None = None
    noise_floor: float | None = None


@dataclass(frozen=True, slots=True)
class WorstSegment:
    """The segment with the largest error of the model.

    `others` is the error of all other segments, `noise_floor_range` that of true models in this one.
    """

    from_s: float
    to_s: float
    error: float
    share: float
    others: float
    noise_floor_range: Interval


@dataclass(frozen=True, slots=True)
class Errors:
    """Errors on data that no fit used.

    `holdout[kind][signal]` has the kinds one_step and free_run.
    """

    holdout: Mapping[str, Mapping[str, ModelErrors]]
    nrmse_free_run: Mapping[str, float] = field(default_factory=dict)
    noise_floor_range: Interval | None = None
    free_run_worst: WorstSegment | None = None
    text: str = ""


@dataclass(frozen=True, slots=True)
class Gain:
    """By what share the error of one model is smaller than that of another.

    `of` names the error and both models.
    """

    value: float
    interval: Interval
    of: str = ""
    over_reference: Gain | None = None

    @property
    def low(self) -> float:
        """The lower end of the interval."""
        return self.interval[0]

    @property
    def high(self) -> float:
        """The upper end of the interval."""
        return self.interval[1]


@dataclass(frozen=True, slots=True)
class Starts:
    """The error (rad) at which each start of a fit in free run ended."""

    rms_rad: tuple[float, ...]
    text: str
