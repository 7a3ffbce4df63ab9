"""The result of `explain`, typed.

It says what the simulation gets wrong of a measurement, why, and how well that is known.

`explanation.json` holds these fields; four have other names there. Values are SI; intervals are 95 %. What is not known
is None.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from pydantic import Field

SCHEMA = "etb_hil/explanation/2"
LAST_FIT = "last fit in free run"  # of `ModelFile.numbers_of`

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Size:
    """How large a parameter is.

    `in_model` is what the model file holds of it, `flags` say how far to trust it.
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
    """A cause that was taken in.

    `indistinguishable` are the effects that the data cannot distinguish from it.

    `component` is where all of them sit, empty where they differ. `share` is its part of the squared error, `sizes` its
    parameters by name, `finer_in_model` shapes that only the last fit has. `held_out_t` is Student's t of what it
    explains of segments that the fit did not see.
    """

    id: Annotated[str, Field(alias="effect")]
    probability: float
    indistinguishable: Annotated[tuple[str, ...], Field(alias="class")]
    sizes: Annotated[Mapping[str, Size], Field(alias="parameters")]
    share: Annotated[float, Field(alias="share_of_error")]
    finer_in_model: Mapping[str, float] = field(default_factory=dict)
    held_out_t: float | None = None
    component: str = ""


@dataclass(frozen=True, slots=True)
class BenchNumber:
    """A number that was measured at the bench, and what it judges.

    `stated` is what the model file has without it.
    """

    name: str
    judges: str
    value: float
    uncertainty: float
    unit: str
    shaft: str | None
    stated: float
    tolerance: float
    is_cause: bool


@dataclass(frozen=True, slots=True)
class Suspect:
    """A candidate of one search.

    `leaves` is the share of the squared error that stays with it.
    """

    search: int
    effect: str
    taken_in: bool
    refused: str
    probability: float
    leaves: float
    looks_like: str
    check: str


@dataclass(frozen=True, slots=True)
class Excess:
    """A balance and regime in which more is left than noise."""

    balance: str
    regime: str
    rms_over_floor: float


@dataclass(frozen=True, slots=True)
class Placeholder:
    """A curve that takes a share of the residual, in a balance, over a coordinate."""

    balance: str
    over: str
    parity: str
    share_of_rest: float


@dataclass(frozen=True, slots=True)
class BreakAwayVoltages:
    """The voltages in V at which the plate breaks away; None where it does not."""

    measured: float | None
    model: float | None


@dataclass(frozen=True, slots=True)
class FreeRun:
    """A run of slow data, driven by the voltage alone.

    `value` is that of the `condition` that was set.
    """

    condition: str
    value: float | None
    unit: str
    begins_s: float
    seen_by_the_fit: bool
    r_squared: float
    rms_rad: float
    breaks_away: Annotated[BreakAwayVoltages, Field(alias="breaks_away_at_V")]


@dataclass(frozen=True, slots=True)
class Unexplained:
    """What no known cause accounts for."""

    where: tuple[Excess, ...] = ()
    placeholders: tuple[Placeholder, ...] = ()
    runs: tuple[FreeRun, ...] = ()
    says: str = ""


