"""The dry run: the scenario in lock-step on the bench's own model.

The dry run finds what set-points alone do not show (the current of a step, the speed of an overshoot), and it has
compiled everything by the time that frames must be answered within milliseconds.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING

from etb_hil.base.errors import InputError, PartFault, Problem
from etb_hil.base.outcome import BenchOutcome
from etb_hil.base.plugins import has_plugins, when_changed
from etb_hil.base.remembered import is_remembered, remember
from etb_hil.base.stock import stock_file
from etb_hil.bench.bench_file import load_bench
from etb_hil.bench.runner import Runner
from etb_hil.bench.safety_limits import SafetyLimits
from etb_hil.bench.stop_signals import StopSignals
from etb_hil.bench.tap import Tap
from etb_hil.canio.bus.bus_settings import VIRTUAL
from etb_hil.canio.bus.link import VirtualLink
from etb_hil.canio.bus.virtual_network import VirtualNetwork
from etb_hil.canio.dbc.commands import CommandEncoder
from etb_hil.controller.virtual_controller import VirtualController
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.port import Port
from etb_hil.scenario.condition import Until
from etb_hil.scenario.kinds.current_zero import CurrentZeroPhase
from etb_hil.scenario.kinds.home import HomePhase
from etb_hil.scenario.kinds.off import OffPhase
from etb_hil.scenario.kinds.prompt import PromptPhase
from etb_hil.scenario.kinds.wait import WaitPhase
from etb_hil.scenario.kinds.warm_up import WarmUpPhase
from etb_hil.session.analysis import Analysis
from etb_hil.session.record import PhaseEnd

if TYPE_CHECKING:
    from etb_hil.base.yamlfile import Document
    from etb_hil.bench.bench_file import Bench
    from etb_hil.canio.frames import FrameBlock
    from etb_hil.diagnosis.limits import Limits
    from etb_hil.plant.parameters import Model
    from etb_hil.scenario.scenario_file import Scenario, Step
    from etb_hil.scenario.trajectory import Trajectory
    from etb_hil.session.record import RunRecord

SEED = 0
MARGIN = 0.1  # of current and velocity: the model's tolerances of resistance and motor constant
ANGLE_MARGIN = 2e-3  # rad, noise and steps of a plate sensor
TEMPERATURE_MARGIN = 5.0  # K
WARM_UP_S = 5.0  # a warm-up repeats itself: what it draws shows early
REST_S = 1.0  # a plate that is let go rests after this time
LOOK_S = 5e-3  # between two looks for the fastest moment of a phase
MOST_LOOKS = 10_000
FALL_END = 0.25  # rad before limp-home, where it falls fastest
RESTS = {OffPhase: "duration", CurrentZeroPhase: "duration", HomePhase: "release"}  # how long the bridge is off
EVERY_WAY = 3  # so many phases of which nobody knows the end are rehearsed with all their ends

DRY_RUN = "dry_run"  # the check by which passed ones are remembered
_passed: deque[tuple[object, ...]] = deque(maxlen=64)  # scenario, bench, model and limits of the latest that passed
when_changed(_passed.clear)


@dataclass(frozen=True, slots=True)
class _Nowhere:
    """A log that keeps nothing."""

    def write(self, frames: FrameBlock) -> None:
        """Drop frames."""

    def flush(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""

    def add(self, stamp_ns: int, event: str, **details: object) -> None:
        """Drop an event."""


def with_margins(limits: SafetyLimits) -> SafetyLimits:
    """Return limits that leave room for what the unit is not quite like the model."""
    low, high = limits.angle
    return limits.model_copy(
        update={
            "current": limits.current * (1.0 - MARGIN),
            "velocity": limits.velocity * (1.0 - MARGIN),
            "angle": (low + ANGLE_MARGIN, high - ANGLE_MARGIN),
            "temperature": limits.temperature - TEMPERATURE_MARGIN,
        }
    )


def rehearse_once(scenario: Document[Scenario], bench: Bench, model: Model, limits: Limits) -> None:
    """Rehearse a scenario unless this process did so with the same files.

    A dry run has no chance in it: the same scenario, bench, model, limits and plug-ins end as they did before. On a
    virtual bus, the dry run of an earlier process counts as well. Before a real bus, the dry run also loads the machine
    code that must answer frames in time.
    """
    asked = (scenario.content, bench, model, limits)
    if asked in _passed:
        return
    lasts = bench.bus.interface == VIRTUAL and not has_plugins()  # nobody knows what else a plug-in's code depends on
    if not (lasts and is_remembered(DRY_RUN, asked)):
        rehearse(scenario, bench, model, limits)
        if lasts:
            remember(DRY_RUN, asked)
    _passed.append(asked)


def rehearse(scenario: Document[Scenario], bench: Bench, model: Model, limits: Limits) -> None:
    """Run the scenario on the bench's model and limits.

    InputError names the phase and the limit that it passes.

    When a condition or an answer ends a phase is the world's affair: it is run again with other ends of such phases,
    among them where the model ends them and where they move fastest.
    """
    steps = [_shortened(step) for step in scenario.content.steps]
    ends_early = _rehearse(steps, scenario, bench, model, limits)
    open_ended = [
        index
        for index, step in enumerate(scenario.content.steps)
        if step.phase.until is not None or isinstance(step.phase, PromptPhase)
    ]
    known = tuple(ends_early[index] for index in open_ended)
    whole = [_until(steps[index], None) for index in open_ended]
    fastest = [_cut(steps[index], model) for index in open_ended]
    by_model = [steps[index] if ends_early[index] else cut for index, cut in zip(open_ended, fastest, strict=True)]
    done = [_ended(steps, open_ended, known, by_model, whole)]
    for early, ends in product((by_model, fastest), _ends(len(open_ended))):
        other = _ended(steps, open_ended, ends, early, whole)
        if other not in done:
            _rehearse(other, scenario, bench, model, limits)
            done.append(other)


def _ended(
    steps: Sequence[Step], places: Sequence[int], ends: Sequence[bool], early: Sequence[Step], whole: Sequence[Step]
) -> list[Step]:
    """Return the steps, those at `places` as their early or as their whole variant."""
    chosen = {
        at: cut if ends_early else full for at, ends_early, cut, full in zip(places, ends, early, whole, strict=True)
    }
    return [chosen.get(at, step) for at, step in enumerate(steps)]


def _ends(count: int) -> Iterable[tuple[bool, ...]]:
    """Return which open-ended phases end early, rehearsal by rehearsal.

    They are all ways, or all ways of two neighbours.
    """
    if count <= EVERY_WAY:
        return product((True, False), repeat=count)
    return [tuple((even, odd)[index % 2] for index in range(count)) for even, odd in product((True, False), repeat=2)]


def _rehearse(
    steps: Sequence[Step], scenario: Document[Scenario], bench: Bench, model: Model, limits: Limits
) -> list[bool]:
    """Return which phases their conditions have ended.

    Long rests are lived in full where they matter.
    """
    brief = [_rested(step, model) for step in steps]
    record = _dry_run(brief, bench, model, limits)
    until = len(record.phases)
    if record.reason_id == "temperature_limit" and brief[:until] != list(steps[:until]):  # it may be there to cool down
        record = _dry_run(steps, bench, model, limits)
    if record.outcome is BenchOutcome.OK:
        return [phase.end is PhaseEnd.TRIGGERED for phase in record.phases]
    if record.outcome is BenchOutcome.ABORTED:
        # as without a dry run: nothing has moved yet
        raise KeyboardInterrupt("the time-out has passed" if record.reason_id == "time_out" else "")
    if record.reason_id == PartFault.reason_id:
        raise InputError(record.reason)
    step = steps[max(len(record.phases) - 1, 0)]
    raise InputError(
        Problem(
            f"a dry run on the bench's model stops in this phase: {record.reason}",
            scenario.place(*step.key),
            allowed=f"the bench's limits less a margin: {MARGIN:.0%} of current and velocity, "
            f"{TEMPERATURE_MARGIN:g} K of temperature",
            remedy=f"make the phase gentler, or correct the model or {_limit_of(record.reason_id)} of the bench file",
        )
    )


def _limit_of(reason_id: str) -> str:
    """Return the key of the limit that a run met, or of all for another reason."""
    name = reason_id.removesuffix("_limit")
    return f"'limits.{name}'" if name in SafetyLimits.model_fields else "'limits'"


def _shortened(step: Step) -> Step:
    """Return the step without the time that only the world outside needs.

    The step lasts until the plate rests, or repeats itself.
    """
    phase = step.phase
    if isinstance(phase, PromptPhase):
        rest = f"{min(phase.timeout, REST_S)!r} s"
        phase = OffPhase.model_validate({"id": phase.id, "kind": "off", "measure": phase.measure, "duration": rest})
    elif isinstance(phase, WaitPhase):
        phase = phase.model_copy(update={"timeout": min(phase.timeout, REST_S)})
    elif isinstance(phase, WarmUpPhase):
        phase = phase.model_copy(update={"duration": min(phase.duration, WARM_UP_S)})
    until = phase.until
    return _until(replace(step, phase=phase), until and until.model_copy(update={"otherwise": "go_on"}))


def _ages(model: Model) -> bool:
    """Tell whether a plate that has rested for longer takes more to move."""
    return any(CATALOGUE[entry.id].acts_at(Port.FRICTION_AGE) for entry in model.effects)


def _rested(step: Step, model: Model) -> Step:
    """Return the step without the time at rest after the plate has stopped."""
    key = RESTS.get(type(step.phase))
    if key is None or _ages(model):
        return step
    rest = min(getattr(step.phase, key), REST_S)
    return replace(step, phase=step.phase.model_copy(update={key: rest}))


def _until(step: Step, until: Until | None) -> Step:
    return replace(step, phase=step.phase.model_copy(update={"until": until}))


def _cut(step: Step, model: Model) -> Step:
    """Return the step with an end before its time.

    The end is where the plate moves fastest, or falls fastest after its release.
    """
    throttle = model.values
    if isinstance(step.phase, OffPhase | WaitPhase):
        rest = throttle.limp_home
        end = {"role": "throttle_angle", "inside": (f"{rest - FALL_END!r} rad", f"{rest + FALL_END!r} rad")}
    else:
        fastest = _fastest(step.phase.trajectory(throttle.limp_home, throttle))
        end = {"role": "supply_voltage", "above": "-1e9 V", "for": f"{fastest!r} s"}
    return _until(step, Until.model_validate({**end, "otherwise": "go_on"}))


def _fastest(trajectory: Trajectory) -> float:
    """Return when a trajectory's set-point moves fastest, in s.

    The instant is amid the time at which it does, for the plate lags behind.
    """
    count = min(math.ceil(trajectory.duration / LOOK_S), MOST_LOOKS)
    times = [trajectory.duration * k / count for k in range(1, count)] or [0.5 * trajectory.duration]
    speeds = [abs(trajectory.at(t).velocity) for t in times]
    fast = [t for t, speed in zip(times, speeds, strict=True) if speed >= 0.99 * max(speeds)]
    return fast[len(fast) // 2]


def _dry_run(steps: Sequence[Step], bench: Bench, model: Model, limits: Limits) -> RunRecord:
    """Run on a virtual bus with the project's own controller.

    Limits, rates, requests and law are the bench's.
    """
    setup = load_bench(stock_file("bench", "virtual_fd" if bench.measure.burst else "virtual_classic"))
    bus = setup.bench.bus
    stand_in = setup.bench.model_copy(
        update={"limits": with_margins(bench.limits), "command_rate": bench.command_rate, "measure": bench.measure}
    )
    network = VirtualNetwork(int(bus.bitrate), int(bus.data_bitrate), fd=bus.fd)
    controller = VirtualController(model, setup.dialect, SEED, nominal=model, law=bench.law or "pd")
    network.attach(controller, controller.sends)
    link = VirtualLink(network)
    analysis = Analysis(setup.dialect, model, limits, "dry run", observer=bench.observer)
    tap = Tap(link, CommandEncoder(setup.dialect), analysis, _Nowhere(), _Nowhere(), network.clock)
    return Runner(stand_in, steps, analysis, tap, network.clock, signals=StopSignals()).run()
