"""The report: everything escaped, nothing fetched, two sheets of paper, light and dark."""

import hashlib
import json
import re

import browser
import pytest
import sample_run
from matplotlib.image import imread

from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.report.html_report import render_page, write_report
from etb_hil.report.series import ReportSeries
from etb_hil.results.measurement import Measurement, Measurements
from etb_hil.results.run_result import Bench, Bus, Exceedance, InputFile, MessageStatistics, Phase, Unit
from etb_hil.results.unit_diagnostics import TroubleCode, UnitDiagnostics

chromium = pytest.mark.skipif(browser.EXECUTABLE is None, reason="no Chromium on this machine")

EVIL = "<script>console.error('ran')</script><img src=http://example.com/x.png>\"'&{{ 7*7 }}\x00\x1b[2J"


def full_run():
    """Return results in which every list is long and every text is hostile."""
    return sample_run.results(
        0.567,
        run_id=EVIL,
        started=EVIL,
        timestamp_grade=EVIL,
        unit=Unit(UnitVerdict.FAIL, EVIL, EVIL * 9, EVIL * 9, (), EVIL * 9, EVIL, EVIL),
        bench=Bench(BenchOutcome.OK, EVIL, EVIL, EVIL, False, EVIL),
        measurements=Measurements(
            [Measurement(f"{EVIL}{i}", EVIL, 0.1, EVIL, note=EVIL) for i in range(3)]
            + [Measurement(f"n{i}", "a value", 0.1, "N·m", 0.09, 0.11, None, 0.2, UnitVerdict.PASS) for i in range(40)]
        ),
        exceedances=tuple(Exceedance("T_st", i * 0.05, i * 0.05 + 0.01, 0.3 + i, 0.25, phase=EVIL) for i in range(300)),
        phases=tuple(Phase(EVIL, f"{EVIL} {i}", i * 0.4, i * 0.4 + 0.4, EVIL) for i in range(60)),
        bus=Bus(EVIL, messages=tuple(MessageStatistics(f"{EVIL}{i}", 10, None) for i in range(40))),
        versions={f"{EVIL}{i}": EVIL for i in range(40)},
        inputs=tuple(InputFile(EVIL, EVIL, sample_run.HASH) for _ in range(40)),
    )


RUNS = {
    "passed": (sample_run.results(), sample_run.series()),
    "failed": (sample_run.results(0.567), sample_run.series(0.567)),
    "hostile": (full_run(), sample_run.series(0.567)),
    "nothing": (
        sample_run.results(
            unit=Unit(None), bench=Bench(BenchOutcome.ABORTED), measurements=Measurements(), phases=(), inputs=()
        ),
        ReportSeries(),
    ),
}


def written(name, tmp_path_factory):
    results, series = RUNS[name]
    return write_report(results, series, tmp_path_factory.mktemp(name))


@pytest.fixture(scope="module", params=RUNS)
def report(request, tmp_path_factory):
    return written(request.param, tmp_path_factory)


@pytest.fixture(scope="module", params=["failed", "hostile"])
def opened(request, tmp_path_factory):
    """Return a report for the browser, which takes its time: a common one and the worst."""
    return written(request.param, tmp_path_factory)


def test_the_page_is_written_alone_and_on_request_with_its_pictures(report, tmp_path):
    assert [p.name for p in report.parent.glob("*.*")] == ["report.html"]
    plots = {f"friction_over_{what}.png" for what in ("angle", "speed")} | {"time_traces.png"}
    write_report(sample_run.results(), sample_run.series(), tmp_path, pictures=True)
    assert {p.name for p in tmp_path.glob("*.*")} >= plots | {"report.html"}


