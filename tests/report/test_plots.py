"""The plots say what they show, keep peaks and gaps, and stand missing data and odd names."""

import os
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sample_run
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.colors import to_hex
from matplotlib.image import imread

from etb_hil.base.errors import InputError
from etb_hil.diagnosis.windows import NARROW
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import SampleBlock
from etb_hil.recording.tables import read_table
from etb_hil.report import condition_plots, plots, ticks
from etb_hil.report.chart import LIMIT, Chart, Panel
from etb_hil.report.drawing import figure_of
from etb_hil.report.recording_plot import chart_of, plot_recording
from etb_hil.report.reduction import broken_at_gaps, envelope
from etb_hil.report.series import ReportSeries
from etb_hil.report.svg import svg_of
from etb_hil.results.measurement import Measurement, Measurements
from etb_hil.results.run_result import Phase

CHECKOUT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("ETB_HIL_REAL_DATA", CHECKOUT.parent / "shared" / "data"))
ALL = [plots.friction_over_speed, plots.friction_over_angle, plots.time_traces]


@pytest.mark.parametrize("draw", ALL)
def test_units_stand_on_every_axis(draw):
    figure = figure_of(draw(sample_run.series(), sample_run.results()))
    drawn = [axes for axes in figure.axes if axes.lines and axes.get_ylabel()]
    assert all(re.search(r" / (deg|deg/s|A|N·m|°C)$", axes.get_ylabel()) for axes in drawn)
    assert re.search(r" / (s|deg|deg/s)$", figure.axes[-1].get_xlabel())


@pytest.mark.parametrize("draw", ALL)
def test_a_run_without_data_gives_a_plot_that_says_so(draw):
    chart = draw(ReportSeries(), sample_run.results(measurements=Measurements(), phases=()))
    figure = figure_of(chart)
    texts = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert any("in this run" in text for text in texts)
    assert "in this run</text>" in svg_of(chart, "empty")


@pytest.mark.parametrize("draw", ALL)
def test_svg_is_well_formed_with_ids_of_its_own_and_no_address(draw):
    svg = svg_of(draw(sample_run.series(0.567), sample_run.results(0.567)), "one")
    root = ET.fromstring(svg)  # noqa: S314 (our own)
    ids = [element.get("id") for element in root.iter() if element.get("id")]
    assert all(i.startswith("one-") for i in ids)
    links = [value for e in root.iter() for name, value in e.attrib.items() if name.endswith("href")]
    assert set(links) <= {f"#{i}" for i in ids}
    assert LIMIT not in svg.replace(f", {LIMIT})", "")  # every colour follows the page's light and dark


@pytest.mark.parametrize("factor", [1.05, 1.3969849246231156, 1.6502512562814071, 3.0])
def test_the_deepest_colour_of_a_map_is_no_more_than_whole(factor):
    """Matplotlib refuses a hair more than one, which rounding may make of a cell that is the deepest."""
    points = sample_run.series()
    excess = np.where(np.abs(points.point_angle - 1.0) < 0.2, factor - 1.0, 0.0)
    over = plots.friction_over_angle(replace(points, point_excess=excess), sample_run.results())
    depths = [patch.get_alpha() for patch in figure_of(over).axes[1].patches]
    assert 0.5 < max(depths) <= 1.0


def test_same_input_gives_the_same_svg():
    first, second = (svg_of(plots.time_traces(sample_run.series(), sample_run.results()), "t") for _ in range(2))
    assert first == second


def test_limits_are_drawn_where_they_are_compared():
    (axes,) = figure_of(plots.friction_over_speed(sample_run.series(), sample_run.results())).axes
    omega_s = np.degrees(sample_run.OMEGA_S)
    stiction, coulomb = [
        line.get_xydata() for line in axes.lines if str(line.get_label()).startswith(("limit T_st", "limit T_c"))
    ]
    assert np.allclose(stiction, [[-omega_s, 0.25], [omega_s, 0.25]])
    assert coulomb[0, 0] == pytest.approx(2.15 * omega_s)
    assert coulomb[0, 1] == pytest.approx(0.18 + sample_run.VISCOUS * 2.15 * sample_run.OMEGA_S)


def test_where_viscosity_is_bounded_the_limit_of_sliding_friction_has_the_bound():
    numbers = sample_run.results().measurements
    bound = replace(numbers["viscous"], value=None, low=0.0, high=0.002)
    bounded = sample_run.results(measurements=Measurements({**numbers, "viscous": bound}.values()))
    (axes,) = figure_of(plots.friction_over_speed(sample_run.series(), bounded)).axes
    (coulomb,) = [line.get_ydata() for line in axes.lines if str(line.get_label()).startswith("limit T_c")]
    assert coulomb[0] == pytest.approx(0.18 + 0.002 * 2.15 * sample_run.OMEGA_S)


