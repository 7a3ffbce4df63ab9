"""Run a scenario on a model without a bus.

The controller's own machine takes commands and gives samples.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from etb_hil.base.errors import InputError, PartFault, Problem
from etb_hil.bench.supply_guard import SupplyGuard
from etb_hil.controller.machine import Machine, Output
from etb_hil.controller.state import COMMAND, EVENT_WIDTH, REQUEST, TICK_NS
from etb_hil.plant.parameters import Model
from etb_hil.recording.samples import Float64, Int64, SampleBlock, concatenate
from etb_hil.scenario.condition import Condition
from etb_hil.scenario.condition_watch import ConditionWatch
from etb_hil.scenario.kinds.prompt import PromptPhase
from etb_hil.scenario.scenario_file import Step
from etb_hil.scenario.trajectory import OFF, SetPoint, Trajectory

BOTH = 3.0  # current and encoder
COMMAND_RATE = 100.0  # set-points a second, as the stock benches send
LONGEST_S = 3600.0  # six times what the stock benches allow
MOST_ROWS = 20_000_000  # what a table and a memory hold


class Simulation:
    """One scenario on one unit.

    Prompts are passed over, conditions end phases as they do on a bench.
    """

    def __init__(
        self,
        unit: Model,
        nominal: Model,
        *,
        law: str,
        seed: int,
        rate: float,
        command_rate: float = COMMAND_RATE,
        supply: Condition | None = None,
    ) -> None:
        """Take the unit, and what controller and trajectories take it for (`nominal`).

        `rate` is that of the samples in Hz.

        `supply` is the condition under which the supply ends the run.
        """
        self._longest_s = min(LONGEST_S, MOST_ROWS / rate)
        self._machine = Machine(unit, nominal, seed, law=law)
        self._throttle = nominal.values
        self._tick_ns = round(1e9 / command_rate)
        self._now_ns = 0
        self._angle = self._machine.plate_angle
        self._commanded = OFF
        self._supply = None if supply is None else SupplyGuard(supply)
        self._asked: list[float] | None = [REQUEST, BOTH, rate, 0.0, 0.0, 0.0]
        self._blocks: list[SampleBlock] = []
        self._temperatures: list[Float64] = []  # degC of the housing, for each block of samples

    def run(self, steps: Sequence[Step]) -> tuple[Int64, dict[str, Float64]]:
        """Run the steps; return the samples' times (n) in ns and columns (n) by role.

        InputError where a phase waits for what never comes, the supply ends the run, it is too long for a table, or a
        law or an effect fails.
        """
        certain = (step.phase for step in steps if step.phase.until is None and not isinstance(step.phase, PromptPhase))
        total = 0.0
        for phase in certain:
            total += phase.trajectory(self._throttle.limp_home, self._throttle).duration
            self._refuse_longer(total)
        for step in steps:
            if not isinstance(step.phase, PromptPhase):
                self._run_step(step)
        if not self._blocks:
            raise InputError(Problem("the scenario has nothing to simulate", remedy="give one with a phase of motion"))
        whole = concatenate(self._blocks)
        return whole.time_ns, {**whole.columns, "temperature": np.concatenate(self._temperatures)}

    def _refuse_longer(self, seconds: float) -> None:
        if seconds > self._longest_s:
            allowed = f"up to {self._longest_s:g} s at this rate of samples"
            raise InputError(Problem("the simulation takes too long", allowed=allowed, remedy="shorten the scenario"))

    def _run_step(self, step: Step) -> None:
        start = self._commanded.position if self._commanded.enable else self._angle
        trajectory, until = step.phase.trajectory(start, self._throttle), step.phase.until
        watch = None if until is None else ConditionWatch(until, self._now_ns)
        for blocks in self._lived(trajectory):
            self._guard_supply(step, blocks)
            if watch is not None and watch.push(blocks) is not None:
                return
        if until is not None and until.otherwise == "stop":
            raise InputError(Problem(f"in '{step.id}' it never comes to this: {until}", remedy="change the condition"))

    def _guard_supply(self, step: Step, blocks: list[SampleBlock]) -> None:
        """Hold the supply against its window while the bridge is on, as a bench does."""
        if self._supply is None:
            return
        self._supply.push(blocks)
        if self._commanded.enable and self._supply.outside is not None:
            stopped = f"a bench would stop in '{step.id}': {self._supply}"
            raise InputError(Problem(stopped, remedy="change the scenario's window, or the unit"))

    def _lived(self, trajectory: Trajectory) -> Iterator[list[SampleBlock]]:
        start_ns, duration_ns = self._now_ns, round(trajectory.duration * 1e9)
        while (since_ns := self._now_ns - start_ns) < duration_ns:
            yield self._beat(trajectory.at(since_ns * 1e-9))

    def _beat(self, point: SetPoint) -> list[SampleBlock]:
        command = [COMMAND, float(point.mode), float(point.enable), point.position, point.velocity, point.voltage]
        events = [command] if self._asked is None else [self._asked, command]
        self._asked, self._commanded = None, point
        stamps = np.full(len(events), self._now_ns, np.int64)
        self._now_ns += self._tick_ns
        self._refuse_longer(self._now_ns * 1e-9)
        try:
            _, outputs = self._machine.run(self._now_ns, stamps, np.array(events, float).reshape(-1, EVENT_WIDTH))
            self._machine.check()
        except PartFault as fault:  # without a bench, a part that fails is wrong input
            raise InputError(str(fault)) from None
        blocks: list[SampleBlock] = []
        for output in outputs:
            if len(output.samples):
                self._blocks.append(_samples(output, point))
                self._temperatures.append(np.full(len(output.samples), self._machine.temperature))
                blocks.append(self._blocks[-1])
                self._angle = float(output.samples["track"][-1])
            if len(output.statuses):
                blocks.append(_statuses(output))
        return blocks


def _samples(output: Output, point: SetPoint) -> SampleBlock:
    samples = output.samples
    columns = {
        "motor_voltage": samples["voltage"].copy(),
        "motor_current": samples["current"][:, 0].copy(),
        "motor_angle": samples["motor_angle"][:, 0].copy(),
        "throttle_angle": samples["track"].copy(),
        "throttle_angle_2": samples["track_2"].copy(),
        "command_position": np.full(len(samples), point.position if point.enable else np.nan),
        "command_enable": np.full(len(samples), float(point.enable)),
    }
    return _block("samples", samples["tick"], columns)


def _statuses(output: Output) -> SampleBlock:
    statuses = output.statuses
    columns = {"temperature": "temperature", "supply_voltage": "supply", "mode": "mode", "enable": "enable"}
    taken = {role: statuses[name].astype(float) for role, name in (columns | {"faults": "faults"}).items()}
    return _block("status", statuses["tick"], taken)


def _block(source: str, tick: Int64, columns: dict[str, Float64]) -> SampleBlock:
    time_ns = tick.astype(np.int64) * TICK_NS
    return SampleBlock(source, time_ns, time_ns, columns, np.zeros(len(time_ns), np.int64))