def test_break_away_at_several_rates_is_a_table_of_its_own(tmp_path):
    at_rates = tuple(
        Measurement(
            f"T_st_at_rate_{k}",
            f"break-away friction over torque rate ({k} N·m/s)",
            0.17 + 1e-4 * k,
            "N·m",
            0.168,
            0.172,
            note="mean of 6",
        )
        for k in (1, 2, 3)
    )
    unknown = Measurement("T_st_at_rate_4", "<b>", None, "N·m")
    results = sample_run.results(
        measurements=Measurements((*sample_run.results().measurements.values(), *at_rates, unknown))
    )
    page = write_report(results, sample_run.series(), tmp_path).read_text("utf-8")
    table = page[page.index("Break-away friction at each rate of the torque") :]
    table = table[: table.index("</table>")]
    for shown in (
        "break-away friction over torque rate (2 N·m/s)",
        "0.1702",
        "mean of 6",
        "0.168 to 0.172",
        "&lt;b&gt;",
    ):
        assert shown in table
    assert page.count("break-away friction over torque rate (2 N·m/s)") == 1


def test_nothing_in_the_page_points_outside_it(report):
    page = report.read_text("utf-8")
    tags = re.findall(r"<[a-zA-Z][^>]*>", page)
    assert not [tag for tag in tags if re.search(r"\b(src|action|data|poster|srcset)\s*=", tag)]
    assert {m[1][0] for tag in tags if (m := re.search(r"\bhref=\"([^\"]*)", tag)) and m[1] != "data:,"} <= {"#"}
    assert "@import" not in page
    assert not re.search(r"url\((?!#)", page)
    assert not [tag for tag in tags if tag.lower().startswith(("<iframe", "<object", "<embed", "<img"))]
    assert [tag for tag in tags if tag.lower().startswith("<script")] == ["<script>"]  # ours, which the policy names


def test_the_page_holds_the_files_that_the_run_was_made_with(tmp_path):
    (tmp_path / "inputs").mkdir()
    kept, changed = b"name: <b>mine</b>\n\x1b[2J", b"changed since"
    (tmp_path / "inputs" / "kept.yaml").write_bytes(kept)
    (tmp_path / "inputs" / "changed.yaml").write_bytes(changed)
    files = (
        InputFile("scenario", "kept.yaml", hashlib.sha256(kept).hexdigest()),
        InputFile("limits", "changed.yaml", sample_run.HASH),
        InputFile("dbc", "../../etc/passwd", sample_run.HASH),
    )
    page = write_report(sample_run.results(inputs=files), sample_run.series(), tmp_path).read_text("utf-8")
    assert "name: &lt;b&gt;mine&lt;/b&gt;" in page
    assert page.count("<details>") == 1
    assert "changed since" not in page


def test_hostile_names_are_text(tmp_path):
    page = write_report(full_run(), sample_run.series(), tmp_path).read_text("utf-8")
    assert "&lt;script&gt;console.error(&#39;ran&#39;)&lt;/script&gt;" in page
    assert "{{ 7*7 }}" in page
    assert not re.search(r"[\x00-\x08\x0b-\x1f\x7f]", page)


PLOTS = dict.fromkeys(("friction_over_speed", "friction_over_angle", "time_traces"), "<svg></svg>")
NO_LIMIT = Measurements([Measurement("T_st", "break-away friction", 0.17, "N·m")])


@pytest.mark.parametrize(
    ("changes", "has_friction", "said"),
    [
        ({}, True, "the estimated friction never passed a limit"),
        ({"bench": Bench(BenchOutcome.ABORTED)}, True, "the run was not finished"),
        ({"bench": Bench(BenchOutcome.FAULT)}, True, "the run was not finished"),
        ({}, False, "no friction torque was estimated in this run"),
        ({"measurements": NO_LIMIT}, True, "no limit of friction torque applies to this run"),
    ],
)
def test_a_run_without_exceedances_says_what_that_means(changes, has_friction, said):
    page = render_page(sample_run.results(**changes), PLOTS, {}, has_friction=has_friction)
    assert said in page
    assert ("never passed a limit" in page) is (said == "the estimated friction never passed a limit")


def code(number):
    return TroubleCode(f"P{number}", 0, 1)


