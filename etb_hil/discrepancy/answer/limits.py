"""What would have been seen: the smallest strength of each effect that these data could not have hidden."""

from __future__ import annotations

import numpy as np

from etb_hil.discrepancy.fitting.calibration import Calibration
from etb_hil.discrepancy.suspects.screening import Screened
from etb_hil.plant.drive_effects import unit_for

_SIGMAS = 3.0
_CORRELATED = 4.0  # rows of the band-limited, coloured residual that are one independent value


def detection_limits(
    before: Calibration, screened: list[Screened], least_gain: float, *, is_linear: bool
) -> dict[str, dict[str, object]]:
    """Return by effect the strength that would stand out by three sigma and by the gain that is asked of a cause.

    Where that is more than the effect's bounds allow, it is not `within_bounds`: there is no limit, and it says why.
    """
    fit = before.fit
    scale = float(np.sqrt(fit.cost / max(int(np.count_nonzero(fit.residual)), 1)))
    found: dict[str, dict[str, object]] = {}
    for one in screened:
        effect = one.candidate.effect
        if effect is None:
            continue
        if one.shows <= 0.0:
            continue
        unknown = one.candidate.strengths[0]
        by_noise = _SIGMAS * scale * np.sqrt(_CORRELATED) / one.shows
        by_gain = float(np.sqrt(least_gain * fit.cost)) / one.shows
        parameter = effect.parameters[effect.searched[0]]
        least, most = float(max(by_noise, by_gain)), max(-unknown.low, unknown.high)
        unit = unit_for(parameter, is_linear=is_linear)
        found[effect.id] = {
            "parameter": parameter.name,
            "limit": least * unknown.scale if least <= most else None,
            "unit": unit,
            "within_bounds": least <= most,
            "says": "" if least <= most else _unseen(most * unknown.scale, unit),
        }
    return found


def _unseen(most: float, unit: str) -> str:
    its = "" if unit == "1" else f" {unit}"
    return f"these data cannot show it, however large: {most:.3g}{its}, the most that it may be, would not stand out"
