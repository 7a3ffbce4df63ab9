"""All pages on a phone (390 px), dark and on paper: nothing is cut, no word is broken."""

import json
import re

import numpy as np
import pytest
from history import made_up
from report import sample_run
from selenium.webdriver.support.wait import WebDriverWait

from etb_hil.discrepancy.answer.pictures import Pictures
from etb_hil.discrepancy.answer.residual_curves import ResidualCurve
from etb_hil.histories.history import histories
from etb_hil.report.explain_report import write_explanation
from etb_hil.report.history_page import write_history_page
from etb_hil.report.html_report import write_report
from etb_hil.results.explanation_file import explanation_from_dict

EVIL = "<script>document.title = 'ran'</script>\x1b[2J"
SMALLEST_LETTERS = 7.5  # px: 8 points, the smallest of the charts, on a phone
PHONE, PAPER = 390, 718  # px: a phone held upright, and A4 between margins of 11 mm
SIZE = {"value": 0.0312, "interval": [0.0288, 0.0336], "unit": "N·m", "in_model": 0.0309, "flags": ["at its bound"]}
ERRORS = {"unit": "rad", "reference": 0.0312, "calibrated": 0.0123, "extended": 0.0034, "noise_floor": 0.0031}
FOUND = {
    "schema": "etb_hil/explanation/3",
    "verdict": "ambiguous",
    "causes": [
        {
            "id": "friction_position_periodic",
            "not_isolable_from": ["friction_position_bump", "plate_sensor_nonlinearity"],
            "share_of_error": 0.87,
            "probability": 0.9,
            "parameters": {"sine": SIZE, "a_parameter_with_a_very_long_name": SIZE},
            "finer_in_model": {},
        }
    ],
    "errors": {
        "holdout": {"free_run": {"throttle_angle": ERRORS}, "one_step": {"throttle_angle": ERRORS}},
        "noise_floor_range": [0.0029, 0.0035],
        "free_run_worst": {
            "share": 0.7, "from_s": 3.0, "to_s": 4.0, "error": 0.01, "others": 0.002,
            "noise_floor_range": [0.001, 0.002],
        },
    },
    "gain": {"value": 0.72, "interval": [0.69, 0.75], "over_reference": {"value": 0.89, "interval": [0.85, 0.91]}},
    "candidates": [
        {"selection_step": 1, "id": effect, "accepted": taken, "rejection": refused, "probability": 0.5,
         "residual_share": 0.31, "looks_like": "a wave", "check": "bearings"}
        for effect, taken, refused in (
            ("friction_position_periodic", True, ""),
            ("parameter:spring_stiffness_opening", False, "explains less than noise does"),
        )
    ],
    "friction": {"stiction": {"reference": 0.171, "calibrated": 0.182, "extended": 0.175, "unit": "N·m"}},
    "calibrated": {
        "spring_slope": {"nominal": 0.03, "value": 0.034, "unit": "N·m/rad", "flags": ["outside its tolerance"],
                         "interval": [0.033, 0.035], "tolerance": 0.003}
    },
    "confounded": [],
    "data_quality": [
        {"origin": "20261124-093000_friction-check", "duration_s": 18.2, "rate_hz": 1000.0, "flags": ["late"]}
    ],
    "detection_limits": {
        "gear_backlash": {"limit": 0.002, "unit": "rad", "parameter": "gap", "judged": True, "within_bounds": True}
    },
}  # fmt: skip

LOOK = """
const width = document.documentElement.clientWidth, wide = [], broken = [];
for (const element of document.body.querySelectorAll("*")) {
  if (element.closest("svg svg, script, style") || !element.getClientRects().length) continue;
  const box = element.getBoundingClientRect();
  if (box.width && box.right > width + 1) wide.push(`${element.tagName} ${element.className} ${Math.round(box.right)}`);
}
const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
for (let node = walker.nextNode(); node; node = walker.nextNode()) {
  if (node.parentElement.closest("svg, script, style, code, pre")) continue;
  for (const word of node.data.matchAll(/[\\p{L}]{2,30}/gu)) {
    const range = document.createRange();
    range.setStart(node, word.index); range.setEnd(node, word.index + word[0].length);
    const tops = new Set([...range.getClientRects()].filter((r) => r.width).map((r) => Math.round(r.top)));
    if (tops.size > 1) broken.push(word[0]);
  }
}
const cells = [...document.querySelectorAll("table.cards td")].filter((cell) => cell.getClientRects().length);
return JSON.stringify({
  scroll: document.documentElement.scrollWidth, width, wide, broken,
  cells: cells.length, blocks: cells.filter((cell) => getComputedStyle(cell).display === "block").length,
  paper: getComputedStyle(document.body).backgroundColor,
});
"""