@pytest.mark.parametrize(
    ("before", "after", "shown", "note"),
    [
        ((code(2119),), (), [], ""),
        ((code(2119),), None, ["P2119"], "Trouble codes read before the run."),
        ((code(2119),), (code(2135),), ["P2135"], "Trouble codes read after the run."),
        (
            None,
            tuple(code(2100 + k) for k in range(11)),
            [f"P{2100 + k}" for k in range(8)],
            "Trouble codes read after the run: the first 8 of 11; all of them are in results.json.",
        ),
    ],
)
def test_trouble_codes_say_when_they_were_read_and_how_many_there_are(before, after, shown, note):
    says = UnitDiagnostics(codes_before=before, codes_after=after)
    page = render_page(sample_run.results(unit_diagnostics=says), PLOTS, {})
    assert re.findall(r'<td class="code">(\w+)</td>', page) == shown
    assert note in page
    assert ("Trouble codes read" in page) is bool(note)


def test_values_limits_and_grades_are_there():
    page = render_page(sample_run.results(0.567), PLOTS, {})
    text = re.sub(r"(<[^>]*>|\s)+", " ", page.replace("<wbr>", ""))
    for expected in (
        "break-away friction T_st 0.567 N·m 0.563 to 0.571 at most 0.250 fail",
        "return margin -0.217 N·m -0.227 to -0.207 at least 0.050 fail",
        "T_st 5.000 5.400 0.567 0.250 11.46 12.0 23.4 ramp opening",
        "error-active Load 61.4 % in the last 0.1 s, 66.0 % in the worst Error frames 0",
        "Error counters transmit unknown, receive 3 Dropped by the computer unknown",
        "Age of the newest sample 0.60 ms on average, 2.00 ms at most",
        "Set-points on the bus, jitter unknown",
        "Asked: Is the unit clamped? - yes (operator)",
        "Attempt 2 counts. Kept in the session: attempt 1: inconclusive (too little motion).",
        "Measurement 24000 0 0 0 0",
        "Timestamps sample counter: exact to the controller&#39;s own clock",
        "drift -1.20 ppm, scatter 36 us rms, 121 us at most Computer late by 0.05 ms on average, 1.25 ms at most",
        "3 ramp opening: from 5.000 s, triggered at 9.250 s; 4",
        "Measurement 24000 0 0 0 0",
        f"model: paper.yaml {sample_run.HASH}",
        "etb_hil 0.1.0, python 3.11.9",
        "yes, seen in the measured current",
    ):
        assert expected in text


def test_each_measurement_is_listed_with_its_whole_id(tmp_path):
    ids = [f"a_measurement_of_ones_own_with_a_long_name_{k}" for k in range(60)]
    own = [Measurement(id_, "own value", 0.1, "A") for id_ in ids]
    results = sample_run.results(measurements=Measurements((*sample_run.numbers(sample_run.T_ST), *own)))
    page = write_report(results, sample_run.series(), tmp_path).read_text("utf-8").replace("<wbr>", "")
    assert [id_ for id_ in ids if f">{id_}<" not in page] == []


@chromium
def test_light_and_dark_without_a_word_or_a_request(opened, tmp_path):
    shown = {}
    for theme in ("light", "dark"):
        picture = tmp_path / f"{theme}.png"
        flags = (f"--screenshot={picture}", "--window-size=1200,2200")
        assert browser.open_page(opened, tmp_path, *flags, dark=theme == "dark") == ([], set())
        shown[theme] = imread(picture)[..., :3].mean(axis=2)
    assert shown["light"][2, 2] > 0.95
    assert shown["dark"][2, 2] < 0.15
    assert shown["dark"].mean() < 0.3  # the plots too: no white sheet in a dark page
    assert shown["dark"].std() > 0.05


