"""The engineer's view in a real browser, of a bench, a station and units whose names would be scripts in HTML."""

import csv
import io
import json
import time

import can
import pytest
import served
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select
from served import SIZES, STRANGE, keep_pictures, resize, until

from etb_hil.replays.outcome import CRASHED, Outcome
from etb_hil.replays.progress import STATE, Watch

# Text whose contrast to its background is below WCAG 2.2 AA (4.5, or 3 for large text), as far as it can be used.
TOO_FAINT = """
const rgb = (text) => text.match(/[\\d.]+/g).map(Number);
const light = ([r, g, b]) => [r, g, b].map((v) => v / 255)
  .map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
  .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0);
const found = [];
for (const element of document.body.querySelectorAll("*")) {
  if (!element.getClientRects().length || element.closest(":disabled, option")) continue;
  const hasText = [...element.childNodes].some((node) => node.nodeType === 3 && node.data.trim());
  if (!hasText && !element.matches("input, select")) continue;
  const style = getComputedStyle(element);
  let under = element, back = [0, 0, 0, 0];
  while (under && (back = rgb(getComputedStyle(under).backgroundColor)).length === 4 && back[3] === 0)
    under = under.parentElement;
  const [a, b] = [light(rgb(style.color)), light(back)].sort((x, y) => y - x);
  const size = parseFloat(style.fontSize), isLarge = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
  const is_faint = (a + 0.05) / (b + 0.05) < (isLarge ? 3 : 4.5);
  if (is_faint) found.push(`${element.tagName} ${element.id} ${element.className}`);
}
return found;
"""


class View:
    """A page with two runs of one part, a failed unit and a good one, and the browser before it."""

    def __init__(self, page, browser):
        self.page, self.browser = page, browser
        browser.get(page.address)
        until(lambda: self.text("bench"))
        self.find("operator").send_keys(STRANGE, Keys.ENTER)
        until(lambda: self.find("serial").is_displayed())
        self.runs = 0

    def find(self, name):
        return self.browser.find_element(By.ID, name)

    def text(self, name):
        return self.find(name).text

    def rows(self, name):
        """Return the text of a table's rows, all at one moment: the page may draw them anew at any time."""
        script = "return [...arguments[0].rows].map((row) => row.innerText.replaceAll('\\t', ' '))"
        return self.browser.execute_script(script, self.find(name))

    def start(self, serial, unit):
        self.runs += 1
        until(lambda: self.find("unit").find_elements(By.CSS_SELECTOR, f"option[value={unit}]"))
        Select(self.find("unit")).select_by_value(unit)
        self.find("serial").send_keys(serial, Keys.ENTER)
        self.find("start").send_keys(Keys.ENTER)

    def run(self, serial, unit):
        self.start(serial, unit)
        body = self.browser.find_element(By.TAG_NAME, "body")
        until(lambda: body.get_attribute("data-run") == str(self.runs) and body.get_attribute("data-status") == "done")

    def get(self, path):
        cookie = "; ".join(f"{one['name']}={one['value']}" for one in self.browser.get_cookies())
        return self.page.ask("GET", path, cookie=cookie)

    def is_untouched(self):
        """Return whether no name became a part of the document."""
        return self.browser.title != "1" and not self.browser.find_elements(By.TAG_NAME, "img")


