"""A drive's force that reads by one factor too much: its wrong numbers may be that, all of them."""

from __future__ import annotations

import numpy as np

from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.fitting.unknowns import effect_unknowns
from etb_hil.discrepancy.search import decision
from etb_hil.discrepancy.search.findings import Findings
from etb_hil.plant.effects.current_sensor_gain import EFFECT as SCALE


def doubt_force(findings: Findings) -> None:
    """Put the force's scale into the class of a drive's wrong numbers where it leaves as little, all of them in order.

    A throttle's voltage balance knows the current's scale; of a drive nothing does but the tolerances of its numbers.
    """
    wrong = [each for each in findings.accepted if each.winner.candidate.effect is None]
    if not wrong or not findings.balances[0].measured.is_drive:
        return
    stated = {unknown.name: unknown for unknown in findings.calibration.unknowns}
    (scale,) = effect_unknowns(SCALE, (0.0,))
    whole = findings.final.fit.whole.copy()
    for each in wrong:
        number = stated[each.winner.candidate.frees]
        factor = whole[number.place] / number.centre
        scale.put(whole, float(np.clip((factor - 1.0) / scale.scale, scale.low, scale.high)))
        number.put(whole, 0.0)
    unknowns = [*(stated.get(unknown.name, unknown) for unknown in findings.final.unknowns), scale]
    scaled = calibrate(findings.model, findings.balances, whole, unknowns)
    if np.log(scaled.fit.cost / findings.final.fit.cost) < decision.CLASS_MARGIN:
        for each in wrong:
            each.alike.append(SCALE.id)