# What a hand does: drag over the middle half of the traces, shift and drag, type, double-click; and what is seen then.
ZOOM = """
SVGElement.prototype.setPointerCapture = () => {};  // a made-up pointer cannot be captured
const svg = document.querySelector("figure.traces svg"), plots = [...svg.querySelectorAll("g[data-box]")];
const friction = plots.at(-1), [left, top_, width, height] = friction.dataset.box.split(" ").map(Number);
const say = (type, share, up, extra = {}) => {
  const point = new DOMPoint(left + share * width, top_ + (1 - up) * height).matrixTransform(svg.getScreenCTM());
  svg.dispatchEvent(new PointerEvent(type, { clientX: point.x, clientY: point.y, button: 0, ...extra }));
};
const drag = (from, to, extra) => {
  say("pointerdown", ...from, extra); say("pointermove", ...to, extra); say("pointerup", ...to, extra);
};
const key = (key) => svg.dispatchEvent(new KeyboardEvent("keydown", { key }));
const seen = () => ({
  ticks: [...friction.querySelectorAll(".scale text[text-anchor=middle]")].map((t) => t.textContent),
  levels: [...friction.querySelectorAll(".scale text[text-anchor=end]")].map((t) => t.textContent),
  stretched: plots.map((p) => p.querySelector("[transform^=matrix]")?.getAttribute("transform").split(/[( ]/)[1]),
  readout: svg.nextElementSibling.textContent,
});
const found = {};
drag([0.25, 0.5], [0.75, 0.52]); found.across = seen();
drag([0.5, 0.2], [0.25, 0.2], { shiftKey: true }); found.moved = seen();
drag([1e-7, 0.5], [0.5, 1.0]); found.both = seen();
key("0"); found.reset = seen();
key("+"); key("ArrowRight"); found.typed = seen();
svg.dispatchEvent(new MouseEvent("dblclick")); found.back = seen();
document.body.textContent = JSON.stringify(found);
"""


@chromium
def test_plots_zoom(tmp_path):
    page = write_report(sample_run.results(0.567), sample_run.series(0.567), tmp_path)
    dom = browser.dom(page, tmp_path)
    assert dom.count('tabindex="0"') == 3  # the policy let the script run
    assert "Drag over a range to zoom" in dom
    free = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", page.read_text("utf-8"))
    page.write_text(free.replace("</body>", f"<script>{ZOOM}</script></body>"), "utf-8")
    found = json.loads(re.search(r"<body>(.*)</body>", browser.dom(page, tmp_path), re.DOTALL)[1])
    assert [float(k) for k in found["across"]["stretched"][1:]] == pytest.approx([2.0] * 4)  # all plots together
    seen = [float(tick) for tick in found["across"]["ticks"]]
    assert 6.0 <= min(seen) < 8.0  # the run lasts 24 s
    assert 16.0 <= max(seen) <= 18.0
    assert found["across"]["levels"] == []  # the scale upwards stands as drawn
    assert found["across"]["readout"].startswith("time / s: 18.0")
    assert "friction / N" in found["across"]["readout"]
    moved = [float(tick) for tick in found["moved"]["ticks"]]
    assert min(moved) > min(seen)
    assert float(found["both"]["stretched"][1]) == pytest.approx(4.0)
    assert found["both"]["levels"] != []
    assert found["reset"]["ticks"] == found["back"]["ticks"] == []
    assert set(found["back"]["stretched"][1:]) == {"1"}
    assert float(found["typed"]["stretched"][1]) == pytest.approx(2.0)


@chromium
def test_prints_on_two_sheets_at_most(opened, tmp_path):
    paper = tmp_path / "report.pdf"
    browser.open_page(opened, tmp_path, f"--print-to-pdf={paper}", "--no-pdf-header-footer", dark=True)
    assert len(re.findall(rb"/Type\s*/Page\b", paper.read_bytes())) == 2


@chromium
def test_the_browser_would_have_told(tmp_path):
    page = tmp_path / "bad.html"
    page.write_text('<!DOCTYPE html><img src="http://example.com/a.png"><script>console.error("oh no")</script>')
    console, requests = browser.open_page(page, tmp_path, f"--screenshot={tmp_path / 'bad.png'}")
    assert "oh no" in console[0]
    assert requests == {"http://example.com/a.png"}
