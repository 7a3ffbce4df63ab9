"""The test that would settle what these data leave open."""

from __future__ import annotations

from typing import Any

import numpy as np

from etb_hil.discrepancy.findings import Findings, Round
from etb_hil.plant.effects.catalogue import CATALOGUE

# What a bench can run by itself; the others need a hand, an oven or another load.
_ON_THE_BENCH = {
    "gear_backlash": "reversals_at_limp_home",
    "shaft_compliance": "isolability",
    "sensor_hysteresis": "reversals_at_limp_home",
    "limp_home_dead_zone": "reversals_at_limp_home",
    "presliding_hysteresis": "reversals_at_limp_home",
    "stiction_dwell": "break_away",
    "stribeck_shape": "isolability",
    "friction_position_periodic": "isolability",
    "friction_position_local": "isolability",
    "friction_asymmetry": "isolability",
    "spring_preload_shift": "isolability",
    "current_sensor_offset": "isolability",
    "cogging_torque": "isolability",
    "torque_ripple": "isolability",
    "end_stop_compliance": "isolability",
    "iron_loss": "isolability",
    "measurement_delay": "isolability",
}


def next_test(findings: Findings) -> dict[str, Any] | None:
    """Return the test for the pair that is hardest to tell apart; None where nothing is open.

    `separation_here` is by how many noise units the rivals differ in these data.
    """
    is_drive = findings.balances[0].measured.is_drive
    open_rounds = [r for r in findings.accepted if r.alike]
    if open_rounds:
        return _between(open_rounds[0], open_rounds[0].alike[0], is_drive=is_drive)
    if findings.verdict == "unexplained" and findings.rounds:
        last = findings.rounds[-1]
        return _between(last, last.refined[1].id, is_drive=is_drive) if len(last.refined) > 1 else None
    return None


def _between(found: Round, rival: str, *, is_drive: bool) -> dict[str, Any]:
    first = found.winner.id
    costs = {one.id: one.fit.cost for one in found.refined} | {first: found.winner.fit.cost}
    away = float(np.sqrt(max(costs[rival] - costs[first], 0.0))) if rival in costs else None
    ways = [CATALOGUE[id_].separated_by for id_ in (first, rival) if id_ in CATALOGUE]
    runnable = next((_ON_THE_BENCH[id_] for id_ in (first, rival) if id_ in _ON_THE_BENCH), None)
    says = "; or ".join(dict.fromkeys(ways)) or "state the parameter's tolerance more narrowly"
    return {"pair": [first, rival], "says": says, "separation_here": away, "scenario": None if is_drive else runnable}
