"""The page of an explanation: what it says of causes that the data cannot distinguish, and of parameters."""

import re

import pytest

from etb_hil.report.explain_report import write_explanation
from etb_hil.results.explanation_file import explanation_from_dict

CAUSE = {
    "id": "hbridge_dead_time",
    "not_isolable_from": ["brush_drop", "supply_sag"],
    "share_of_error": 0.97,
    "probability": 0.96,
    "parameters": {"error": {"value": 0.6, "interval": [0.59, 0.61], "unit": "V"}},
}
CANDIDATES = [
    {"selection_step": 1, "id": effect, "accepted": taken, "rejection": "", "probability": probability,
     "residual_share": 0.03, "looks_like": "a loss", "check": "the bridge", "evidence": evidence}
    for effect, taken, probability, evidence in (
        ("hbridge_dead_time", True, None, None), ("brush_drop", False, None, 812.3),
        ("current_sensor_gain", False, 0.0, 28.9),
    )
]  # fmt: skip
RESISTANCE = {
    "nominal": 1.5, "value": 1.53, "without_causes": 1.69, "unit": "ohm", "interval": [1.5, 1.56], "tolerance": 0.15,
    "flags": ["changes when the causes come in"],
}  # fmt: skip
AMBIGUOUS = {
    "verdict": "ambiguous", "causes": [CAUSE], "candidates": CANDIDATES, "calibrated": {"resistance": RESISTANCE},
    "confounded": [], "data_quality": [],
}  # fmt: skip


@pytest.fixture
def rows(tmp_path):
    """Return the rows of the page's tables as lists of cells."""
    page = write_explanation(explanation_from_dict(AMBIGUOUS), None, tmp_path).read_text("utf-8")
    cells = [
        re.findall(r"<td[^>]*>(.*?)</td>", row, re.DOTALL) for row in re.findall(r"<tr>(.*?)</tr>", page, re.DOTALL)
    ]
    return [[re.sub(r"<[^>]*>", " ", cell).strip() for cell in row] for row in cells if row]


def test_each_cause_of_an_ambiguity_group_has_a_row_with_what_to_check(rows):
    named = {row[0]: row for row in rows if len(row) == 5}
    assert {"H-bridge dead time", "or brush drop", "or supply sag"} <= named.keys()
    assert all(row[3] and row[4] for row in named.values() if row[0].startswith(("hbridge", "or ")))
    (said,) = [row[0] for row in rows if len(row) == 1 and row[0].startswith("These data")]
    assert said.startswith("These data cannot distinguish H-bridge dead time, brush drop and supply sag.")


def test_causes_that_cannot_be_distinguished_are_said_to_be_that_beside_their_evidence(rows):
    said = {row[0]: (row[2], row[4]) for row in rows if len(row) == 5 and row[1] == "1"}
    assert said == {
        "H-bridge dead time": ("-", "in the model, but not distinguished"),
        "brush drop": ("812 nat", "not distinguished"),
        "current sensor gain": ("29 nat", "-"),
    }


def test_a_parameter_is_shown_in_each_model(rows):
    (shown,) = [row for row in rows if row[0] == "winding resistance"]
    assert shown == ["winding resistance", "1.5 ohm", "1.69 ohm", "1.53 ohm", "changes when the causes come in"]
