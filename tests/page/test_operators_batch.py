"""An operator's batch of five in a real browser: by keyboard, then by scanner alone."""

import json
import re
from base64 import b64encode

import pytest
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select
from served import SIZES, clipped, keep_pictures, resize, until


@pytest.fixture(scope="module")
def bench(page, browser):
    return Desk(page, browser)


class Desk:
    """What an operator sees and does at the page."""

    def __init__(self, page, browser):
        self.page, self.browser, self.runs = page, browser, 0
        browser.get(page.address)

    def find(self, name):
        return self.browser.find_element(By.ID, name)

    def text(self, name):
        return self.find(name).text

    def rows(self, name):
        """Return the text of a table's rows, all at one moment: the page may draw them anew at any time."""
        return self.browser.execute_script("return [...arguments[0].rows].map((row) => row.innerText)", self.find(name))

    def status(self):
        return self.browser.find_element(By.TAG_NAME, "body").get_attribute("data-status")

    def type(self, *keys):
        ActionChains(self.browser).send_keys(*keys).perform()

    def scan(self, text):
        self.type(text, Keys.ENTER)

    def verdict(self):
        """Return the verdict of the next run."""
        self.runs += 1
        until(lambda: self.browser.find_element(By.TAG_NAME, "body").get_attribute("data-run") == str(self.runs))
        until(lambda: self.status() == "done")
        return until(lambda: self.text("headline"))

    def shot(self, name):
        keep_pictures(self.browser, name)


def test_a_name_takes_the_bench(bench):
    until(lambda: bench.text("bench") == "Throttle line 2 · Virtual bench on classic CAN")
    bench.shot("1_free")
    bench.find("operator").send_keys("A. Muster", Keys.ENTER)
    until(lambda: bench.find("serial").is_displayed())
    assert bench.text("holder") == "You operate the bench: A. Muster"
    assert not bench.find("stop").is_enabled()


def test_a_unit_passes_by_keyboard_alone(bench):
    bench.find("serial").send_keys("OK-1")
    assert bench.text("part") == "Part default-throttle 1, test friction_check"
    bench.type(Keys.ENTER)
    assert bench.text("said") == "OK-1: scan it again, or press Enter, to start the test."
    bench.shot("2_armed")
    bench.type(Keys.ENTER)
    until(lambda: bench.status() == "running")
    until(lambda: len(bench.find("phases").find_elements(By.TAG_NAME, "li")) == 7)
    until(lambda: bench.find("facts").text.startswith("Angle") or bench.status() == "done")
    assert bench.verdict() == "PASS"
    assert "Serial OK-1" in bench.text("whose")
    assert "break-away friction" in bench.text("reason")
    assert bench.text("next_text") == "Release the unit."
    bench.shot("3_pass")


def test_a_unit_that_fails_says_why_and_what_to_do(bench):
    Select(bench.find("unit")).select_by_value("faulty")
    bench.find("serial").send_keys("OK-2", Keys.ENTER)
    bench.type(Keys.ENTER)
    assert bench.verdict() == "FAIL"
    assert "the limit is 0.260" in bench.text("reason")
    assert "✗ fail" in bench.rows("numbers")[0]
    Select(bench.find("language")).select_by_value("de")
    until(lambda: bench.text("headline") == "SCHLECHT")
    assert re.fullmatch(
        r"Losbrechreibung: 0,\d+ N·m; die Grenze ist 0,26 N·m\.", bench.text("reason").replace("\u00ad", "")
    )
    assert bench.text("next_text").startswith("Diesen Prüfling nicht in ein Fahrzeug einbauen")
    for size in SIZES:
        resize(bench.browser, size)
        assert clipped(bench.browser) == []
    resize(bench.browser, SIZES[0])
    bench.shot("4_fail_german")
    Select(bench.find("language")).select_by_value("en")
    until(lambda: bench.text("headline") == "FAIL")
    report = bench.find("report").get_attribute("href")
    cookie = "; ".join(f"{one['name']}={one['value']}" for one in bench.browser.get_cookies())
    status, headers, body = bench.page.ask("GET", "/report/" + report.rpartition("/")[2], cookie=cookie)
    assert status == 200
    assert "sandbox" in headers["Content-Security-Policy"]
    assert "FAIL" in body
    bench.shot("4_fail")


def test_a_bench_fault_is_never_the_units(bench):
    Select(bench.find("unit")).select_by_value("default")
    bench.find("serial").send_keys("BF-3", Keys.ENTER)
    bench.type(Keys.ENTER)
    assert bench.verdict() == "BENCH FAULT"
    assert "not judged" in bench.text("further")
    bench.shot("5_fault")


