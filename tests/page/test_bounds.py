"""What the operator page tells of a value that the run bounds above and does not measure."""

from report import sample_run
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import Select
from served import Served, short_folder, until

from etb_hil.base.outcome import UnitVerdict
from etb_hil.page.channel import Channel
from etb_hil.page.outcome import outcome_of
from etb_hil.results.measurement import Measurement, Measurements
from etb_hil.results.run_result import Unit

UNDECIDED = UnitVerdict.INCONCLUSIVE
LIMITED = Measurement("T_c", "sliding friction", None, "N·m", 0.0, 0.21, 0.05, 0.2, UNDECIDED)
FREE = Measurement("viscous", "viscous friction", None, "N·m·s/rad", 0.0, 0.002)
UNKNOWN = Measurement("omega_s", "Stribeck velocity", None, "rad/s")
LIMITS = """
const [of, done] = arguments;
import("/static/parts.js").then((parts) => done(of.map(parts.passedLimit)), (error) => done(String(error)));
"""


def test_a_bound_has_its_reason_and_its_row_with_and_without_a_limit(tmp_path, browser):
    measured = Measurements([LIMITED, FREE, UNKNOWN])
    results = sample_run.results(unit=Unit(UNDECIDED, "T_c_undecided"), measurements=measured)
    with Served(tmp_path) as page:
        page.end()
        (folder,) = short_folder(tmp_path).glob("etb_hil_page_*/*")
        Channel(folder).write_state({"run": {}, "outcome": outcome_of(results, None)})
        page.start()  # it shows what came of the last run
        browser.get(page.address)
        reason, numbers = (browser.find_element(By.ID, name) for name in ("reason", "numbers"))
        until(lambda: "at most 0.210 N·m" in reason.text)
        Select(browser.find_element(By.ID, "language")).select_by_value("de")
        until(lambda: "Grenze" in reason.text)
        said = "Gleitreibung: ≤ 0,21 N·m, nicht genau genug bekannt für die Grenze 0,2 N·m."
        assert reason.text.replace("\N{SOFT HYPHEN}", "") == said
        rows = browser.execute_script("return [...arguments[0].rows].map((row) => row.cells[1].innerText)", numbers)
        assert rows == ["≤ 0,21 N·m", "≤ 0,002 N·m·s/rad"]


def test_the_limit_that_is_told_is_the_one_that_was_passed(page, browser):
    def one(value, high, low=0.05, top=0.2):
        return {"value": value, "high": high, "limit_low": low, "limit_high": top}

    told = {0.2: [one(0.21, 0.22), one(0.19, 0.21), one(None, 0.21), one(0.1, 0.2, low=None), one(None, 0.1, low=None)]}
    told[0.05] = [one(0.04, 0.06), one(None, 0.04), one(None, 0.19), one(0.1, 0.2, top=None), one(None, 0.1, top=None)]
    browser.get(page.address)
    for limit, numbers in told.items():
        assert browser.execute_async_script(LIMITS, numbers) == [limit] * len(numbers)
