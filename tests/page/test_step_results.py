"""What the engineer's view says of a step, by what is judged in it."""

import pytest

from etb_hil.page.survey import survey

STEP = """
const [result, step, kinds, done] = arguments;
Promise.all([import("/static/steps.js"), import("/static/words.js")]).then(async ([steps, words]) => {
  await words.loadWords("en");
  done(steps.stepResult(result, step, kinds));
}, (error) => done([String(error)]));
"""
RETURN = {"id": "return_time_open", "name": "return time from open", "verdict": "fail"}
STEP_RISE = {"id": "step_rise_large_opening", "name": "rise time (large opening)", "verdict": "inconclusive"}
ABOVE = {"phase": "ramp", "peak": 0.3, "limit": 0.26}


@pytest.fixture(scope="module")
def kinds(tmp_path_factory):
    return survey("virtual_classic", None, tmp_path_factory.mktemp("sessions"))["kinds"]


def test_kinds_of_phases_say_what_is_judged_in_them(kinds):
    watched = {name: kind["is_watched"] for name, kind in kinds.items()}
    assert not any(watched[name] for name in ("home", "release", "prompt", "current_zero"))
    assert watched["ramp"]
    assert "return_time_open" in kinds["release"]["measured"]
    assert "T_st" not in kinds["ramp"]["measured"]  # taken from the motion of the whole run
    assert kinds["prompt"]["measured"] == []


@pytest.mark.parametrize(
    ("name", "changed", "text"),
    [
        ("ramp", {}, "✓ within limits"),
        ("home", {}, "done, not judged"),
        ("prompt", {}, "done, not judged"),
        ("current zero", {}, "done, not judged"),
        ("of a plug-in that is gone", {}, "done, not judged"),
        ("release", {}, "done, not judged"),
        ("release", {"measurements": [RETURN | {"verdict": "pass"}]}, "✓ within limits"),
        ("release", {"measurements": [RETURN]}, "✗ beyond the limit: Unpowered return time from wide open"),
        ("ramp", {"measurements": [RETURN]}, "✓ within limits"),
        ("step", {"measurements": [STEP_RISE]}, "? not decided: "),
        ("ramp", {"exceedances": [ABOVE]}, "✗ above a limit 1 times, at most 0.3 N·m of 0.26 N·m"),
        ("ramp", {"bench": {"outcome": "aborted"}}, "done, not judged"),
    ],
)
def test_a_check_mark_stands_for_limits_that_were_kept(page, browser, kinds, name, changed, text):
    result = {"exceedances": [], "measurements": [], "bench": {"outcome": "ok"}, "unit": {"verdict": "fail"}}
    step = {"id": name, "name": name, "end_s": 3.0}
    browser.get(page.address)
    assert browser.execute_async_script(STEP, result | changed, step, kinds)[0].startswith(text)
