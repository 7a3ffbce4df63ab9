"""Errors of the models in the result of `explain`, on data that no fit used."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from etb_hil.results.explained.causes import Interval, WithInterval


@dataclass(frozen=True, slots=True)
class ModelErrors:
    """Root mean square errors of a signal with each model that was run.

    `fitted_in_free_run` is the model with the smallest residual in free run, fitted there.
    """

    unit: str
    """Unit of all errors."""
    reference: float | None = None
    """Error of the reference model."""
    calibrated: float | None = None
    """Error of the calibrated model."""
    extended: float | None = None
    """Error of the model with causes."""
    fitted_in_free_run: float | None = None
    """Error of the model that was fitted in free run."""
    noise_floor: float | None = None
    """Error of a true model, from the noise of the sensors."""


@dataclass(frozen=True, slots=True)
class WorstSegment:
    """The segment with the largest error of the model.

    `others` is the error of all other segments, `noise_floor_range` that of true models in this one.
    """

    from_s: float
    """Start, s."""
    to_s: float
    """End, s."""
    error: float
    """RMS error in the segment."""
    share: float
    """Share of the squared error in the segment."""
    others: float
    """RMS error of all other segments."""
    noise_floor_range: Interval
    """Range of the error of true models in the segment."""


@dataclass(frozen=True, slots=True)
class Errors:
    """Errors on data that no fit used.

    `holdout[kind][signal]` has the kinds one_step and free_run.
    """

    holdout: Mapping[str, Mapping[str, ModelErrors]]
    """Errors by kind (`one_step`, `free_run`) and signal."""
    nrmse_free_run: Mapping[str, float] = field(default_factory=dict)
    """Free-run RMS error over the range of motion, by model."""
    noise_floor_range: Interval | None = None
    """Range of the free-run error of true models."""
    free_run_worst: WorstSegment | None = None
    """Segment with the largest error."""
    text: str = ""
    """Remark on the errors."""


@dataclass(frozen=True, slots=True)
class Gain(WithInterval):
    """By what share the error of one model is smaller than that of another.

    `of` names the error and both models.
    """

    value: float
    """Relative reduction of the error."""
    interval: Interval
    """95 % interval."""
    of: str = ""
    """Name of the error and of both models."""
    over_reference: Gain | None = None
    """Reduction relative to the reference model."""


@dataclass(frozen=True, slots=True)
class Starts:
    """The error (rad) at which each start of a fit in free run ended."""

    rms_rad: tuple[float, ...]
    """Final RMS error of each start, rad."""
    text: str
    """The same as a sentence."""
