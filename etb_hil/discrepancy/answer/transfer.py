"""Transfer of causes: whether another recording shows them, too."""

from __future__ import annotations

import math
from collections.abc import Sequence

from etb_hil.discrepancy.fitting import free_run
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import all_unknowns, calibrate
from etb_hil.discrepancy.fitting.noise_floor import noise_floor_of, weigh
from etb_hil.discrepancy.search.findings import Findings
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import Vector
from etb_hil.results.explained.causes import ErrorWithAndWithout, Transfer

CARRIES = 0.02  # of the squared residual: what a cause must take of another recording to be carried over


def transfer(findings: Findings, others: Sequence[Balances]) -> tuple[Transfer, ...]:
    """Return for each cause and other recording the share of residual it explains.

    Base parameters are calibrated anew for the other recording, with and without the cause. In `free_run` they are not:
    all parameters are those of the search before the cause was found, and with it.
    """
    found = []
    for other in others:
        segments = [other]
        unknowns = all_unknowns(findings.model, segments)
        plain = calibrate(findings.model, segments)
        weigh(segments, noise_floor_of(findings.model, segments, plain.fit.whole, unknowns).level)
        plain = calibrate(findings.model, segments, plain.fit.whole)
        before = plain
        for each in findings.accepted:
            effect = each.winner.candidate.effect
            if effect is None:
                continue
            begin = before.fit.whole.copy()
            for place in effect.indices:
                begin[place] = findings.final.fit.whole[place]
            with_it = calibrate(findings.model, segments, begin, unknowns)
            gain = 1.0 - with_it.fit.cost / before.fit.cost
            carried = bool(gain > CARRIES)
            without, with_its = (_free_run(other, whole) for whole in (each.before.fit.whole, each.winner.fit.whole))
            unit = "m" if other.measured.device.is_linear else "rad"
            found.append(
                Transfer(
                    cause=effect.id,
                    recording=other.measured.origin,
                    explained_share=gain,
                    carried_over=carried,
                    free_run=ErrorWithAndWithout(without, with_its, unit),
                    text=_said(gain, without, with_its, unit),
                )
            )
            before = with_it if carried else before
    return tuple(found)


def _free_run(other: Balances, whole: Vector) -> float:
    """Return the rms error (rad, or m) of one free run over a whole recording."""
    angle = other.measured.angle
    return free_run.rms(free_run.trace(other, whole[:EXTENDED], 0, len(angle)) - angle)


def _said(gain: float, without: float, with_its: float, unit: str) -> str:
    if gain <= CARRIES:
        return f"it explains less than {100.0 * CARRIES:g} % of the residual there and is not carried over"
    times, shown = (1e3, "mm") if unit == "m" else (math.degrees(1.0), "deg")
    explained = f"it explains {100.0 * gain:.0f} % of the residual there, with base parameters fitted to that recording"
    freely = "with the first recording's parameters, the error of one free run is"
    return f"{explained}; {freely} {times * with_its:.3g} {shown} with it and {times * without:.3g} {shown} without it"
