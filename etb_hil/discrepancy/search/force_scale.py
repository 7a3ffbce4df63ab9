"""The scale of a drive's force: it may explain parametric faults."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.fitting.unknowns import effect_unknowns
from etb_hil.discrepancy.search.findings import Findings, SelectionStep
from etb_hil.plant.effects.catalogue import acting_at
from etb_hil.plant.effects.effect import Effect
from etb_hil.plant.effects.port import Port

_AS_WELL = 0.05  # of log cost: fits that differ by less leave the same


def consider_force_scale(findings: Findings) -> None:
    """Add the force's scale to a drive's ambiguity groups where it fits as well.

    The scale is tried in place of all causes, then of the parametric faults alone, with every parameter in its
    tolerance. A throttle's voltage balance identifies the current's scale; in a drive only the tolerances do.
    """
    if findings.model.device.has_winding:
        return
    (scale,) = acting_at(Port.CURRENT_SCALE)
    numbers = [each for each in findings.accepted if each.winner.candidate.effect is None]
    for replaced in (findings.accepted, numbers):
        if replaced and _fits_as_well(findings, replaced, scale):
            for each in replaced:
                each.ambiguity_group.append(scale.id)
            if findings.verdict == "explained":
                findings.verdict = "ambiguous"
            return


def _fits_as_well(findings: Findings, replaced: Sequence[SelectionStep], effect: Effect) -> bool:
    """Tell whether a wrong scale of the force can replace some causes."""
    (scale,) = effect_unknowns(effect, (0.0,))
    stated = {unknown.name: unknown for unknown in findings.calibration.unknowns}
    whole, gone = findings.final.fit.whole.copy(), set[int]()
    for winner in (each.winner for each in replaced):
        if winner.candidate.effect is not None:
            gone.update(winner.candidate.effect.stated_indices)
            continue
        number = stated[winner.candidate.frees[0]]
        factor = float(whole[number.place]) / number.centre
        scale.put(whole, float(np.clip((factor - 1.0) / scale.scale, scale.low, scale.high)))
        number.put(whole, 0.0)
    whole[list(gone)] = 0.0
    kept = [stated.get(unknown.name, unknown) for unknown in findings.final.unknowns if unknown.place not in gone]
    scaled = calibrate(findings.model, findings.balances, whole, [*kept, scale])
    return bool(np.log(scaled.fit.cost / findings.final.fit.cost) < _AS_WELL)
