"""What the report is written from: the contents of `results.json`, and a few columns of numbers for the plots.

Whoever fills these may hand over plain dictionaries with the same keys; `Results.from_dict` and
`ReportSeries.from_mapping` check them. Times are seconds since the run began, on the sample clock; every value is SI
at the throttle shaft; what could not be measured is None, never 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Self

import numpy as np
from pydantic import TypeAdapter, ValidationError

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.recording.samples import Float64

SCHEMA_VERSION = 1


@dataclass(frozen=True, slots=True)
class Unit:
    """The unit under test and what the run says of it; `also` holds the ids of further reasons."""

    verdict: UnitVerdict | None
    reason_id: str = ""
    reason: str = ""
    next_step: str = ""
    also: tuple[str, ...] = ()
    serial: str = ""
    part_number: str = ""
    revision: str = ""


@dataclass(frozen=True, slots=True)
class Lateness:
    """How late the computer was at its own ticks."""

    mean_ms: float
    worst_ms: float


@dataclass(frozen=True, slots=True)
class FrameAge:
    """How old the newest sample was at the bench's ticks."""

    mean_ms: float
    worst_ms: float


@dataclass(frozen=True, slots=True)
class AnswerTime:
    """How long after a command for the bridge a status showed it."""

    mean_ms: float
    worst_ms: float


@dataclass(frozen=True, slots=True)
class Jitter:
    """How far the times between two set-points on the bus were off their period."""

    rms_us: float
    worst_us: float


@dataclass(frozen=True, slots=True)
class Bench:
    """How the bench fared; `safe_state` is True once drive off was seen in the current, None where nobody looked."""

    outcome: BenchOutcome
    reason_id: str = ""
    reason: str = ""
    next_step: str = ""
    safe_state: bool | None = None
    name: str = ""
    lateness: Lateness | None = None
    frame_age: FrameAge | None = None
    answer_time: AnswerTime | None = None
    set_point_jitter: Jitter | None = None
    not_watched: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Clock:
    """How well the computer's stamps follow the controller's sample clock; None where there is nothing to compare."""

    drift_ppm: float | None = None
    residual_rms_us: float | None = None
    residual_worst_us: float | None = None


@dataclass(frozen=True, slots=True)
class Number:
    """One measured value with its 95 % interval (`low`, `high`), its limits and how it stands against them."""

    id: str
    name: str
    value: float | None
    unit: str
    low: float | None = None
    high: float | None = None
    limit_low: float | None = None
    limit_high: float | None = None
    verdict: UnitVerdict | None = None
    note: str = ""


@dataclass(frozen=True, slots=True)
class Exceedance:
    """An episode of friction above its limit; `kind` is the id of the number whose limit it is (`T_st` or `T_c`).

    `peak` and `limit` are amounts in N·m; `allowance` is by how much the model may be off at the peak.
    """

    kind: str
    start_s: float
    end_s: float
    peak: float
    limit: float
    angle: float | None = None
    velocity: float | None = None
    temperature: float | None = None
    phase: str = ""
    allowance: float | None = None


@dataclass(frozen=True, slots=True)
class Phase:
    """A step of the scenario; `end_s` is None where the run ended inside it.

    `trigger_s` is the stamp of the sample that fired the step's condition, `trigger_value` its value.
    """

    id: str
    name: str
    start_s: float
    end_s: float | None = None
    outcome: str = ""
    trigger_s: float | None = None
    trigger_value: float | None = None


@dataclass(frozen=True, slots=True)
class Prompt:
    """What the scenario asked the operator, and what was answered by whom (operator or scenario)."""

    id: str
    text: str
    answer: str
    by: str
    answered_s: float


@dataclass(frozen=True, slots=True)
class Attempt:
    """An attempt before the one that counts: what came of it, and the folder in the session that holds it."""

    number: int
    outcome: BenchOutcome
    verdict: UnitVerdict | None = None
    reason_id: str = ""
    folder: str = ""


@dataclass(frozen=True, slots=True)
class MessageStatistics:
    """What became of one message's frames; `lost` is None where no counter tells."""

    name: str
    frames: int
    lost: int | None = None
    crc_failures: int = 0
    counter_jumps: int = 0
    repeated_counters: int = 0


@dataclass(frozen=True, slots=True)
class Bus:
    """The bus in this run: loads are shares of 1; None where something could not be measured."""

    name: str = ""
    load: float | None = None
    load_peak: float | None = None
    error_frames: int | None = None
    dropped: int | None = None
    state: str | None = None
    transmit_errors: int | None = None
    receive_errors: int | None = None
    messages: tuple[MessageStatistics, ...] = ()


@dataclass(frozen=True, slots=True)
class InputFile:
    """A file that the run was made with; `kind` is model, limits, bench, scenario, dbc or log."""

    kind: str
    name: str
    sha256: str


