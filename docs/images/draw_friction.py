"""Draws the pictures of docs/explanation/friction.md: python docs/images/draw_friction.py."""

import math
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from etb_hil.base.stock import find
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.friction_map import find_bumps, friction_map
from etb_hil.diagnosis.limits_file import load_limits
from etb_hil.report.chart import CLOSING, INK, LIMIT, MEASURED, MUTED, OPENING
from etb_hil.report.drawing import STYLE, save_png

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from independent_throttle import Unit, friction_check, sense
from observer_table import REFERENCE, SENSORS, observers, reference_runs
from throttle_as_model import bench_model, parameters, rows_of

IMAGES = Path(__file__).parent / "friction"
TEMPERATURES = (0.0, 20.0, 40.0, 60.0, 80.0)
LAW = -0.003  # of the friction, per K
REVERSAL = (3.05, 3.15)  # s
BUMP, WIDTH = 0.9, 0.05  # rad


def checks():
    """Return results of friction checks of one throttle with a local bump, by temperature."""
    limits = load_limits(find("limits", "default"))
    unit = Unit(bump=0.25, bump_angle=BUMP, bump_width=WIDTH)
    found = {}
    for temperature in TEMPERATURES:
        factor = 1.0 + LAW * (temperature - 20.0)
        warm = replace(unit, coulomb=factor * unit.coulomb, stiction=factor * unit.stiction)
        truth, phases = friction_check(warm)
        diagnosis = Diagnosis(bench_model(unit), limits)
        sensed = sense(warm, truth, 20000, np.random.default_rng(5))
        for rows, kind in rows_of(sensed, phases, 20000, temperature=temperature):
            diagnosis.push(rows, kind)
        found[temperature] = diagnosis.finish()
    return unit, found


def slides(result):
    """Return which windows slid steadily: in others friction is on its way from one sign to the other."""
    series = result.series
    velocity, way = series["point_velocity"], np.sign(series["point_velocity"])
    curve = np.empty(len(velocity))
    for side in (-1.0, 1.0):  # each has its own curve: across zero it jumps
        drawn, here = side * series["curve_velocity"] > 0.0, side * velocity > 0.0
        curve[here] = np.interp(velocity[here], series["curve_velocity"][drawn], series["curve_friction"][drawn])
    return way * series["point_friction"] > 0.97 * way * curve


def over_speed(result):
    figure = Figure(figsize=(6.0, 4.2), layout="constrained")
    axes, series, steady = figure.subplots(), result.series, slides(result)
    bump = steady & (np.abs(series["point_angle"] - BUMP) < 2.0 * WIDTH)
    for part, colour, name in (
        (~steady, CLOSING, "turning round or breaking away"),
        (steady & ~bump, MUTED, "sliding"),
        (bump, LIMIT, f"sliding over the bump at {BUMP} rad"),
    ):
        axes.plot(
            series["point_velocity"][part], series["point_friction"][part], ".", color=colour, markersize=2, label=name
        )
    for side in (series["curve_velocity"] < 0, series["curve_velocity"] > 0):
        speed, label = series["curve_velocity"][side], "fitted curve, 95 % band" if side[-1] else None
        axes.fill_between(speed, series["curve_low"][side], series["curve_high"][side], color=MEASURED, alpha=0.3)
        axes.plot(speed, series["curve_friction"][side], color=MEASURED, label=label)
    axes.set(title="Friction over speed, 20 °C", xlabel="throttle speed / rad/s", ylabel="friction torque / N·m")
    axes.legend(loc="lower right", markerscale=4.0, fontsize="small")
    return figure


def over_angle(result):
    figure = Figure(figsize=(6.0, 4.2), layout="constrained")
    axes, series = figure.subplots(), result.series
    for way, sign, colour, marker in (("opening", 1.0, OPENING, "."), ("closing", -1.0, CLOSING, "x")):
        angle, friction = series[f"{way}_angle"], series[f"{way}_friction"]
        turns = sign * friction < 0.97 * np.median(sign * friction)
        label = "turning round" if sign > 0.0 else None
        axes.plot(angle[turns], friction[turns], ".", color=MUTED, markersize=1.5, alpha=0.5, label=label)
        axes.plot(angle[~turns], friction[~turns], marker, color=colour, markersize=3, linestyle="", label=way)
    axes.axvspan(BUMP - WIDTH, BUMP + WIDTH, color=LIMIT, alpha=0.12, linewidth=0, label="local bump of 25 %")
    axes.set(title="Friction over angle, 20 °C", xlabel="throttle angle / rad")
    axes.set_ylabel("friction torque / N·m")
    axes.legend(loc="center", bbox_to_anchor=(0.52, 0.5), markerscale=2.0)
    return figure


