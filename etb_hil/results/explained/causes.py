"""Causes, candidates and bench measurements in the result of `explain`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from etb_hil.results import shown
from etb_hil.results.measurement import Measurement

Interval = tuple[float, float]


class WithInterval:
    """Both ends of a result's 95 % interval."""

    __slots__ = ()
    interval: Interval

    @property
    def low(self) -> float:
        """The lower end of the interval."""
        return self.interval[0]

    @property
    def high(self) -> float:
        """The upper end of the interval."""
        return self.interval[1]


@dataclass(frozen=True, slots=True)
class ParameterEstimate(WithInterval):
    """An estimate of a cause's parameter, with its 95 % interval.

    `in_model` is the value in the model file that is written; `flags` are remarks on how far to trust the estimate.
    """

    value: float
    """Estimate, in `unit`."""
    unit: str
    """Unit of all values."""
    interval: Interval
    """95 % interval."""
    on_bound: bool = False
    """Whether the estimate lies on a bound of the effect."""
    flags: tuple[str, ...] = ()
    """Remarks on how far to trust the estimate."""
    in_model: float | None = None
    """Value in the model file that is written; null without one."""

    def __str__(self) -> str:
        """Return the value with its unit and its 95 % interval, angles in degrees."""
        one = Measurement("", "", self.value, self.unit, self.low, self.high)
        return f"{shown.measured(one)} (95 %: {shown.interval(one)})"


@dataclass(frozen=True, slots=True)
class Cause:
    """An accepted cause.

    `id` is that of an effect, or `parameter:NAME` for a parametric fault. `not_isolable_from` are the other members of
    its ambiguity group.

    `component` is where all members sit, empty where they differ. `share_of_error` is the part of the squared error
    that the cause explains, `finer_in_model` are shapes that only the last fit has. `held_out_t` is Student's t of what
    the cause explains of segments that the fit did not use.
    """

    id: str
    """Id of an effect, or `parameter:NAME` for a parametric fault."""
    probability: float | None
    """1 for a cause that stands alone; null for one in an ambiguity group."""
    not_isolable_from: tuple[str, ...]
    """Ids of the other members of the ambiguity group."""
    parameters: Mapping[str, ParameterEstimate]
    """Estimated parameters by name."""
    share_of_error: float
    """Share of the squared error that the cause explains."""
    finer_in_model: Mapping[str, float] = field(default_factory=dict)
    """Finer shape parameters that only the last fit has, by name."""
    held_out_t: float | None = None
    """Student's t in cross-validation, over segments that the fit did not use."""
    component: str = ""
    """Component that all members of the group sit in; empty where they differ."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A candidate cause of a selection step, with the evidence for and against it.

    `residual_share` is the square of the misfit with it, over that without it, in the channels that the likeliest one
    lessens. `rejection` says why it is no cause.
    """

    selection_step: int
    """Number of the selection step, from 1."""
    id: str
    """Id of an effect, or `parameter:NAME`."""
    accepted: bool
    """Whether the candidate was accepted as a cause."""
    rejection: str
    """Why the step's likeliest candidate was rejected; empty for others."""
    probability: float | None
    """1 for a cause, 0 for an excluded candidate; null in an ambiguity group."""
    residual_share: float
    """Square of the misfit with the candidate over that without it."""
    looks_like: str
    """Symptom of the effect."""
    check: str
    """What to check at the unit."""
    evidence: float | None = None
    """Log-evidence over the model without it, in nats; null in earlier answers."""


@dataclass(frozen=True, slots=True)
class MeasuredParameter:
    """A parameter that was measured at the bench.

    `candidate` is the id that the measurement confirms or excludes. `nominal` is the model file's value without the
    measurement.
    """

    name: str
    """Name of the parameter."""
    candidate: str
    """Id that the measurement confirms or excludes."""
    value: float
    """Measured value, in `unit`."""
    uncertainty: float
    """Uncertainty of the measurement: the true value lies within it."""
    unit: str
    """Unit of all values."""
    shaft: str | None
    """Shaft at which the value holds; null if it has none."""
    nominal: float
    """Value in the model file without the measurement."""
    tolerance: float
    """Tolerance in the model file."""
    is_cause: bool
    """Whether the value is outside the tolerance by more than its uncertainty."""


@dataclass(frozen=True, slots=True)
class Isolation:
    """Ids that a recording distinguishes a cause from.

    The explained recording excludes them by its likelihood, another one of the same unit by its own ambiguity group.
    """

    cause: str
    """Id of the cause."""
    isolated_from: tuple[str, ...]
    """Ids that the recording excludes."""
    recording: str
    """Recording that excludes them."""


@dataclass(frozen=True, slots=True)
class ErrorWithAndWithout:
    """The error of one free run over a recording, without a cause and with it."""

    without_cause: float
    """RMS error without the cause."""
    with_cause: float
    """RMS error with the cause."""
    unit: str
    """Unit of both errors."""


@dataclass(frozen=True, slots=True)
class Transfer:
    """Whether another recording shows a cause, too.

    `explained_share` is the part of that recording's squared residual that the cause explains. `angle_shift` stands
    for the zero of an incremental encoder, up to a whole wave of the causes.
    """

    cause: str
    """Id of the cause."""
    recording: str
    """The other recording."""
    explained_share: float
    """Share of its squared residual that the cause explains."""
    carried_over: bool
    """Whether the other recording shows the cause, too."""
    free_run: ErrorWithAndWithout
    """Error of a free run over the other recording."""
    text: str
    """The result as a sentence."""
    angle_shift: float | None = None
    """Shift added to its output angle for the first zero, in the unit of `free_run`; null without one."""
