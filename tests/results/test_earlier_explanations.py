"""An `explanation.json` of schema 2 is read, and nothing of it is lost."""

import json
from collections import Counter
from pathlib import Path

import pytest

from etb_hil.base.errors import InputError
from etb_hil.report.explain_report import write_explanation
from etb_hil.results.explanation import SCHEMA
from etb_hil.results.explanation_file import explanation_as_dict, explanation_from_dict, explanation_schema

STORED = json.loads((Path(__file__).parent / "explanation_2.json").read_text("utf-8"))  # of an AMBIGUOUS answer
RUN = {
    "condition": "pwm_frequency", "value": 500.0, "unit": "Hz", "begins_s": 3.5, "seen_by_the_fit": False,
    "r_squared": 0.75, "rms_rad": 0.0625, "breaks_away_at_V": {"measured": 1.25, "model": 1.5},
}  # fmt: skip
# What the stored answer has none of: slow data, other recordings, conditions that changed together.
OTHERS = {
    "schema": "etb_hil/explanation/2",
    "verdict": "unexplained",
    "runs": [RUN],
    "starts": {"rms_rad": [0.03125], "says": "one start"},
    "unexplained": {
        "where": [{"balance": "torque", "regime": "slow", "rms_over_floor": 2.5}],
        "placeholders": [{"balance": "torque", "over": "angle", "parity": "odd", "share_of_rest": 0.875}],
        "runs": [RUN],
        "says": "the error grows",
    },
    "errors": {
        "holdout": {"one_step": {"throttle_angle": {"unit": "rad", "nominal": 0.5, "followed": 0.125}}},
        "nrmse_free_run": {"nominal": 4.5, "followed": 1.125},
        "says": "remark on the errors",
    },
    "measured": [
        {"name": "resistance", "judges": "parameter:resistance", "value": 2.5, "uncertainty": 0.0125, "unit": "ohm",
         "shaft": None, "stated": 1.75, "tolerance": 0.175, "is_cause": True}
    ],
    "transfer": [
        {"effect": "cogging_torque", "recording": "second", "gain": 0.625, "carried_over": True,
         "free_run": {"without": 0.375, "with": 0.1875, "unit": "m"}, "says": "carried over"}
    ],
    "told_apart_by_others": [{"effect": "cogging_torque", "tells_from": ["torque_ripple"], "recording": "third"}],
    "confounded": [
        {"these": "temperature and elapsed time", "pair": ["temperature", "time"], "test": "shuffle",
         "rank_correlation": 0.9375, "says": "they changed together"}
    ],
    "left_out": ["fourth could not be read"],
    "next_test": {
        "says": "weigh it", "pair": ["cogging_torque", "torque_ripple"], "scenario": "multisine",
        "expected_separation": {"value": 30.0, "unit": "1", "parts": ["torque_ripple"], "leaves": ["viscous"]},
        "by_hand": [{"do": "measure it", "gives": [{"name": "coulomb", "uncertainty": 0.0025, "unit": "N·m"}]}],
    },
    "diagnosis": {"says": "the verdict stays: pass", "stated": {"verdict": "pass"}, "extended": {"verdict": "pass"}},
}  # fmt: skip


def leaves(value):
    """Return how often each plain value stands in nested lists and dictionaries."""
    if isinstance(value, dict):
        return sum((leaves(one) for one in value.values()), Counter())
    if isinstance(value, list):
        return sum(map(leaves, value), Counter())
    return Counter([(type(value).__name__, value)])


@pytest.mark.parametrize("old", [STORED, OTHERS], ids=["ambiguous", "others"])
def test_no_value_of_schema_2_is_lost(old):
    written = explanation_as_dict(explanation_from_dict(old))
    assert written["schema"] == SCHEMA
    lost = leaves(old) - leaves(written)
    assert set(lost) == {("str", "etb_hil/explanation/2")}
    assert explanation_from_dict(written) == explanation_from_dict(old)


def test_values_stand_under_their_new_names():
    found = explanation_from_dict(STORED)
    (old,) = STORED["causes"]
    (cause,) = found.causes
    assert (cause.id, list(cause.not_isolable_from)) == (old["effect"], old["class"])
    assert [one.residual_share for one in found.candidates] == [one["leaves"] for one in STORED["suspects"]]
    assert (
        found.errors.holdout["free_run"]["throttle_angle"].reference
        == (STORED["errors"]["holdout"]["free_run"]["throttle_angle"]["nominal"])
    )
    assert list(STORED["nuisances"]) == ["voltage_skew", "plate_skew", "plate_zero"]
    assert list(found.nuisances) == ["voltage_time_offset", "plate_time_offset", "plate_zero"]
    other = explanation_from_dict(OTHERS)
    assert other.runs[0].break_away_voltage.model_v == 1.5
    assert other.errors.nrmse_free_run == {"reference": 4.5, "fitted_in_free_run": 1.125}
    assert other.next_test.bench_steps[0].parameters[0].name == "coulomb"


def test_the_page_shows_an_earlier_answer(tmp_path):
    page = write_explanation(explanation_from_dict(STORED), None, tmp_path).read_text("utf-8")
    assert "H-bridge dead time or brush drop." in page


def test_a_schema_that_is_not_known_is_named():
    with pytest.raises(InputError, match="the schema of this explanation is not known"):
        explanation_from_dict({"schema": "etb_hil/explanation/99", "verdict": "adequate"})


def test_each_key_of_the_schema_has_a_description():
    schema = explanation_schema()
    objects = {"explanation": schema} | schema["$defs"]
    keys = {f"{name}.{key}": value for name, one in objects.items() for key, value in one.get("properties", {}).items()}
    assert len(keys) > 100
    assert [name for name, value in keys.items() if not value.get("description")] == []
