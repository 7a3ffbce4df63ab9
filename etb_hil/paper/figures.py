"""The seed paper's figures, drawn from runs, and two that it only mentions."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, MaxNLocator, NullFormatter

from etb_hil.observer.estimate import FrictionEstimate
from etb_hil.paper.estimation import CUTOFF, Numbers
from etb_hil.paper.properties import SlowEnough, bristles_along
from etb_hil.paper.setups import Motion, friction_torque, stribeck_friction
from etb_hil.paper.trade import Trade
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.plant.physics import spring_torque
from etb_hil.recording.samples import Float64
from etb_hil.report.chart import CLOSING, INK, LIMIT, MEASURED, MUTED, OPENING
from etb_hil.report.drawing import STYLE, legend_below

_SHADES = (MEASURED, OPENING, CLOSING, LIMIT)
_LINES = ("-", "--", "-.", ":")
_BEFORE_S, _AFTER_S = -0.03, 0.03  # what is enlarged about a peak
_HIGHEST = 0.99  # share of the highest friction that counts as a peak


@mpl.rc_context(STYLE)
def friction_under_one_input(motions: Sequence[tuple[str, Motion]], volts_per_second: float) -> Figure:
    """Draw figure 2: friction of two settings of T_st and T_c under one control input."""
    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    over_time, over_speed = figure.subplots(1, 2, sharey=True)
    for (name, motion), colour, line in zip(motions, (MEASURED, CLOSING), _LINES, strict=False):
        free = motion.angle < motion.throttle.stop_high - 0.01
        last = len(free) if free.all() else int(np.argmin(free))
        time, velocity, friction = motion.time[:last], motion.velocity[:last], motion.friction[:last]
        over_time.plot(time, friction, line, color=colour, label=name)
        over_speed.plot(velocity, friction, line, color=colour)
        for axes in (over_time, over_speed):
            for level, of, name_of, side in (
                (motion.throttle.stiction, colour, "T_st", "bottom"),
                (motion.throttle.coulomb, INK, "T_c", "top"),
            ):
                axes.axhline(level, color=of, linewidth=0.8, linestyle=":")
                place = axes.get_yaxis_transform()
                axes.text(0.99, level, name_of, transform=place, color=of, ha="right", va=side, fontsize="small")
    over_time.set(
        title=f"Fig. 2: friction, voltage rising by {volts_per_second:.0f} V/s",
        xlabel="time / s",
        ylabel="friction torque / N·m",
    )
    over_speed.set(title="the same over speed", xlabel="throttle speed / rad/s")
    legend_below(figure, 2)
    return figure


@mpl.rc_context(STYLE)
def spring_over_angle(throttle: ThrottleParameters) -> Figure:
    """Draw figure 3: the two springs' torque, with the jump at limp-home enlarged."""
    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    whole, near = figure.subplots(1, 2, sharey=True)
    p, home, half = throttle.vector(), throttle.limp_home, throttle.dead_zone
    for axes, angle in (
        (whole, np.linspace(throttle.stop_low, throttle.stop_high, 4001)),
        (near, np.linspace(home - 4.0 * half, home + 4.0 * half, 801)),
    ):
        ideal = np.where(
            angle > home,
            throttle.preload_open + throttle.slope_open * (angle - home),
            throttle.slope_close * (angle - home) - throttle.preload_close,
        )
        axes.plot(angle, ideal, ":", color=INK, label="ideal jump")
        axes.plot(angle, [spring_torque(a, p) for a in angle.tolist()], color=MEASURED, label="as simulated")
        axes.axvspan(home - half, home + half, color=MUTED, alpha=0.15, linewidth=0, label="dead zone")
        axes.set(xlabel="throttle angle / rad")
    whole.set(title="Fig. 3: springs", ylabel="spring torque / N·m")
    near.set(title=f"limp-home, smoothed over ±{half * 1e3:.0f} mrad")
    figure.legend(*near.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


@mpl.rc_context(STYLE)
def estimated_friction(
    title: str, motion: Motion, found: FrictionEstimate, numbers: Numbers, span: tuple[float, float]
) -> Figure:
    """Draw one of figures 4 to 7 over `span` in s.

    The figure shows friction torque, estimate and motion, with the peak enlarged.
    """
    figure = Figure(figsize=(9.0, 5.2), layout="constrained")
    grid = figure.subplots(2, 2, sharex="col", sharey="row", height_ratios=[2.2, 1.0], width_ratios=[2.6, 1.0])
    throttle, inside = motion.throttle, (motion.time >= span[0]) & (motion.time <= span[1])
    friction = np.abs(motion.friction[inside])
    peak = float(motion.time[inside][np.argmax(friction >= _HIGHEST * friction.max())])  # not where it rests there
    for (above, below), (begin, end) in zip(grid.T, (span, (peak + _BEFORE_S, peak + _AFTER_S)), strict=True):
        shown = (motion.time >= begin) & (motion.time <= end)
        time = motion.time[shown]
        above.plot(time, motion.friction[shown], color=MUTED, linewidth=2.2, label="true friction")
        above.plot(time, found.friction[shown], color=MEASURED, label=f"estimate, {CUTOFF:.0f} Hz")
        for sign in (-1.0, 1.0):
            above.axhline(sign * throttle.stiction, color=LIMIT, linestyle="--", label="T_st" if sign > 0.0 else None)
            above.axhline(sign * throttle.coulomb, color=OPENING, linestyle=":", label="T_c" if sign > 0.0 else None)
        below.plot(time, motion.reference[shown], ":", color=INK, label="reference")
        below.plot(time, motion.angle[shown], color=CLOSING, label="angle")
        below.set_xlabel("time / s")
    reach = 1.1 * max(throttle.stiction, float(friction.max()))
    grid[0, 0].set(title=title, ylabel="friction torque / N·m", ylim=(-reach, reach))
    grid[1, 0].set(ylabel="angle / rad")
    grid[1, 1].xaxis.set_major_locator(MaxNLocator(3))
    short = f"T_st read as {numbers.stiction:.3f} of {numbers.true_stiction:.3f} N·m"
    grid[0, 0].text(0.995, 1.02, short, transform=grid[0, 0].transAxes, ha="right", va="bottom", color=INK)
    grid[0, 1].set(title="highest, enlarged")
    handles = [artist for row in grid[:, 0] for artist in row.get_legend_handles_labels()[0]]
    figure.legend(handles=handles, loc="outside lower center", ncols=6)
    return figure


@mpl.rc_context(STYLE)
def trade_of_filter(title: str, trade: Trade) -> Figure:
    """Draw T_st as read, and the chatter, over the cut-off for several M."""
    figure = Figure(figsize=(9.0, 4.4), layout="constrained")
    peak, ripple = figure.subplots(1, 2)
    for row, (colour, line) in enumerate(zip(_SHADES, _LINES, strict=True)):
        name = f"M = {trade.switching[row]:.2f} N·m"
        peak.plot(
            trade.cutoffs, 100.0 * (1.0 - trade.read[row]), line, marker="o", color=colour, markersize=3, label=name
        )
        ripple.plot(trade.cutoffs, 100.0 * trade.error[row], line, marker="o", color=colour, markersize=3)
    peak.plot(trade.cutoffs, 100.0 * (1.0 - trade.filtered[0]), color=INK, linewidth=0.9, label="filter alone")
    peak.axhline(100.0 * (1.0 - trade.reached), color=MUTED, linewidth=0.9, linestyle="--", label="not reached at all")
    peak.axhline(0.0, color=MUTED, linewidth=0.8)
    ripple.set_yscale("log")
    _plain(ripple.yaxis, (10.0, 20.0, 50.0, 100.0, 200.0))
    for axes in (peak, ripple):
        axes.set_xscale("log")
        _plain(axes.xaxis, (15.0, 60.0, 250.0, 1000.0))
        axes.axvline(CUTOFF, color=MUTED, linewidth=0.8, linestyle=":")
        axes.set_xlabel("cut-off / Hz")
    peak.set(title=title, ylabel="T_st underestimated by / %", ylim=(-60.0, 45.0))
    ripple.set(title="RMS error, lag and ripple", ylabel="% of T_c")
    legend_below(figure, 3)
    return figure


@mpl.rc_context(STYLE)
def passages(throttle: ThrottleParameters, accelerations: Sequence[float], limits: Sequence[SlowEnough]) -> Figure:
    """Draw property 3: friction on velocity ramps through zero.

    The figure shows which accelerations are slow enough.
    """
    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    along, bound = figure.subplots(1, 2)
    omega_s = throttle.stribeck_velocity
    velocity = np.linspace(-0.3, 3.0, 20_001) * omega_s
    start = throttle.stiction / throttle.bristle_stiffness
    for acceleration, colour, line in zip(accelerations, _SHADES, _LINES, strict=False):
        step = float(velocity[1] - velocity[0]) / acceleration
        bristle = bristles_along(velocity, step, start, throttle)
        friction = friction_torque(velocity, bristle, throttle)
        along.plot(velocity, friction, line, color=colour, label=f"{acceleration:.0f} rad/s²")
    steady = stribeck_friction(velocity, throttle) + throttle.viscous * np.abs(velocity)
    along.plot(velocity, np.sign(velocity) * steady, ":", color=INK, linewidth=0.9, label="steady sliding")
    along.set(title="Property 3, faulty unit", xlabel="throttle speed / rad/s", ylabel="friction torque / N·m")
    speeds: Float64 = np.array([limit.stribeck_velocity for limit in limits])
    slowest: Float64 = np.array([limit.acceleration for limit in limits])
    bound.loglog(speeds, slowest, "o-", color=MEASURED)
    _plain(bound.xaxis, speeds.round(1).tolist())
    _plain(bound.yaxis, (1.0, 3.0, 10.0, 30.0, 100.0))
    bound.set(title="f(omega_s): slow enough", xlabel="omega_s / rad/s", ylabel="acceleration / rad/s²")
    legend_below(figure, 5)
    return figure


def _plain(axis: Axis, ticks: Sequence[float]) -> None:
    """Label a logarithmic axis with plain numbers."""
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_major_formatter(lambda value, _: f"{value:g}")
    axis.set_minor_formatter(NullFormatter())