@dataclass(frozen=True, slots=True)
class Results:
    """Everything that `results.json` holds; keys are the fields' names.

    `seed` is that of a virtual unit's noise; the model is the one that the bench knows the unit by.
    """

    run_id: str
    unit: Unit
    bench: Bench
    schema_version: int = SCHEMA_VERSION
    started: str = ""
    scenario: str = ""
    model: str = ""
    seed: int | None = None
    duration_s: float | None = None
    exit_code: int | None = None
    timestamp_grade: str = ""
    clock: Clock = field(default_factory=Clock)
    numbers: tuple[Number, ...] = ()
    exceedances: tuple[Exceedance, ...] = ()
    phases: tuple[Phase, ...] = ()
    prompts: tuple[Prompt, ...] = ()
    attempts: tuple[Attempt, ...] = ()
    bus: Bus = field(default_factory=Bus)
    versions: Mapping[str, str] = field(default_factory=dict)
    inputs: tuple[InputFile, ...] = ()

    @staticmethod
    def from_dict(data: Mapping[str, Any], file: str = "results.json") -> Results:
        """Read the dictionary of `results.json`; keys not known here are left alone.

        Raises InputError that names each wrong key, or a schema newer than this program.
        """
        version = data.get("schema_version", SCHEMA_VERSION)
        if isinstance(version, int) and version > SCHEMA_VERSION:
            raise InputError(
                Problem(
                    "the results were written by a newer etb-hil",
                    Place(file, key="schema_version"),
                    version,
                    f"up to {SCHEMA_VERSION}",
                    "open them with the version that wrote them, or a later one",
                )
            )
        try:
            return _RESULTS.validate_python(dict(data))
        except ValidationError as error:
            problems = [
                Problem(e["msg"], Place(file, key=".".join(map(str, e["loc"]))), e["input"]) for e in error.errors()
            ]
            raise InputError(*problems) from None

    def as_dict(self) -> dict[str, Any]:
        """Return the dictionary that `json.dump` writes as `results.json`."""
        plain: dict[str, Any] = _RESULTS.dump_python(self, mode="json")
        return plain

    def number(self, number_id: str) -> Number | None:
        """Return a number by its id, or None where the run has none."""
        return next((number for number in self.numbers if number.id == number_id), None)


_RESULTS = TypeAdapter(Results)


def results_schema() -> dict[str, Any]:
    """Return the JSON schema of `results.json`, published by `etb-hil schema results`."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **_RESULTS.json_schema()}


def _none() -> Float64:
    return np.empty(0)


@dataclass(frozen=True, slots=True)
class ReportSeries:
    """Columns for the plots, each group of one length; empty where the run has none.

    Traces (n): `time` s, `angle` rad, `velocity` rad/s, `current` A, `friction` N·m, `temperature` degC (or empty).
    Points that the Stribeck curve was fitted to (m): `point_velocity` rad/s, `point_friction` N·m, and for the map
    `point_angle` rad, `point_temperature` degC, `point_excess` (share above the curve).
    The curve (k): `curve_velocity`, `curve_friction`, and its 95 % band `curve_low`, `curve_high`.
    Friction over angle while sliding slowly, points in any order: `opening_angle`, `opening_friction`;
    `closing_angle`, `closing_friction`.
    Break-aways from rest: `break_away_rate` N·m/s, `break_away_torque` N·m (negative ones closing), and the means at
    several rates: `ramp_rate`, `ramp_torque`, `ramp_low`, `ramp_high`.
    """

    time: Float64 = field(default_factory=_none)
    angle: Float64 = field(default_factory=_none)
    velocity: Float64 = field(default_factory=_none)
    current: Float64 = field(default_factory=_none)
    friction: Float64 = field(default_factory=_none)
    temperature: Float64 = field(default_factory=_none)
    point_velocity: Float64 = field(default_factory=_none)
    point_friction: Float64 = field(default_factory=_none)
    point_angle: Float64 = field(default_factory=_none)
    point_temperature: Float64 = field(default_factory=_none)
    point_excess: Float64 = field(default_factory=_none)
    curve_velocity: Float64 = field(default_factory=_none)
    curve_friction: Float64 = field(default_factory=_none)
    curve_low: Float64 = field(default_factory=_none)
    curve_high: Float64 = field(default_factory=_none)
    opening_angle: Float64 = field(default_factory=_none)
    opening_friction: Float64 = field(default_factory=_none)
    closing_angle: Float64 = field(default_factory=_none)
    closing_friction: Float64 = field(default_factory=_none)
    break_away_rate: Float64 = field(default_factory=_none)
    break_away_torque: Float64 = field(default_factory=_none)
    ramp_rate: Float64 = field(default_factory=_none)
    ramp_torque: Float64 = field(default_factory=_none)
    ramp_low: Float64 = field(default_factory=_none)
    ramp_high: Float64 = field(default_factory=_none)

    def __post_init__(self) -> None:
        for leader, *followers in _GROUPS:
            length = len(getattr(self, leader))
            for name in followers:
                if len(getattr(self, name)) not in (0, length):
                    raise ValueError(f"'{name}' has {len(getattr(self, name))} values, '{leader}' has {length}")

    @classmethod
    def from_mapping(cls, columns: Mapping[str, Any]) -> Self:
        """Take the columns by name; names not known here are left alone, missing ones are empty."""
        known = {f.name for f in fields(cls)}
        return cls(**{name: np.asarray(values, float) for name, values in columns.items() if name in known})


_GROUPS = (
    ("time", "angle", "velocity", "current", "friction", "temperature"),
    ("point_velocity", "point_friction", "point_angle", "point_temperature", "point_excess"),
    ("curve_velocity", "curve_friction", "curve_low", "curve_high"),
    ("opening_angle", "opening_friction"),
    ("closing_angle", "closing_friction"),
    ("break_away_rate", "break_away_torque"),
    ("ramp_rate", "ramp_torque", "ramp_low", "ramp_high"),
)