def test_escape_stops_a_test_that_waits_for_an_answer(bench):
    bench.find("serial").send_keys("AS-4", Keys.ENTER)
    bench.type(Keys.ENTER)
    until(lambda: bench.text("prompt_text") == "Is the plug in?")
    assert bench.find("stop").is_enabled()
    bench.shot("6_prompt")
    bench.type(Keys.ESCAPE)
    assert bench.verdict() == "ABORTED"
    bench.shot("7_stopped")


def test_a_scanner_alone_starts_answers_and_repeats(bench):
    bench.browser.execute_script("document.activeElement.blur()")
    bench.scan("AS-5")
    bench.scan("AS-5")
    until(lambda: bench.text("prompt_text") == "Is the plug in?")
    bench.scan("OK-9")  # a unit's label is no answer
    assert bench.find("prompt").is_displayed()
    bench.scan("ETBHIL-1")
    assert bench.verdict() == "INCONCLUSIVE"  # nothing moved in this scenario
    bench.scan("ETBHIL-REPEAT")
    until(lambda: bench.text("prompt_text") == "Is the plug in?")
    bench.scan("ETBHIL-STOP")
    assert bench.verdict() == "ABORTED"


def test_a_text_is_scanned_and_a_photo_is_taken(bench, tmp_path):
    picture = tmp_path / "plug.png"
    bench.browser.save_screenshot(str(picture))
    bench.find("serial").send_keys("TE-6", Keys.ENTER)
    bench.type(Keys.ENTER)
    until(lambda: bench.text("prompt_text") == "Which lot?")
    bench.shot("6_text")
    bench.browser.execute_script("document.activeElement.blur()")
    bench.scan("Lot 4711")  # as a scanner types it, without a focus
    until(lambda: bench.text("prompt_text") == "Photo of the plug")
    bench.shot("6_photo")
    note = tmp_path / "note.png"
    note.write_text("no picture")
    bench.find("entry").send_keys(str(note))
    until(lambda: bench.text("said") == "The file must be a picture that the browser can read.")
    bench.find("entry").send_keys(str(picture))
    assert bench.verdict() == "INCONCLUSIVE"  # nothing moved in this scenario
    results = max((bench.page.folder / "sessions").glob("*/results.json"), key=lambda one: one.stat().st_mtime_ns)
    said, session = {one["id"]: one for one in json.loads(results.read_text())["prompts"]}, results.parent
    assert said["lot"]["entry"] == "Lot 4711"
    photo = (session / said["look"]["entry"]).read_bytes()
    assert photo.startswith(b"\xff\xd8\xff")
    assert b64encode(photo).decode() in (session / "report.html").read_text()


def test_the_last_units_and_the_yield_are_there(bench):
    verdicts = ["inconclusive", "aborted", "inconclusive", "aborted", "bench fault", "fail", "pass"]
    until(lambda: len(bench.rows("recent")) == len(verdicts))  # they are read anew behind the end of a run
    rows = bench.rows("recent")
    assert all(word in row for word, row in zip(verdicts, rows, strict=True))
    assert any("Report" in row for row in rows)
    assert bench.text("yield") == "Yield 25 %: 1 of 4 units passed"
    until(lambda: len(bench.find("which").find_elements(By.TAG_NAME, "option")) > 3)
    bench.shot("8_past")


def test_a_serial_number_of_no_part_is_refused_before_anything_moves(bench):
    bench.find("serial").send_keys("XX-1", Keys.ENTER)
    bench.type(Keys.ENTER)
    assert bench.verdict() == "NOT STARTED"
    assert "no part of this station" in bench.text("reason")
    bench.shot("9_refused")


def test_german_and_dark(bench):
    Select(bench.find("language")).select_by_value("de")
    until(lambda: bench.text("headline") == "NICHT GESTARTET")
    Select(bench.find("theme")).select_by_value("dark")
    assert bench.browser.execute_script("return getComputedStyle(document.body).backgroundColor") == "rgb(16, 20, 24)"
    bench.shot("10_german_dark")
    Select(bench.find("language")).select_by_value("en")
    Select(bench.find("theme")).select_by_value("auto")


def test_the_browser_had_nothing_to_complain_of(bench):
    logged = bench.browser.get_log("browser")  # of this page alone: another test's server is gone by now
    said = [line["message"] for line in logged if line["level"] == "SEVERE" and bench.page.address in line["message"]]
    assert said == []
    until(lambda: bench.find("release").is_displayed())
    bench.find("release").click()
    until(lambda: bench.find("take").is_displayed())
