"""Waves over the motor's turn, by the order spectrum of the torque disturbance."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from etb_hil.estimation.climbing import Fitted
from etb_hil.estimation.filtering import smoothed
from etb_hil.estimation.record import Record
from etb_hil.estimation.throttle import OMEGA, THETA, TORQUE, VOLTAGE
from etb_hil.hypotheses.candidates import FittedEffect
from etb_hil.plant.effects.effect import Effect
from etb_hil.plant.physics import GEAR_RATIO, RESISTANCE, TORQUE_PER_AMPERE
from etb_hil.recording.samples import Float64

_FINER = 2  # values of the spectrum for each order that the motion can tell from the next (zero padding)
_FILLED = 4  # bins for each value at most


def several(record: Record, before: Fitted, effects: Iterable[Effect]) -> list[FittedEffect]:
    """Return candidates with one wave, with two, and so on, of the strongest orders.

    They are of effects that have further waves (`EffectParameter.under`), of drives.
    """
    found = []
    for effect in effects:
        places = [k for k, one in zip(effect.stated_indices, effect.stated, strict=True) if one.under == one.name]
        if not places:
            continue
        first = next(one for one in effect.parameters if one.unit == "1/turn")
        if first.is_count:
            continue  # of one motor whose slots and poles have one count, further waves would fit any curve
        orders = strongest(record, before, len(places) + 1, first.low, first.high)
        p = before.parameters.copy()
        for order, place in zip(orders, [effect.place(first.name), *places], strict=False):
            p = p.copy()
            p[place] = order
            found.append(FittedEffect(effect, p))
    return found


def strongest(record: Record, before: Fitted, most: int, low: float, high: float) -> list[float]:
    """Return the orders of the strongest waves of the torque that a model lacks.

    One is found after the other, each beside those before it (matching pursuit, Mallat and Zhang 1993), and beside the
    double of the first. What the motion does not tell from a whole number is one: slots and poles are.
    """
    p = before.parameters
    states = smoothed(record, p, before.disturbance)
    moves = np.abs(states[:, OMEGA]) > before.filtered.rests
    angle = p[GEAR_RATIO] * states[moves, THETA]
    lacks = states[moves, TORQUE] + p[TORQUE_PER_AMPERE] / p[RESISTANCE] * states[moves, VOLTAGE]
    if len(angle) < 2:
        return []
    found: list[float] = []
    waves = [np.ones(len(angle)), np.sign(states[moves, OMEGA])]
    for _ in range(most):
        shapes = np.column_stack(waves)
        residual = lacks - shapes @ np.linalg.lstsq(shapes, lacks, rcond=None)[0]
        order = _peak(angle, residual, low, high)
        if abs(order - round(order)) * np.ptp(angle) < 2.0 * math.pi:
            order = max(float(round(order)), low)
        for multiple in (1.0,) if found else (1.0, 2.0):
            waves += [np.sin(multiple * order * angle), np.cos(multiple * order * angle)]
        found.append(order)
    return found


def _peak(angle: Float64, values: Float64, low: float, high: float) -> float:
    """Return the order of the largest wave of values over an angle in rad."""
    # Two for each half wave of the highest order, and no more than the values can fill: a travel may be of any length.
    bins = min(max(math.ceil(2.0 * high * np.ptp(angle) / math.pi), 1), _FILLED * len(values))
    place = np.minimum(((angle - angle.min()) / max(np.ptp(angle), 1e-9) * bins).astype(np.int64), bins - 1)
    sums = np.bincount(place, values, bins)
    spectrum = np.abs(np.fft.rfft(sums, _FINER * bins))
    orders = 2.0 * math.pi / np.ptp(angle) / _FINER * np.arange(len(spectrum))
    return float(orders[np.argmax(np.where((orders >= low) & (orders <= high), spectrum, -1.0))])
