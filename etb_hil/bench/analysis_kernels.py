"""Compile what judges a unit, for the cache, by a run without a plant.

A second process does it in a first start.

The stock scenario goes through the analysis of the stock bench. The plate stands where the set-points are, and the
current is what inertia, springs and sliding friction take.
"""

from __future__ import annotations

from itertools import accumulate, pairwise
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.base.stock import stock_file
from etb_hil.bench.bench_file import load_bench
from etb_hil.canio.dbc.writer import SAMPLE_COUNTER, MessageWriter
from etb_hil.canio.frames import FrameBlock, concatenate_frames
from etb_hil.controller.state import TICK_NS
from etb_hil.diagnosis.limits_file import load_limits
from etb_hil.observer.registry import DEFAULT
from etb_hil.plant.parameters import load_model
from etb_hil.scenario.scenario_file import load_scenario
from etb_hil.session.analysis import Analysis
from etb_hil.session.clock_grade import grade_clock

if TYPE_CHECKING:
    from etb_hil.canio.dbc.dialect import Dialect
    from etb_hil.plant.values import ThrottleParameters
    from etb_hil.recording.samples import Float64
    from etb_hil.scenario.trajectory import Trajectory

PERIOD_NS = 1_000_000  # between two samples


def compile_analysis() -> None:
    """Judge the stock scenario as a run does, from the first frame to the verdict."""
    setup = load_bench(stock_file("bench", "virtual_classic"))
    model, limits = load_model(stock_file("model", "default")), load_limits(stock_file("limits", "default"))
    steps = load_scenario(stock_file("scenario", "friction_check")).content.steps
    throttle = model.values
    parts = [_angles(step.phase.trajectory(throttle.limp_home, throttle), throttle) for step in steps]
    frames = _frames(setup.dialect, _columns(np.concatenate(parts), throttle))
    edges = [count * PERIOD_NS for count in accumulate(map(len, parts), initial=0)]
    # The stock observer comes last: the first process, which needs it before the verdict, compiles it meanwhile.
    for observer in ("sliding-mode", DEFAULT):
        analysis = Analysis(setup.dialect, model, limits, "set-points", observer=observer, bus=setup.bench.bus)
        for step, (begin_ns, end_ns) in zip(steps, pairwise(edges), strict=True):
            analysis.begin_phase(begin_ns, step.id, step.phase.kind)
            analysis.push(frames.select((frames.stamp_ns > begin_ns) & (frames.stamp_ns <= end_ns)))
        analysis.finish()
        grade_clock(analysis.recording)


def _angles(trajectory: Trajectory, throttle: ThrottleParameters) -> Float64:
    """Return the plate's angle (n) in rad at the samples of a phase.

    Without the bridge it stands at limp-home.
    """
    points = [trajectory.at(k * PERIOD_NS * 1e-9) for k in range(round(trajectory.duration * 1e9 / PERIOD_NS))]
    angles = [point.position if point.enable else throttle.limp_home for point in points]
    return np.clip(angles, throttle.stop_low, throttle.stop_high)


def _columns(angle: Float64, throttle: ThrottleParameters) -> dict[str, Float64]:
    """Return what the controller reports of a motion (n), by role."""
    velocity = np.gradient(angle, PERIOD_NS * 1e-9)
    deflection = angle - throttle.limp_home
    opens = throttle.preload_open + throttle.slope_open * deflection
    closes = -throttle.preload_close + throttle.slope_close * deflection
    spring = np.where(deflection > 0.0, opens, closes) * (deflection != 0.0)
    friction = throttle.coulomb * np.sign(velocity) + throttle.viscous * velocity
    torque = throttle.inertia * np.gradient(velocity, PERIOD_NS * 1e-9) + spring + friction
    current = torque / throttle.torque_per_ampere
    return {
        "motor_current": current,
        "motor_voltage": throttle.resistance * current + throttle.back_emf * velocity,
        "motor_angle": angle * throttle.gear_ratio,
        "throttle_angle": angle,
        "throttle_angle_2": angle,
        "temperature": np.full(len(angle), 25.0),
        "command_position": angle,
        SAMPLE_COUNTER: np.arange(len(angle)) * (PERIOD_NS // TICK_NS),
    }


def _frames(dialect: Dialect, columns: dict[str, Float64]) -> FrameBlock:
    """Return the frames that carry some roles, in the order of their stamps.

    There is one a message and sample.
    """
    stamp_ns = np.arange(1, len(columns[SAMPLE_COUNTER]) + 1) * PERIOD_NS
    blocks = []
    for message in dialect.messages:
        writer = MessageWriter(dialect, message.name)
        carried = {role: columns[role] for role in writer.roles if role in columns}
        if carried:
            blocks.append(writer.write(carried, stamp_ns))
    written = concatenate_frames(blocks)
    return written.select(np.argsort(written.stamp_ns, kind="stable"))


if __name__ == "__main__":
    compile_analysis()
