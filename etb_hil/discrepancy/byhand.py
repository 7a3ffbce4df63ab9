"""What an answer says of numbers that were measured by hand: which were known, and which of them are causes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from etb_hil.discrepancy.calibration import calibrate
from etb_hil.discrepancy.findings import Findings
from etb_hil.plant.measured import Measured
from etb_hil.plant.parameters import Model


def measured(model: Model) -> list[dict[str, Any]]:
    """Return what was known of the unit by hand, and so is no suspect, at the shafts that the model file states."""
    return [
        {
            "name": one.name,
            "judges": one.id,
            "value": one.value,
            "uncertainty": one.uncertainty,
            "unit": one.unit,
            "stated": one.stated,
            "tolerance": one.tolerance,
            "is_cause": one.is_off,
        }
        for one in model.measured.values()
    ]


def found_by_hand(findings: Findings) -> list[dict[str, Any]]:
    """Return the causes that were measured: numbers that lie outside what the model file states without them.

    What each takes of the error is what the calibrated model leaves less once it is known, one after the other.
    """
    off = [one for one in findings.model.measured.values() if one.is_off]
    if not off:
        return []
    known = findings.model.knowing(replace(one, value=one.stated, uncertainty=one.tolerance) for one in off)
    costs = [calibrate(known, findings.balances).fit.cost]
    found = []
    for id_ in dict.fromkeys(one.id for one in off):
        own = [one for one in off if one.id == id_]
        known = known.knowing(own)
        costs.append(calibrate(known, findings.balances).fit.cost)
        found.append(
            {
                "effect": id_,
                "probability": 1.0,
                "class": [],
                "parameters": {one.name.rpartition(".")[2]: _number(one) for one in own},
                "share_of_error": max(costs[-2] - costs[-1], 0.0) / costs[0],
                "held_out_t": None,
            }
        )
    return found


def _number(one: Measured) -> dict[str, Any]:
    return {
        "value": one.value,
        "unit": one.unit,
        "interval": [one.value - one.uncertainty, one.value + one.uncertainty],
        "on_bound": False,
        "in_model": one.value,
    }
