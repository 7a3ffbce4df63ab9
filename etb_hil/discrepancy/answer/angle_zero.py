"""Zero of the angle in another recording, of an encoder that starts anywhere."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import Calibration, calibrate
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.effect import Effect, Need
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector
from etb_hil.recording.samples import Float64

# `tests/discrepancy/test_transfer.py` checks these on drawn axes.
_IN_A_WAVE = 16  # shifts tried in the shortest wave: an effect has waves of twice its order, too
_IN_A_WIDTH = 2
_ELSEWHERE = 32  # widths in the overlap, for an effect that has neither a wave nor a width
_FITTED = 3  # of the shifts that explain most
SIZES = (0.7, 1.4)  # of a cause that another recording shows at another zero, over its size in the first
_SINGULAR = 1e-9  # of the largest singular value: directions that no sample determines
_EQUAL = 1e-3  # of the squared residual: shifts that differ by less are equally good, as those by a whole wave


def is_absolute(model: Model) -> bool:
    """Tell whether the angle has the same zero in every recording.

    Stops, springs and a pendulum of the model file have a place.
    """
    device = model.device
    has_place = device.is_throttle or device.has_stops or device.has_spring
    return has_place or any(Need.PENDULUM in CATALOGUE[entry.id].needs for entry in model.effects)


def shifts_for(effects: Sequence[Effect], whole: Vector, first: Float64, other: Balances) -> Float64:
    """Return the shifts (n; rad, or m) of an angle to try for effects.

    They cover half of the motor's turn, or of the longest wave, to either side. An effect without waves has all shifts
    by which the travel of the `first` angle (n) and that of the other recording overlap. `whole` has the effects'
    parameters.
    """
    turn, angle = 2.0 * math.pi / other.gear, other.measured.angle
    least, most = float(first.min() - angle.max()), float(first.max() - angle.min())
    ranges, steps = [], []
    for effect in effects:
        values = [(one, float(whole[k])) for one, k in zip(effect.stated, effect.stated_indices, strict=True)]
        waves = [turn / value for one, value in values if one.unit == "1/turn" and value > 0.0]
        waves += [2.0 * math.pi] if Need.PENDULUM in effect.needs else []
        widths = [value for one, value in values if one.is_width]
        if waves:
            half = 0.5 * max(turn, *waves)
            ranges.append((-half, half))
            steps.append(min(waves) / _IN_A_WAVE)
        else:
            ranges.append((least, most))
            steps.append(min(widths, default=(most - least) / _ELSEWHERE) / _IN_A_WIDTH)
    step = min(steps)
    # Half a step beyond both ends, so that a best shift at an end lies between two others.
    grids = [np.arange(math.floor(low / step - 0.5), math.ceil(high / step + 0.5) + 1) for low, high in ranges]
    return np.asarray(step * np.unique(np.concatenate(grids)), np.float64)


def shifted_fit(
    model: Model, other: Balances, before: Calibration, begin: Vector, shifts: Float64
) -> tuple[float, Calibration] | None:
    """Return the shift with which a cause explains most, and the calibration.

    The shift is in rad, or m. `before`: the calibration without the cause; `begin`: its whole vector with the cause.
    None where the cause has its size at no shift: one more free number explains a little of any residual.
    """
    if not np.isfinite(before.jacobian).all():
        return None
    costs, sizes = _linear(other, before, begin, shifts)
    around = [(k, costs[k - 1 : k + 2]) for k in range(1, len(costs) - 1)]
    lowest = [k for k, three in around if costs[k] == three.min() and np.isfinite(three).all()]
    minima = [_vertex(shifts, costs, k) for k in lowest if SIZES[0] < sizes[k] < SIZES[1]]
    likeliest = sorted(minima, key=lambda one: _order(one[0], one[1], before))[:_FITTED]
    fits = [(shift, calibrate(model, [other.shifted(shift)], begin, before.unknowns)) for shift, _ in likeliest]
    known = [one for one in fits if np.isfinite(one[1].fit.cost)]
    return min(known, key=lambda one: _order(one[0], one[1].fit.cost, before), default=None)


def _order(shift: float, cost: float, before: Calibration) -> tuple[float, float]:
    """Return the sort key of a shift: by its cost, then by its size."""
    return round(cost / before.fit.cost / _EQUAL), abs(shift)


def _linear(other: Balances, before: Calibration, begin: Vector, shifts: Float64) -> tuple[Float64, Float64]:
    """Return by shift (n) the sum of squares, and the size that fits best.

    The size is a share of the cause's own. The unknowns are fitted linearly: what they can explain is the column space
    of their Jacobian.
    """
    columns, scales, _ = np.linalg.svd(before.jacobian, full_matrices=False)
    columns = columns[:, scales > _SINGULAR * scales[0]]

    def unexplained(residual: Float64) -> Float64:
        return np.asarray(residual - columns @ (columns.T @ residual), np.float64)

    without = unexplained(before.fit.residual)
    costs, sizes = np.empty((2, len(shifts)))
    for k, shift in enumerate(shifts):
        left = unexplained(other.shifted(float(shift)).residual(begin[:EXTENDED], begin[EXTENDED:]))
        change = left - without
        costs[k] = left @ left
        sizes[k] = -(change @ without) / max(float(change @ change), 1e-30)
    return costs, sizes


def _vertex(shifts: Float64, costs: Float64, k: int) -> tuple[float, float]:
    """Return shift and cost at the vertex of a parabola through a minimum at k."""
    before, at, after = costs[k - 1 : k + 2]
    bend = before - 2.0 * at + after
    off = 0.5 * (before - after) / bend if bend > 0.0 else 0.0
    return float(shifts[k] + off * (shifts[1] - shifts[0])), float(at - 0.25 * (before - after) * off)