def test_exceedances_are_shaded_in_every_trace_and_marked_at_their_peak():
    figure = figure_of(plots.time_traces(sample_run.series(0.567), sample_run.results(0.567)))
    for axes in figure.axes[1:]:
        assert sum(to_hex(patch.get_facecolor()) == LIMIT for patch in axes.patches) == 2
    marks = [line.get_ydata()[0] for line in figure.axes[-1].lines if line.get_marker() == "v"]
    assert marks == pytest.approx([0.567, -0.97 * 0.567])


def test_the_map_shows_where_and_at_which_temperature_friction_is_off():
    figure = figure_of(plots.friction_over_angle(sample_run.series(), sample_run.results()))
    over = figure.axes[1]
    cells = [patch for patch in over.patches if patch.get_width() == pytest.approx(2.0, abs=0.01)]
    deep = [cell for cell in cells if cell.get_alpha() > 0.5]
    assert {to_hex(cell.get_facecolor()) for cell in deep} == {LIMIT}  # above the curve
    assert all(0.85 < np.radians(cell.get_x() + 1.0) < 1.15 for cell in deep)  # 0.4 above it, at 1.0 rad and 23 degC
    assert {cell.get_y() for cell in deep} == {20.0}
    assert {cell.get_y() for cell in cells} == {20.0, 30.0}
    (bump,) = [line for line in over.lines if line.get_marker() == "v" and len(line.get_xdata())]
    assert all(0.85 < angle < 1.15 for angle in np.radians(bump.get_xdata()))


@pytest.mark.parametrize(("overlap", "has_bump"), [(NARROW.overlap, True), (1e4, False)])
def test_the_map_weighs_the_overlap_of_windows(overlap, has_bump):
    points = sample_run.series()
    overlapping = replace(points, point_overlap=np.full(len(points.point_angle), overlap))
    over = figure_of(plots.friction_over_angle(overlapping, sample_run.results())).axes[1]
    assert any(line.get_marker() == "v" and len(line.get_xdata()) for line in over.lines) == has_bump


def test_a_plot_in_the_page_knows_its_scales():
    svg = svg_of(plots.time_traces(sample_run.series(), sample_run.results()), "t")
    scales = re.findall(r'data-box="([^"]*)" data-x="([^"]*)" data-y="([^"]*)" data-xlabel="([^"]*)"', svg)
    assert [len(scale[0].split()) for scale in scales] == [4] * 5
    assert {tuple(map(float, scale[1].split())) for scale in scales} == {(0.0, 24.0)}
    assert scales[-1][3] == "time / s"


def test_many_marks_are_one_path():
    svg = svg_of(plots.friction_over_speed(sample_run.series(), sample_run.results()), "t")
    dots = max(re.findall(r'd="((?:M[^M"]*h0)+)"', svg), key=len)
    assert dots.count("h0") == 600


def test_names_are_no_formulas():
    name = "ramp $\\frac{$ <b>&amp;"
    results = sample_run.results(phases=(Phase(name, "", 0.0, 24.0),))
    svg = svg_of(plots.time_traces(sample_run.series(), results), "t")
    assert "1 ramp $\\frac{$ &lt;b&gt;&amp;amp;" in svg


@given(st.lists(st.one_of(st.floats(-1e3, 1e3), st.just(float("nan"))), max_size=300), st.integers(1, 40))
def test_envelope_keeps_order_and_extremes(values, columns):
    values = np.array(values, float)
    time, kept = envelope(np.arange(len(values), dtype=float), values, columns)
    assert np.all(np.diff(time) > 0)
    assert len(time) <= max(2 * columns, 1)
    assert np.array_equal(kept, values[time.astype(int)], equal_nan=True)
    if np.any(np.isfinite(values)):
        assert np.nanmin(kept) == np.nanmin(values)
        assert np.nanmax(kept) == np.nanmax(values)


def test_no_line_over_a_gap():
    time = np.array([0.0, 0.1, 0.2, 0.3, 5.0, 5.1])
    gone, values = broken_at_gaps(time, np.ones(6))
    assert np.flatnonzero(np.isnan(values)).tolist() == [4]
    assert len(gone) == 7


