"""The names of measurements on the German page, as its own words make them."""

import json
from importlib.resources import files

from etb_hil.diagnosis.measurement_registry import measurement_kinds, name_of
from etb_hil.diagnosis.motion.steps import SUFFIXES

GERMAN = json.loads((files("etb_hil.page") / "words" / "de.json").read_text("utf-8"))
KINDS = measurement_kinds()
STEPS = [f"{size}_{way}" for size in ("small", "large") for way in ("opening", "closing")]
NAMES = """
    const [asked, language, done] = arguments;
    import("/static/words.js").then(async (words) => {
        await words.loadWords(language);
        done(asked.map(([id, name]) => words.measured(id, name)));
    }, (error) => done(String(error)));
"""


def test_each_measurement_has_a_name_in_german():
    assert [kind for kind in KINDS if f"measurement {kind}" not in GERMAN] == []


def test_one_of_several_values_is_named_in_the_pages_language(page, browser):
    asked = {
        f"{kind}_{step}": name_of(f"{kind}_{step}") for kind in KINDS if kind.startswith("step_") for step in STEPS
    }
    assert {KINDS[kind].suffixes for kind in KINDS if kind.startswith("step_")} == {SUFFIXES}
    asked |= {"T_st_at_rate_2": "break-away friction over torque rate (0.5 N·m/s)", "T_st": name_of("T_st")}
    others = {"T_st_of_mine_1": "my own friction (1)", "my_own": "my own (cold)"}
    browser.get(page.address)

    def shown(language):
        pairs = [*(asked | others).items()]
        found = browser.execute_async_script(NAMES, pairs, language)
        return dict(
            zip((one for one, _ in pairs), (name.replace("\N{SOFT HYPHEN}", "") for name in found), strict=True)
        )

    german, english = shown("de"), shown("en")
    assert german["step_rise_large_opening"] == "Anstiegszeit eines Sprungs (großer Sprung, öffnend)"
    assert german["T_st_at_rate_2"] == "Losbrechreibung bei einer Rampe des Moments (0.5 N·m/s)"
    assert [one for one, name in asked.items() if german[one].casefold() == name.casefold()] == []
    assert english == {one: name[:1].upper() + name[1:] for one, name in (asked | others).items()}
    assert {one: german[one] for one in others} == {one: english[one] for one in others}
