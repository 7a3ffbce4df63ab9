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
    """RMS residual of the calibrated model over the noise floor."""
    extended_over_noise_floor: float
    """RMS residual of the model with causes over the noise floor."""
    samples: int
    """Number of samples."""


@dataclass(frozen=True, slots=True)
class Excess:
    """A balance and regime in which the residual exceeds its noise floor."""

    balance: str
    """Balance: torque, voltage or angle."""
    regime: str
    """Regime of motion."""
    rms_over_noise_floor: float
    """RMS residual over the noise floor."""


@dataclass(frozen=True, slots=True)
class NonparametricTerm:
    """A curve over a coordinate that explains a share of a balance's residual."""

    balance: str
    """Balance: torque, voltage or angle."""
    over: str
    """Coordinate of the curve."""
    parity: str
    """Parity in the velocity: odd, even or neither."""
    explained_share: float
    """Share of the balance's squared residual that the curve explains."""


@dataclass(frozen=True, slots=True)
class BreakAwayVoltages:
    """The voltages in V at which the plate breaks away; None where it does not."""

    measured_v: float | None
    """Measured voltage, V."""
    model_v: float | None
    """Voltage of the model, V."""


@dataclass(frozen=True, slots=True)
class FreeRun:
    """A run of slow data, driven by the voltage alone.

    `value` is that of the `condition` that was set.
    """

    condition: str
    """Role that was set for the run; empty if none was."""
    value: float | None
    """Value of the condition."""
    unit: str
    """Unit of `value`."""
    start_s: float
    """Start of the run in the recording, s."""
    used_in_fit: bool
    """Whether the fit used the run."""
    r_squared: float
    """Coefficient of determination of the angle."""
    rms_rad: float
    """RMS error of the angle, rad."""
    break_away_voltage: BreakAwayVoltages
    """Voltages at which the plate breaks away."""


@dataclass(frozen=True, slots=True)
class Unexplained:
    """The residual that no known cause explains."""

    where: tuple[Excess, ...] = ()
    """Balances and regimes whose residual exceeds the threshold."""
    nonparametric_terms: tuple[NonparametricTerm, ...] = ()
    """Curves that explain a share of the residual."""
    runs: tuple[FreeRun, ...] = ()
    """Runs of slow data with the largest errors."""
    text: str = ""
    """What else is known of it, as a sentence."""


@dataclass(frozen=True, slots=True)
class DetectionLimit:
    """The smallest strength of an effect that these data show.

    `limit` is None where no strength would be seen. `valid_range` is the range of motion in which the limit holds.
    """

    parameter: str
    """Strength parameter of the effect."""
    limit: float | None
    """Smallest detectable strength, in `unit`; null if there is none."""
    unit: str
    """Unit of `limit`."""
    judged: bool
    """Whether the effect was tested."""
    within_bounds: bool
    """Whether the limit is within the effect's bounds."""
    text: str = ""
    """Reason why there is no limit, or a condition of it."""
    valid_range: str = ""
    """Range of motion in which the limit holds."""


@dataclass(frozen=True, slots=True)
class DataQuality:
    """The quality of a segment of data.

    `travel` and `angle_noise` are in `travel_unit`.
    """

    origin: str
    """Recording or segment."""
    rate_hz: float
    """Sample rate, Hz."""
    duration_s: float
    """Duration, s."""
    flags: tuple[str, ...]
    """Remarks on the quality."""
    travel: Interval | None = None
    """Smallest and largest position, in `travel_unit`."""
    angle_noise: float | None = None
    """Noise of the position signal, in `travel_unit`."""
    travel_unit: str = "rad"
    """Unit of `travel` and `angle_noise`."""
    noise_at_rest: Mapping[str, float] = field(default_factory=dict)
    """Noise of other signals at rest, by name with unit."""


@dataclass(frozen=True, slots=True)
class Confounded:
    """Two conditions that changed together: the data cannot distinguish their effects."""

    conditions: str
    """Both conditions in words."""
    pair: tuple[str, str]
    """Both conditions by role."""
    test: str
    """Test that changes one of them alone."""
    rank_correlation: float
    """Spearman's rank correlation."""
    text: str
    """The same as a sentence."""
