"""Residual and quality of the data in the result of `explain`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from etb_hil.results.explained.causes import Interval


@dataclass(frozen=True, slots=True)
class BalanceResidual:
    """The residual of a balance over its noise floor, in a regime.

    The ratio is given for the calibrated model and for the extended one.
    """

    calibrated_over_noise_floor: float
    extended_over_noise_floor: float
    samples: int


@dataclass(frozen=True, slots=True)
class Excess:
    """A balance and regime in which the residual exceeds its noise floor."""

    balance: str
    regime: str
    rms_over_noise_floor: float


@dataclass(frozen=True, slots=True)
class NonparametricTerm:
    """A curve over a coordinate that explains a share of a balance's residual."""

    balance: str
    over: str
    parity: str
    explained_share: float


@dataclass(frozen=True, slots=True)
class BreakAwayVoltages:
    """The voltages in V at which the plate breaks away; None where it does not."""

    measured_v: float | None
    model_v: float | None


@dataclass(frozen=True, slots=True)
class FreeRun:
    """A run of slow data, driven by the voltage alone.

    `value` is that of the `condition` that was set.
    """

    condition: str
    value: float | None
    unit: str
    start_s: float
    used_in_fit: bool
    r_squared: float
    rms_rad: float
    break_away_voltage: BreakAwayVoltages


@dataclass(frozen=True, slots=True)
class Unexplained:
    """The residual that no known cause explains."""

    where: tuple[Excess, ...] = ()
    nonparametric_terms: tuple[NonparametricTerm, ...] = ()
    runs: tuple[FreeRun, ...] = ()
    text: str = ""


@dataclass(frozen=True, slots=True)
class DetectionLimit:
    """The smallest strength of an effect that these data show.

    `limit` is None where no strength would be seen. `valid_range` is the range of motion in which the limit holds.
    """

    parameter: str
    limit: float | None
    unit: str
    judged: bool
    within_bounds: bool
    text: str = ""
    valid_range: str = ""


@dataclass(frozen=True, slots=True)
class DataQuality:
    """The quality of a segment of data.

    `travel` and `angle_noise` are in `travel_unit`.
    """

    origin: str
    rate_hz: float
    duration_s: float
    flags: tuple[str, ...]
    travel: Interval | None = None
    angle_noise: float | None = None
    travel_unit: str = "rad"
    noise_at_rest: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Confounded:
    """Two conditions that changed together: the data cannot distinguish their effects."""

    conditions: str
    pair: tuple[str, str]
    test: str
    rank_correlation: float
    text: str
