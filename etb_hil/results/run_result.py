"""The result of a run, typed.

The result has the unit's verdict, how the bench fared, and what was measured, seen and asked.

Times are seconds since the run began, on the sample clock. Values are SI at the throttle shaft. What could not be
measured is None, never 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from etb_hil.base.outcome import BenchOutcome, ExitCode, UnitVerdict, exit_code
from etb_hil.base.plugins import Plugin
from etb_hil.results.measurement import Measurement, Measurements
from etb_hil.results.unit_diagnostics import UnitDiagnostics

SCHEMA_VERSION = 2


@dataclass(frozen=True, slots=True)
class Unit:
    """The unit under test and what the run says of it.

    `also` holds the ids of further reasons.
    """

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
class Reading:
    """How a role that is read by data identifier came while the phases lasted.

    `rate_hz` counts its readings, `gap_worst_ms` is the longest time between two. A reading's time is known to
    `time_error_mean_ms`, at worst `time_error_worst_ms`: half of what passed between request and response; None where
    the unit sends the value by itself.
    """

    role: str
    identifier: int
    is_polled: bool
    count: int
    rate_hz: float | None = None
    gap_worst_ms: float | None = None
    time_error_mean_ms: float | None = None
    time_error_worst_ms: float | None = None


@dataclass(frozen=True, slots=True)
class Bench:
    """How the bench fared.

    `safe_state` is True once drive off was seen in the current, None where nobody looked.
    """

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
    readings: tuple[Reading, ...] = ()


@dataclass(frozen=True, slots=True)
class Clock:
    """How well the computer's stamps follow the controller's sample clock.

    What cannot be compared is None.
    """

    drift_ppm: float | None = None
    residual_rms_us: float | None = None
    residual_worst_us: float | None = None


@dataclass(frozen=True, slots=True)
class Exceedance:
    """An episode of friction above its limit.

    `kind` is the id of the measurement whose limit it is.

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
    """What the scenario asked the operator, and what was answered.

    The answer is by the operator, or by the scenario.

    `entry` is the text that the operator entered, or the path of the photo in the session; empty where none was asked.
    """

    id: str
    text: str
    answer: str
    by: str
    answered_s: float
    entry: str = ""


@dataclass(frozen=True, slots=True)
class Attempt:
    """An attempt before the one that counts.

    The attempt has what came of it, and the folder in the session that holds it.
    """

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
    """The bus in this run.

    Loads are shares of 1; what could not be measured is None.
    """

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
    """A file that the run was made with.

    `kind` is model, limits, bench, scenario, dbc or log.
    """

    kind: str
    name: str
    sha256: str


@dataclass(frozen=True, slots=True)
class RunResult:
    """Everything that a run found: `results.json` holds these fields by their names.

    `seed` is that of a virtual unit's noise. `model` names the model that the bench judges by.
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
    measurements: Measurements = field(default_factory=Measurements)
    exceedances: tuple[Exceedance, ...] = ()
    phases: tuple[Phase, ...] = ()
    prompts: tuple[Prompt, ...] = ()
    attempts: tuple[Attempt, ...] = ()
    unit_diagnostics: UnitDiagnostics | None = None
    bus: Bus = field(default_factory=Bus)
    versions: Mapping[str, str] = field(default_factory=dict)
    plugins: tuple[Plugin, ...] = ()
    inputs: tuple[InputFile, ...] = ()

    @property
    def code(self) -> ExitCode:
        """The exit code: the recorded one, or that of the two outcomes."""
        if self.exit_code is not None:
            return ExitCode(self.exit_code)
        return exit_code(self.bench.outcome, self.unit.verdict)

    @property
    def judged(self) -> tuple[Measurement, ...]:
        """The measurements that limits apply to."""
        return tuple(one for one in self.measurements.values() if one.is_judged)
