"""Draws the README's picture: python docs/images/draw_readme.py."""

import tempfile
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.report.chart import CLOSING, LIMIT, MEASURED, MUTED
from etb_hil.report.drawing import STYLE, save_png


@mpl.rc_context(STYLE)
def main():
    figure = Figure(figsize=(9.0, 3.4), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, unit, colour in ((panels[0], "default", MEASURED), (panels[1], "faulty", CLOSING)):
        names = {"scenario": "friction_check", "bench": "virtual_fd", "model": "default", "limits": "default"}
        files = JobFiles(**{kind: find(kind, name) for kind, name in names.items()}, unit=find("model", unit))
        with tempfile.TemporaryDirectory() as folder:
            finished = execute(prepare(files), Path(folder), "", 1)
        series, number = finished.series, finished.found.measurements.get("T_st")
        axes.plot(series["point_velocity"], series["point_friction"], ".", color=MUTED, markersize=2, alpha=0.5)
        for side in (series["curve_velocity"] < 0, series["curve_velocity"] > 0):
            axes.plot(series["curve_velocity"][side], series["curve_friction"][side], color=colour, linewidth=2)
        for sign in (-1, 1):
            axes.axhline(sign * number.limit_high, color=LIMIT, linestyle="--")
        verdict = finished.results.unit.verdict
        axes.set_title(f"{verdict.upper()}: T_st = {number.value:.3f} N·m, limit {number.limit_high:.2f} N·m")
        axes.set_xlabel("throttle speed / rad/s")
    panels[0].set_ylabel("friction torque / N·m")
    save_png(figure, Path(__file__).parent / "friction_over_speed.png")


if __name__ == "__main__":
    main()
