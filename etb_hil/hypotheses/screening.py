"""Find the likeliest shape of each effect by one pass over the record.

The pass is linear about a fitted model.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.estimation.calibration import Fitted, prior_slope
from etb_hil.estimation.filtering import sensitivities
from etb_hil.estimation.record import Record
from etb_hil.hypotheses.candidates import Candidate
from etb_hil.recording.samples import Float64


def screened(record: Record, fit: Fitted, candidates: Sequence[Candidate]) -> dict[str, Float64]:
    """Return the vector with each effect's likeliest shape and strengths, by id."""
    base = [one.column() for one in fit.unknowns]
    columns, groups = list(base), [-1] * len(base)
    for number, one in enumerate(candidates):
        its = one.columns()
        columns += its
        groups += [number] * len(its)
    normal = sensitivities(record, fit.filtered, columns, groups=groups)
    count = len(base)
    scale = np.array([one.deviation for one in fit.unknowns])
    slope, bends = prior_slope(fit.parameters, fit.unknowns)
    known = normal.matrix[:count, :count] * np.outer(scale, scale) + np.diag(bends)
    push = slope - normal.gradient[:count] * scale
    best: dict[str, tuple[float, Float64]] = {}
    for number, one in enumerate(candidates):
        at = [k for k in range(count, len(columns)) if groups[k] == number]
        places = [columns[k].place for k in at]
        widths = np.array([one.width(place) for place in places])
        cross = normal.matrix[np.ix_(at, range(count))] * np.outer(widths, scale)
        solved = np.linalg.solve(known, np.column_stack([push, cross.T]))
        slopes = -normal.gradient[at] * widths - cross @ solved[:, 0]
        whole = normal.matrix[np.ix_(at, at)] * np.outer(widths, widths) - cross @ solved[:, 1:] + np.eye(len(at))
        strengths = np.linalg.solve(whole, slopes)
        evidence = 0.5 * float(slopes @ strengths - np.linalg.slogdet(whole)[1])
        if evidence > best.get(one.effect.id, (-np.inf,))[0]:
            best[one.effect.id] = evidence, one.at(places, strengths * widths)
    return {id_: parameters for id_, (_, parameters) in best.items()}