@pytest.fixture(scope="module")
def view(browser, tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    with served.Served(folder, "--station", str(served.strange_station(folder))) as page:
        yield View(page, browser)


def test_the_page_tells_the_units_trouble_codes_beside_what_was_measured(view):
    view.run(f"OK {STRANGE}", "faulty")
    assert view.text("headline") == "FAIL"
    codes = [line for line in view.text("further").splitlines() if "The unit reports P2119" in line]
    assert "measured: break-away friction" in codes[0]
    assert f"Serial OK {STRANGE}" in view.text("whose")
    assert STRANGE in view.text("holder")
    assert view.text("bench") == f"{STRANGE} · {STRANGE}"
    assert view.is_untouched()
    for size in SIZES:
        resize(view.browser, size)
        assert served.clipped(view.browser) == []
    resize(view.browser, SIZES[0])
    keep_pictures(view.browser, "20_codes")


def test_a_strange_question_is_shown_as_it_is_written(view):
    view.start("AS 1", "default")
    until(lambda: view.text("prompt_text") == STRANGE)
    assert view.is_untouched()
    view.browser.find_element(By.TAG_NAME, "body").send_keys(Keys.ESCAPE)
    until(lambda: view.text("headline") == "ABORTED")


def test_two_runs_are_compared_step_by_step(view):
    view.run("OK 2", "default")
    assert view.text("headline") == "PASS"
    until(lambda: len(view.find("recent").find_elements(By.TAG_NAME, "tr")) == 3)
    view.browser.get(view.page.address + "engineer")
    until(lambda: len(view.find("a").find_elements(By.TAG_NAME, "option")) == 3)
    Select(view.find("b")).select_by_index(3)  # the first run: the failed unit
    steps = until(lambda: view.rows("steps") if any("above a limit" in row for row in view.rows("steps")) else None)
    ramps = next(row for row in steps if row.startswith("slow ramps"))
    assert "✓ within limits" in ramps
    assert "0.26 N·m" in ramps
    assert all("✓" not in row for row in steps if row.startswith(("home", "bridge off", "teardown")))
    stiction = next(row for row in view.rows("compared") if "✗ fail" in row)
    assert "✓ pass" in stiction
    assert view.text("codes") == "A: none · B: P2119"
    assert view.is_untouched()


def test_signals_are_switched_zoomed_and_read_at_two_cursors(view):
    def plots():
        return [one.get_attribute("data-signal") for one in view.find("plots").find_elements(By.TAG_NAME, "canvas")]

    until(lambda: plots() == ["command_position", "motor_current", "throttle_angle"])
    box = view.find("switches").find_element(By.CSS_SELECTOR, "input[value=supply_voltage]")
    box.send_keys(Keys.SPACE)
    assert "supply_voltage" in plots()
    for name, value in (("from", "5"), ("to", "6"), ("cursor_1", "5.2"), ("cursor_2", "5.4")):
        view.find(name).clear()
        view.find(name).send_keys(value, Keys.ENTER)
    view.find("zoom_in").click()
    assert [float(view.find(name).get_attribute("value")) for name in ("from", "to")] == [5.25, 5.75]
    shown = until(
        lambda: [one for one in view.rows("cursors") if "upply voltage" in one and "(A)" in one]
    )  # B is there
    assert shown[0].endswith("13.5 V 13.5 V 0 V")
    keep_pictures(view.browser, "21_engineer")
    view.find("whole_run").click()
    assert float(view.find("to").get_attribute("value")) > 20.0


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_each_word_has_the_contrast_of_wcag_and_fits_at_each_size(view, theme):
    view.find("theme").send_keys(theme)
    Select(view.find("theme")).select_by_value(theme)
    for size in SIZES:
        resize(view.browser, size)
        assert view.browser.execute_script(TOO_FAINT) == []
        assert view.browser.execute_script("return document.documentElement.scrollWidth") <= size[0]
        assert served.clipped(view.browser) == []
    resize(view.browser, SIZES[0])


def test_the_progress_of_many_logs_is_shown_with_what_failed_and_why(view):
    folder = view.page.folder / "replays"
    folder.mkdir()
    watch = Watch(folder, 3, 0, None)
    until(lambda: view.text("replays_state").startswith("0 of 3 logs · last news"))
    for number in range(3):
        time.sleep(0.3)
        watch.add(Outcome(str(number), f"{STRANGE} {number}.blf", CRASHED, error="the process that read it died"))
    until(lambda: view.text("replays_state") == "3 of 3 logs · 3 could not be judged · all done")
    assert view.rows("failed_logs")[0] == f"{STRANGE} 0.blf the process that read it died"
    assert view.is_untouched()
    for size in SIZES:
        resize(view.browser, size)
        assert served.clipped(view.browser) == []
    keep_pictures(view.browser, "22_many_logs", view.find("replays"))
    (folder / STATE).write_text("{")
    until(lambda: "must be the state of a replay of many logs" in view.text("replays_state"))
    assert view.page.ask("GET", "/api/replays")[0] == 401


def test_frames_and_signals_are_downloaded(view):
    run = Select(view.find("a")).first_selected_option.get_attribute("value")
    status, headers, text = view.get(f"/download/{run}.csv")
    assert (status, headers["Content-Disposition"]) == (200, f'attachment; filename="{run}.csv"')
    table = list(csv.DictReader(io.StringIO(text)))
    assert max(float(row["throttle_angle_rad"]) for row in table if row["throttle_angle_rad"]) > 1.0
    for kind in ("blf", "mf4"):
        href = view.find(kind).get_attribute("href")
        assert href.endswith(f"/download/{run}.{kind}")
    frames = sum(1 for _ in can.BLFReader(view.page.folder / "sessions" / run / "raw.blf"))
    assert frames > 10_000
    assert view.get(f"/download/{run}.exe")[0] == 404
    assert view.get("/download/no-such-run.csv")[0] == 404
    assert view.page.ask("GET", f"/download/{run}.csv")[0] == 303
    assert json.loads(view.get(f"/results/{run}")[2])["unit"]["verdict"] == "pass"


@pytest.mark.study
def test_more_tabs_than_a_browser_has_connections_show_the_same_and_the_last_one_stops_the_test(view):
    """Eight: a browser has six connections to a host, whatever its tabs."""
    view.browser.get(view.page.address)
    first = view.browser.current_window_handle
    for _ in range(7):
        view.browser.switch_to.new_window("tab")
        view.browser.get(view.page.address)
    until(lambda: view.find("serial").is_displayed())
    view.start("AS 3", "default")
    for handle in view.browser.window_handles:
        view.browser.switch_to.window(handle)
        until(lambda: view.text("prompt_text") == STRANGE)
    view.find("stop").click()
    for handle in view.browser.window_handles:
        view.browser.switch_to.window(handle)
        until(lambda: view.text("headline") == "ABORTED")
        if handle != first:
            view.browser.close()
    view.browser.switch_to.window(first)
