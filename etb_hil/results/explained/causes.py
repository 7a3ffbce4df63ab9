"""Causes, candidates and bench measurements in the result of `explain`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class ParameterEstimate:
    """An estimate of a cause's parameter, with its 95 % interval.

    `in_model` is the value in the model file that is written; `flags` are remarks on how far to trust the estimate.
    """

    value: float
    unit: str
    interval: Interval
    on_bound: bool = False
    flags: tuple[str, ...] = ()
    in_model: float | None = None

    @property
    def low(self) -> float:
        """The lower end of the interval."""
        return self.interval[0]

    @property
    def high(self) -> float:
        """The upper end of the interval."""
        return self.interval[1]


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
    probability: float
    not_isolable_from: tuple[str, ...]
    parameters: Mapping[str, ParameterEstimate]
    share_of_error: float
    finer_in_model: Mapping[str, float] = field(default_factory=dict)
    held_out_t: float | None = None
    component: str = ""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A candidate cause of a selection step, with the evidence for and against it.

    `residual_share` is the residual sum of squares with it, over that without it. `rejection` says which criterion
    rejected it.
    """

    selection_step: int
    id: str
    accepted: bool
    rejection: str
    probability: float
    residual_share: float
    looks_like: str
    check: str


@dataclass(frozen=True, slots=True)
class MeasuredParameter:
    """A parameter that was measured at the bench.

    `candidate` is the id that the measurement confirms or excludes. `nominal` is the model file's value without the
    measurement.
    """

    name: str
    candidate: str
    value: float
    uncertainty: float
    unit: str
    shaft: str | None
    nominal: float
    tolerance: float
    is_cause: bool


@dataclass(frozen=True, slots=True)
class Isolation:
    """Ids that a recording distinguishes a cause from.

    The explained recording excludes them by its likelihood, another one of the same unit by its own ambiguity group.
    """

    cause: str
    isolated_from: tuple[str, ...]
    recording: str


@dataclass(frozen=True, slots=True)
class ErrorWithAndWithout:
    """The error of one free run over a recording, without a cause and with it."""

    without_cause: float
    with_cause: float
    unit: str


@dataclass(frozen=True, slots=True)
class Transfer:
    """Whether another recording shows a cause, too.

    `explained_share` is the part of that recording's squared residual that the cause explains.
    """

    cause: str
    recording: str
    explained_share: float
    carried_over: bool
    free_run: ErrorWithAndWithout
    text: str