@dataclass(frozen=True, slots=True)
class Calibrated:
    """A base parameter as fitted.

    `without_causes` is its value in the calibrated model, where `value` has causes.
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
    """A fitted number of the measurement, not of the unit.

    It is a time offset of a signal, or the zero of the plate's sensor.
    """

    value: float
    unit: str
    interval: Interval | None = None
    on_bound: bool = False
    flags: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ModelFile:
    """Which of two fits the numbers in the model file are from."""

    numbers_of: str
    says: str


@dataclass(frozen=True, slots=True)
class ModelledFriction:
    """Friction at the throttle shaft as each model has it."""

    unit: str
    nominal: float | None = None
    calibrated: float | None = None
    extended: float | None = None


@dataclass(frozen=True, slots=True)
class BalanceResidual:
    """The residual of a balance over its noise floor, in a regime.

    It is known before any cause, and with all of them.
    """

    calibrated_over_floor: float
    extended_over_floor: float
    rows: int


@dataclass(frozen=True, slots=True)
class DetectionLimit:
    """The strength from which on an effect would have been seen.

    It is None where none would; `where` says where the record went.
    """

    parameter: str
    limit: float | None
    unit: str
    judged: bool
    within_bounds: bool
    says: str = ""
    where: str = ""


@dataclass(frozen=True, slots=True)
class Separation:
    """By how much a test would separate a cause from others.

    `parts` are those that it separates, `leaves` those that it does not.
    """

    value: float | None
    unit: str
    parts: tuple[str, ...]
    leaves: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Wanted:
    """A number that a measurement at the bench gives, to within `uncertainty`."""

    name: str
    uncertainty: float
    unit: str
    shaft: str | None = None


@dataclass(frozen=True, slots=True)
class BenchStep:
    """Something to do at the bench, and the numbers that it gives."""

    do: str
    gives: tuple[Wanted, ...]


@dataclass(frozen=True, slots=True)
class NextTest:
    """The test that settles what is open between a `pair`.

    `scenario` is the stock one to run, if any.
    """

    says: str
    pair: tuple[str, str]
    scenario: str | None = None
    separation_here: float | None = None
    expected_separation: Separation | None = None
    by_hand: tuple[BenchStep, ...] = ()


@dataclass(frozen=True, slots=True)
class DataQuality:
    """What a segment of data is worth.

    `travel` and `angle_noise` are in `travel_unit`.
    """

    origin: str
    rate_hz: float
    seconds: float
    flags: tuple[str, ...]
    travel: Interval | None = None
    angle_noise: float | None = None
    travel_unit: str = "rad"
    noise_at_rest: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class ModelErrors:
    """Root mean square errors of a signal under each model that was run."""

    unit: str
    nominal: float | None = None
    calibrated: float | None = None
    extended: float | None = None
    followed: float | None = None
    noise_floor: float | None = None


@dataclass(frozen=True, slots=True)
class WorstSegment:
    """The segment that the model errs most in.

    The errors of all others, and of true models in that one, stand beside it.
    """

    from_s: float
    to_s: float
    error: float
    share: float
    others: float
    noise_floor_range: Interval


@dataclass(frozen=True, slots=True)
class Errors:
    """Errors on data that no fit saw.

    `holdout[kind][signal]` has the kinds one_step and free_run.
    """

    holdout: Mapping[str, Mapping[str, ModelErrors]]
    nrmse_free_run: Mapping[str, float] = field(default_factory=dict)
    noise_floor_range: Interval | None = None
    free_run_worst: WorstSegment | None = None
    says: str = ""


@dataclass(frozen=True, slots=True)
class Gain:
    """By what share one model errs less than another; `of` says what and which."""

    value: float
    interval: Interval
    of: str = ""
    over_stated: Gain | None = None

    @property
    def low(self) -> float:
        """The lower end of the interval."""
        return self.interval[0]

    @property
    def high(self) -> float:
        """The upper end of the interval."""
        return self.interval[1]


@dataclass(frozen=True, slots=True)
class JudgedNumber:
    """A measurement of the diagnosis under a model."""

    value: float
    unit: str
    interval: tuple[float | None, float | None]


@dataclass(frozen=True, slots=True)
class JudgedUnder:
    """What the diagnosis says of the record under a model."""

    verdict: str
    reasons: tuple[str, ...] = ()
    measurements: Mapping[str, JudgedNumber] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Consequence:
    """What the causes change in the diagnosis of the same record."""

    says: str
    stated: JudgedUnder | None = None
    extended: JudgedUnder | None = None


@dataclass(frozen=True, slots=True)
class Starts:
    """At which error (rad) each start of a fit in free run ended."""

    rms_rad: tuple[float, ...]
    says: str


@dataclass(frozen=True, slots=True)
class Confounded:
    """Two conditions that changed together: the data cannot tell what either does."""

    these: str
    pair: tuple[str, str]
    test: str
    rank_correlation: float
    says: str


@dataclass(frozen=True, slots=True)
class ErrorWithAndWithout:
    """The error of one free run over a recording, without a cause and with it."""

    without: float
    with_it: Annotated[float, Field(alias="with")]
    unit: str


@dataclass(frozen=True, slots=True)
class Transfer:
    """Whether a cause as found in one recording is in another."""

    effect: str
    recording: str
    gain: float
    carried_over: bool
    free_run: ErrorWithAndWithout
    says: str


@dataclass(frozen=True, slots=True)
class ToldApart:
    """What a recording distinguishes a cause from.

    It does so by its likelihood, or as another one of the same unit.
    """

    effect: str
    tells_from: tuple[str, ...]
    recording: str


@dataclass(frozen=True, slots=True)
class ExplanationResult:
    """Everything that `explain` found.

    `data_quality` holds sentences where data could not be judged.

    `interrupted` names the work that an interrupt ended, `stages` what was done by then. `runs`, `starts` and
    `judged_by` are of data too slow to name causes by.
    """

    verdict: str
    causes: tuple[Cause, ...] = ()
    data_quality: tuple[str | DataQuality, ...] = ()
    confounded: tuple[Confounded, ...] = ()
    schema: str = SCHEMA
    measured: tuple[BenchNumber, ...] = ()
    suspects: tuple[Suspect, ...] = ()
    unexplained: Unexplained = field(default_factory=Unexplained)
    calibrated: Mapping[str, Calibrated] = field(default_factory=dict)
    model_file: ModelFile | None = None
    nuisances: Mapping[str, Nuisance] = field(default_factory=dict)
    friction: Mapping[str, ModelledFriction] = field(default_factory=dict)
    balances: Mapping[str, Mapping[str, BalanceResidual]] = field(default_factory=dict)
    detection_limits: Mapping[str, DetectionLimit] = field(default_factory=dict)
    next_test: NextTest | None = None
    errors: Errors | None = None
    gain: Gain | None = None
    diagnosis: Consequence | None = None
    transfer: tuple[Transfer, ...] = ()
    told_apart_by_others: tuple[ToldApart, ...] = ()
    left_out: tuple[str, ...] = ()
    interrupted: str = ""
    stages: str = ""
    judged_by: str = ""
    runs: tuple[FreeRun, ...] = ()
    starts: Starts | None = None

    @property
    def component(self) -> str:
        """The component that all causes sit in, whichever of them it is.

        It is empty where they differ, and without a cause.
        """
        found = {one.component for one in self.causes}
        return found.pop() if len(found) == 1 else ""