def recording(**columns):
    count = len(next(iter(columns.values())))
    stamps = np.arange(count) * 1_000_000
    lost = np.zeros(count, np.int64)
    lost[count // 2] = 3
    grown = Recording("a log with $ and <b> in its name" * 5, ClockGrade.RECEIVE_STAMPS)
    grown.append([SampleBlock("m", stamps, stamps, {k: np.asarray(v, float) for k, v in columns.items()}, lost)])
    return grown


def test_any_recording_becomes_a_picture(tmp_path):
    wave = np.sin(np.arange(4000) * 0.01)
    rec = recording(throttle_angle=wave, motor_duty=wave, throttle_position=np.full(4000, np.nan))
    plot_recording(rec, ["throttle_angle", "motor_duty", "throttle_position"], tmp_path / "all.png")
    assert (tmp_path / "all.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.skipif(not DATA.is_dir(), reason="no measured data beside the checkout (ETB_HIL_REAL_DATA)")
@pytest.mark.parametrize(
    ("table", "mapping", "roles"),
    [
        (
            "etb_tbcp/tbcp_open_loop_duty_staircase.csv",
            "etb_tbcp.map.yaml",
            ["motor_duty", "throttle_position", "throttle_position_2"],
        ),
        ("emps/DATA_EMPS.mat", "emps.map.yaml", ["linear_position", "drive_force"]),
    ],
)
def test_tables_of_other_rigs_become_pictures(table, mapping, roles, tmp_path):
    found = read_table(DATA / table, CHECKOUT / "docs" / "examples" / mapping)
    plot_recording(found, roles, tmp_path / "picture.png")
    picture = imread(tmp_path / "picture.png")[..., :3]
    assert np.mean(np.any(picture < 0.9, axis=2)) > 0.03  # something is drawn


def test_a_picture_is_as_its_name_ends(tmp_path):
    rec = recording(throttle_angle=np.sin(np.arange(4000) * 0.01))
    plot_recording(rec, ["throttle_angle"], tmp_path / "all.svg")
    root = ET.fromstring((tmp_path / "all.svg").read_text("utf-8"))  # noqa: S314 (our own)
    texts = {element.text for element in root.iter() if element.tag.endswith("text")}
    assert {"throttle angle", "/ deg", "time / s", "samples missing"} <= texts
    with pytest.raises(InputError, match=r"\.svg, \.png"):
        plot_recording(rec, ["throttle_angle"], tmp_path / "all.gif")


def test_a_gap_is_shaded_and_no_line_crosses_it():
    stamps = np.r_[np.arange(100), 400 + np.arange(100)] * 1_000_000
    rec = Recording("gap", ClockGrade.RECEIVE_STAMPS)
    lost = np.zeros(200, np.int64)
    lost[100] = 300
    rec.append([SampleBlock("m", stamps, stamps, {"throttle_angle": np.linspace(0.0, 1.0, 200)}, lost)])
    svg = svg_of(chart_of(rec, ["throttle_angle"]), "t")
    (line,) = [path for path in re.findall(r' d="(M[^"]*)"', svg) if path.count("L") > 100]
    assert line.count("M") == 2
    assert "samples missing" in svg


@given(
    st.floats(-1e6, 1e6, allow_subnormal=False),
    st.floats(1e-9, 1e6),
    st.integers(20, 600),
)
def test_scales_are_round_evenly_spaced_and_inside(low, span, height):
    panel = Panel(y_limits=(low, low + max(span, 1e-6 * abs(low))))
    panel.line([0.0, 1.0], panel.y_limits, LIMIT)
    svg = svg_of(Chart(5.0, height / 72.0 + 2.0, [panel]), "t")
    box = list(map(float, re.search(r'data-box="([^"]*)"', svg)[1].split()))
    axis = svg.split('<g class="axis">')[2]
    at = [float(y) for y in re.findall(r'd="M\S+ (\S+)h-3.5"', axis)]
    assert 1 <= len(at) <= 10
    assert all(box[1] - 0.01 <= y <= box[1] + box[3] + 0.01 for y in at)
    assert np.ptp(np.diff(at)) < 0.05 if len(at) > 2 else True


FINITE = st.floats(allow_nan=False, allow_infinity=False)
EXTREME = st.sampled_from(
    [0.0, -0.0, 5e-324, 5.29970416e-315, 2.2250738585072014e-308, 1e-300, 1e308, 1.7976931348623157e308]
)


@given(st.one_of(FINITE, EXTREME, EXTREME.map(lambda v: -v)), st.one_of(FINITE, EXTREME), st.integers(-1, 40))
def test_any_finite_range_has_a_scale(low, high, most):
    low, high = sorted((low, high))
    values, texts = zip(*ticks.linear(low, high, most), strict=True)
    assert all(map(np.isfinite, values))
    assert list(values) == sorted(set(values))
    assert 1 <= len(values) <= 12
    assert len(values) > 1 or low == high
    room = 1e-8 * (high / 2.0 - low / 2.0)
    assert low - room <= values[0] <= values[-1] <= high + room
    assert all(texts)


@pytest.mark.parametrize(
    "values",
    [
        (0.0, 5.29970416e-315),
        (5e-324, 5e-324),
        (-1.7e308, 1.7e308),
        (1e308, 1.7e308),
        (1.7e308, 1.7e308),
        (1.0, np.nextafter(1.0, 2.0)),
    ],
)
def test_a_signal_of_any_finite_values_becomes_a_picture(values):
    svg = svg_of(chart_of(recording(motor_current=values), ["motor_current"]), "t")
    assert "nan" not in svg
    assert "inf" not in svg


def test_a_scale_reads_as_people_write_it():
    panel = Panel(y_limits=(-0.3, 0.3))
    panel.line([0.1, 2.0], [-0.3, 0.3], LIMIT)
    svg = svg_of(Chart(5.0, 4.0, [panel], is_log=True), "t")
    texts = re.findall(r">([^<>]+)</text>", svg)
    assert texts[:5] == ["0.1", "0.2", "0.5", "1", "2"]
    assert texts[5:] == ["\u22120.3", "\u22120.2", "\u22120.1", "0.0", "0.1", "0.2", "0.3"]


def test_a_role_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InputError, match=r"no signal for the role 'temperature'.*throttle_angle"):
        plot_recording(recording(throttle_angle=[1, 2]), ["temperature"], tmp_path / "x.png")
    with pytest.raises(InputError, match="no role to plot"):
        plot_recording(recording(throttle_angle=[1, 2]), [], tmp_path / "x.png")
    assert list(tmp_path.iterdir()) == []


def test_infinite_and_missing_numbers_do_not_stop_a_plot():
    numbers = (Measurement("T_st", "x", None, "N·m"), Measurement("omega_s", "x", 0.0, "rad/s"))
    figure = figure_of(
        plots.friction_over_speed(sample_run.series(), sample_run.results(measurements=Measurements(numbers)))
    )
    assert not any(str(line.get_label()).startswith("limit") for line in figure.axes[0].lines)


def test_break_away_over_rate_only_where_there_were_several_rates():
    series = sample_run.series()
    assert condition_plots.break_away_over_rate(series, sample_run.results()) is None
    rate = np.repeat([0.3, 1.0, 3.0], 4)
    torque = np.tile([0.17, -0.17, 0.171, -0.169], 3)
    means = {"ramp_rate": np.array([0.3, 1.0, 3.0]), "ramp_torque": np.full(3, 0.17)}
    bounds = {"ramp_low": np.full(3, 0.168), "ramp_high": np.full(3, 0.172)}
    several = replace(series, break_away_rate=rate, break_away_torque=torque, **means, **bounds)
    (axes,) = figure_of(condition_plots.break_away_over_rate(several, sample_run.results())).axes
    drawn = {line.get_label(): line.get_ydata() for line in axes.lines}
    assert len(drawn["opening"]) == len(drawn["closing"]) == 6
    assert all(value > 0.0 for value in drawn["closing"])
    low, high = axes.get_ylim()
    assert high - low > 0.19 * 0.17  # scatter of 1 % does not fill the plot


def test_friction_over_temperature_only_where_the_plate_warmed():
    series = sample_run.series()
    held = replace(series, point_temperature=np.full(len(series.point_velocity), 23.0))
    assert condition_plots.friction_over_temperature(held, sample_run.results()) is None
    rng = np.random.default_rng(4)
    count = 4000
    speed = np.concatenate([rng.uniform(0.1, 1.0, count), rng.uniform(12.0, 17.0, count)])
    warmth = rng.uniform(20.0, 40.0, 2 * count)
    shown = {"point_velocity": speed, "point_friction": speed, "point_angle": speed, "point_temperature": warmth}
    excess = np.exp(-0.003 * (warmth - 30.0)) - 1.0 + rng.normal(0.0, 0.02, 2 * count)
    warm = replace(series, **shown, point_excess=excess)
    (axes,) = figure_of(condition_plots.friction_over_temperature(warm, sample_run.results())).axes
    laws = [float(str(line.get_label()).split()[1]) for line in axes.lines if "%/K" in str(line.get_label())]
    assert laws == pytest.approx([-0.3, -0.3], abs=0.03)


def test_a_map_at_one_temperature_that_follows_the_curve_is_left_out():
    points = sample_run.series()
    still, on_curve = np.full(len(points.point_angle), 20.0), np.zeros(len(points.point_angle))
    flat = replace(points, point_temperature=still, point_excess=on_curve)
    assert len(plots.friction_over_angle(flat, sample_run.results()).panels) == 1