def over_temperature(unit, found):
    figure = Figure(figsize=(6.0, 4.2), layout="constrained")
    axes = figure.subplots()
    span = np.linspace(-5.0, 85.0, 2)
    for name, true, colour in (("T_st", unit.stiction, CLOSING), ("T_c", unit.coulomb, MEASURED)):
        numbers = [result.measurements.get(name) for result in found.values()]
        value = np.array([number.value for number in numbers])
        spread = [value - [n.low for n in numbers], [n.high for n in numbers] - value]
        axes.errorbar(TEMPERATURES, value, yerr=spread, fmt="o", color=colour, capsize=3, label=f"{name}, 95 %")
        axes.plot(span, true * (1.0 + LAW * (span - 20.0)), ":", color=colour, label=f"{name}, true away from the bump")
    axes.set(title="Friction over temperature", xlabel="temperature / °C", ylabel="friction torque / N·m")
    axes.legend()
    return figure


def map_of(found):
    figure = Figure(figsize=(7.0, 3.6), layout="constrained")
    axes = figure.subplots()
    over = friction_map([result.series for result in found.values()])
    shown = axes.pcolormesh(over.angle, over.temperature, 100.0 * (over.factor - 1.0), cmap="PuOr_r", vmin=-25, vmax=25)
    for bump in find_bumps(over):
        axes.axvspan(bump.start, bump.end, fill=False, edgecolor=INK, linewidth=0.8)
    figure.colorbar(shown, ax=axes, label="above the fitted curve / %")
    axes.set(title="Friction over angle and temperature; frames: bumps found")
    axes.set(xlabel="throttle angle / rad", ylabel="temperature / °C")
    axes.grid(visible=False)
    return figure


def around_a_reversal():
    figure = Figure(figsize=(8.0, 5.4), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[2.4, 1.0])
    truth = reference_runs(REFERENCE)["fast"]
    measure, sensor = SENSORS["12 bits"]
    angle = measure(truth.angle, np.random.default_rng(3))
    throttle = replace(parameters(REFERENCE), stiction=0.171, bristle_stiffness=150.0)
    shown = (truth.time >= REVERSAL[0]) & (truth.time <= REVERSAL[1])
    time, time_ns = truth.time[shown], np.round(truth.time * 1e9).astype(np.int64)
    above.plot(time, truth.friction[shown], color=MUTED, linewidth=3.0, label="true")
    for name, colour, line in (
        ("paper (first order)", LIMIT, ":"),
        ("angle", CLOSING, "-."),
        ("adaptive (default)", MEASURED, "-"),
    ):
        found = observers(throttle, sensor)[name].push(time_ns, truth.current, angle)
        above.plot(time, found.friction[shown], line, color=colour, label=name)
        below.plot(time, found.velocity[shown], line, color=colour, label="velocity")
    below.plot(time, truth.velocity[shown], color=MUTED, linewidth=3.0, alpha=0.6, zorder=0)
    below.axhline(0.0, color=MUTED, linewidth=0.8)
    below.set(xlabel="time / s", ylabel="velocity / rad/s", ylim=(-6.0, 6.0))
    above.set(title=f"A reversal at 20 kHz, angle of 12 bits ({math.degrees(math.radians(90) / 4096):.3f}° steps)")
    above.set(ylabel="friction torque / N·m")
    above.legend(loc="best")
    return figure


@mpl.rc_context(STYLE)
def main():
    IMAGES.mkdir(parents=True, exist_ok=True)
    unit, found = checks()
    pictures = {
        "over_speed": over_speed(found[20.0]),
        "over_angle": over_angle(found[20.0]),
        "over_temperature": over_temperature(unit, found),
        "map": map_of(found),
        "reversal": around_a_reversal(),
    }
    for name, figure in pictures.items():
        save_png(figure, IMAGES / f"{name}.png")


if __name__ == "__main__":
    main()