def drawn():
    """Return columns of the plots of an explanation: a slow wave, followed better with the causes."""
    time = np.linspace(6.0, 8.0, 200)
    wave, place = np.sin(3.0 * time), np.linspace(0.1, 1.4, 30)
    curves = [0.002 * np.sin(5.0 * place), 0.0002 * np.cos(5.0 * place)]
    residual = ResidualCurve("torque", "N·m", "position", "rad", place, curves, [-one for one in curves])
    return Pictures(time, wave, 0.8 * wave, 0.99 * wave, "rad", [residual])


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    data = folder / "log.csv"
    data.write_text("t_s\n")
    for name in ("report", "explanation"):
        (folder / name).mkdir()
    units = made_up.production(9, 10, coefficient=-0.003, warm=30.0, benches=("bench 1", EVIL))
    units += [made_up.run(900 + k, EVIL, 0.17 * (1.0 + 0.004 * k)) for k in range(12)]
    return {
        "report": write_report(sample_run.results(0.567), sample_run.series(0.567), folder / "report"),
        "history": write_history_page(histories(units), folder / "history.html", 20, [EVIL]),
        "explanation": write_explanation(explanation_from_dict(FOUND), drawn(), folder / "explanation", [data]),
    }


def wide(browser, width):
    """Give the browser's screen a width in px."""
    browser.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": width == PHONE},
    )


def looked_at(browser, address, width, media="screen", theme="light"):
    wide(browser, width)
    features = [{"name": "prefers-color-scheme", "value": theme}]
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": media, "features": features})
    browser.get(address)
    return json.loads(browser.execute_script(LOOK))


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("name", ["report", "explanation", "history"])
def test_a_phone_shows_all_of_a_page_with_tables_as_cards(browser, pages, name, theme):
    seen = looked_at(browser, pages[name].as_uri(), PHONE, theme=theme)
    assert (seen["wide"], seen["broken"]) == ([], [])
    assert seen["scroll"] <= seen["width"] == PHONE
    assert seen["cells"] == seen["blocks"] > 0
    assert seen["paper"] == {"light": "rgb(253, 254, 254)", "dark": "rgb(20, 24, 29)"}[theme]


LETTERS = """
const seen = [...document.querySelectorAll("figure svg")].filter((svg) => svg.getClientRects().length);
const texts = seen.flatMap((svg) => [...svg.querySelectorAll("text")].filter((text) => text.textContent.trim()));
return texts.map((text) => {
  const place = text.getScreenCTM();
  return parseFloat(getComputedStyle(text).fontSize) * Math.hypot(place.a, place.b);
});
"""


@pytest.mark.parametrize("width", [PHONE, 1280])
@pytest.mark.parametrize("name", ["report", "history", "explanation"])
def test_texts_in_plots_are_legible_at_each_width(browser, pages, name, width):
    looked_at(browser, pages[name].as_uri(), width)
    sizes = browser.execute_script(LETTERS)
    assert len(sizes) > 10
    assert min(sizes) >= SMALLEST_LETTERS


ZOOM_ONE = """
for (let k = 0; k < arguments[0]; k++) svg.dispatchEvent(new KeyboardEvent("keydown", { key: "+", bubbles: true }));
return [...svg.querySelectorAll("g.scale text")].map((text) => text.textContent);
"""
ZOOM = f'const svg = document.querySelector("figure svg"); {ZOOM_ONE}'
NARROW = 'return [...document.querySelectorAll("figure svg")].find((svg) => svg.closest(".narrow"))'


def test_a_plot_for_phones_can_be_zoomed_when_a_window_becomes_narrow(browser, pages):
    looked_at(browser, pages["history"].as_uri(), 1280)
    plot = browser.execute_script(NARROW)
    assert not plot.is_displayed()
    wide(browser, PHONE)
    WebDriverWait(browser, 120).until(lambda _: plot.get_attribute("tabindex") == "0")
    assert plot.is_displayed()
    assert browser.execute_script(f"const svg = arguments[1]; {ZOOM_ONE}", 2, plot)


@pytest.mark.parametrize("name", ["report", "explanation", "history"])
def test_paper_shows_all_of_a_page_on_white(browser, pages, name):
    seen = looked_at(browser, pages[name].as_uri(), PAPER, "print", "dark")
    assert (seen["wide"], seen["broken"]) == ([], [])
    assert seen["paper"] == "rgb(255, 255, 255)"


def test_the_time_axis_of_a_history_tells_days_and_when_zoomed_hours(browser, pages):
    looked_at(browser, pages["history"].as_uri(), 1280)
    days = [text for text in browser.execute_script(ZOOM, 2) if re.fullmatch(r"\d\d-\d\d", text)]
    assert len(days) > 2
    assert days == sorted(days)
    hours = [text for text in browser.execute_script(ZOOM, 12) if re.fullmatch(r"\d\d:\d\d", text)]
    assert len(hours) > 2


def test_a_history_says_what_its_statistics_say_and_runs_no_script_of_others(browser, pages):
    looked_at(browser, pages["history"].as_uri(), 1280)
    assert browser.title == "History"
    text = pages["history"].read_text("utf-8")
    assert "<script>document" not in text
    assert "&lt;script&gt;document" in text
    for said in ("Gauge R&amp;R: ", "distinct categories", "Ppk", "lognormal", "ALARM", "Nelson&#39;s rules"):
        assert said in text


def test_a_phone_shows_all_of_the_operators_page(browser, page):
    seen = looked_at(browser, page.address, PHONE)
    assert (seen["wide"], seen["broken"]) == ([], [])
    assert seen["scroll"] <= seen["width"] == PHONE


def test_each_model_has_one_name_and_inputs_their_hash(pages):
    text = pages["explanation"].read_text("utf-8")
    for name in ("reference model", "calibrated model", "extended model", "noise floor"):
        assert name in text
    assert "sha256" in text
    assert "log.csv" in text
    assert " UTC by etb-hil " in text
