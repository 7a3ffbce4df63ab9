"""A drive's force that reads by one factor too much: what is wrong with its numbers may be that, all of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.fitting.unknowns import effect_unknowns
from etb_hil.discrepancy.search import decision
from etb_hil.discrepancy.search.findings import Findings, Round
from etb_hil.plant.effects.catalogue import acting_at
from etb_hil.plant.effects.effect import Effect
from etb_hil.plant.effects.port import Port


def doubt_force(findings: Findings) -> None:
    """Put the force's scale into the class of a drive's causes where it leaves as little as they do.

    It is tried in place of all of them, then of the parametric faults alone, with every number in its box. A throttle's
    voltage balance knows the current's scale; of a drive nothing does but the tolerances of its numbers.
    """
    if not findings.balances[0].measured.is_drive:
        return
    (scale,) = acting_at(Port.CURRENT_SCALE)
    numbers = [each for each in findings.accepted if each.winner.candidate.effect is None]
    for replaced in (findings.accepted, numbers):
        if replaced and _leaves_as_little(findings, replaced, scale):
            for each in replaced:
                each.alike.append(scale.id)
            return


def _leaves_as_little(findings: Findings, replaced: Sequence[Round], effect: Effect) -> bool:
    """Tell whether a force that is read by a factor too large or small can stand in the place of some causes."""
    (scale,) = effect_unknowns(effect, (0.0,))
    stated = {unknown.name: unknown for unknown in findings.calibration.unknowns}
    whole, gone = findings.final.fit.whole.copy(), set[int]()
    for winner in (each.winner for each in replaced):
        if winner.candidate.effect is not None:
            gone.update(winner.candidate.effect.stated_indices)
            continue
        number = stated[winner.candidate.frees]
        factor = float(whole[number.place]) / number.centre
        scale.put(whole, float(np.clip((factor - 1.0) / scale.scale, scale.low, scale.high)))
        number.put(whole, 0.0)
    whole[list(gone)] = 0.0
    kept = [stated.get(unknown.name, unknown) for unknown in findings.final.unknowns if unknown.place not in gone]
    scaled = calibrate(findings.model, findings.balances, whole, [*kept, scale])
    return bool(np.log(scaled.fit.cost / findings.final.fit.cost) < decision.CLASS_MARGIN)
