"""Splines without a name, fitted on top of the winner: they say that something is left, and where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.fitting.balances import CHANNELS, Balances
from etb_hil.discrepancy.fitting.boxed import boxed
from etb_hil.discrepancy.fitting.fit import Fit
from etb_hil.discrepancy.fitting.unknowns import Unknown
from etb_hil.discrepancy.measured.spectrum import Spectrum
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import Vector

Float64 = NDArray[np.float64]

_KNOTS = 9
_RIDGE = 1e-6
_ON_EDGE = 1e-3  # tolerances


@dataclass(frozen=True, slots=True)
class Placeholder:
    """A spline's take: of which balance, over what, of which parity, and the share of the rest that it explains."""

    balance: str
    over: str
    parity: str
    share: float


def placeholders(
    balances: Sequence[Balances],
    p: Vector,
    columns: Float64,
    residual: Float64,
    counts: NDArray[np.bool_] | None = None,
) -> list[Placeholder]:
    """Return what splines take of a residual (n) beside the model's own columns (n, unknowns), the greediest first.

    `counts`: the samples (n) that are looked at, where not all are.
    """
    rows = np.ones(len(residual)) if counts is None else counts.astype(np.float64)
    columns, residual = columns * rows[:, None], residual * rows
    lengths = np.linalg.norm(columns, axis=0)
    basis = np.linalg.qr(columns[:, lengths > 1e-9] / lengths[lengths > 1e-9])[0]
    left = residual - basis @ (basis.T @ residual)
    total = max(float(left @ left), 1e-12)
    banks = [_bank(b, p) for b in balances]
    found = []
    for key in banks[0]:
        splines = np.concatenate([bank[key] for bank in banks]) * rows[:, None]
        splines = splines - basis @ (basis.T @ splines)
        normal = splines.T @ splines
        if not normal.any():
            continue  # nothing moves that they are over
        right = splines.T @ left
        took = float(right @ np.linalg.solve(normal + _RIDGE * np.trace(normal) * np.eye(len(right)), right))
        found.append(Placeholder(*key, share=took / total))
    return sorted(found, key=lambda spline: -spline.share)


def beyond_tolerances(columns: Float64, fit: Fit, unknowns: Sequence[Unknown]) -> Placeholder:
    """Return what base parameters on the edges of their tolerances would take of a fit's rest beyond them."""
    x = np.array([u.x_of(fit.whole) for u in unknowns])
    low, high = _room(fit, unknowns)
    normal, right = columns.T @ columns + _RIDGE * np.eye(len(x)), -columns.T @ fit.residual
    inside = _gain(normal, right, low, high)
    for k, unknown in enumerate(unknowns):
        if unknown.is_toleranced and (low[k] > -_ON_EDGE or high[k] < _ON_EDGE):
            free = unknown.free()
            low[k], high[k] = free.low - x[k], free.high - x[k]
    share = (_gain(normal, right, low, high) - inside) / max(fit.cost, 1e-12)
    return Placeholder("all", "base parameters beyond their tolerances", "neither", share)


def in_their_own_balances(
    balances: Sequence[Balances], columns: Float64, fit: Fit, unknowns: Sequence[Unknown]
) -> list[Placeholder]:
    """Return what splines take of a fit's rest in one balance each, the greediest first.

    It is beside what the numbers inside their bounds take in that balance alone. Two balances hold a number that they
    share: where one lacks something, a spline in the other lets it go there, and takes much of the rest though nothing
    is missing where it is.
    """
    low, high = _room(fit, unknowns)
    banks = [_bank(b, fit.whole[:EXTENDED]) for b in balances]
    found = []
    for channel, name in enumerate(CHANNELS):
        rows = np.concatenate([np.repeat(np.arange(3) == channel, b.rows) for b in balances])
        own, left = columns[rows], fit.residual[rows]
        base = _gain(own.T @ own + _RIDGE * np.eye(len(low)), -own.T @ left, low, high)
        for key in (key for key in banks[0] if key[0] == name):
            splines = np.concatenate([bank[key] for bank in banks])[rows]
            both = np.column_stack([own, splines])
            ridge = [*np.full(len(low), _RIDGE), *np.full(_KNOTS, _RIDGE * float(np.sum(splines**2)) + _RIDGE)]
            free = np.full(_KNOTS, np.inf)
            normal = both.T @ both + np.diag(ridge)
            took = _gain(normal, -both.T @ left, np.concatenate([low, -free]), np.concatenate([high, free])) - base
            found.append(Placeholder(*key, share=took / max(fit.cost, 1e-12)))
    return sorted(found, key=lambda spline: -spline.share)


def _room(fit: Fit, unknowns: Sequence[Unknown]) -> tuple[Float64, Float64]:
    """Return how far unknowns may still go down and up from where a fit has them."""
    x = np.array([u.x_of(fit.whole) for u in unknowns])
    return np.minimum([u.low for u in unknowns], x) - x, np.maximum([u.high for u in unknowns], x) - x


def _gain(normal: Float64, right: Float64, low: Float64, high: Float64) -> float:
    step = boxed(normal, right, low, high)
    return float(2.0 * right @ step - step @ normal @ step)


def _bank(b: Balances, p: Vector) -> dict[tuple[str, str, str], Float64]:
    """Return the splines (3 m, knots) of one segment, whitened and weighted as the residual is."""
    angle, velocity = b.motion(p)
    m = b.measured
    seconds = np.arange(len(m), dtype=np.float64) * m.dt
    bent: Float64 = np.arcsinh(velocity / 0.3)
    direction = np.tanh(velocity / 0.05)
    hats = {
        "angle": _hats(angle),
        "velocity": _hats(bent),
        # Their sum is one: what a constant does is the base model's, to the last digit of how it was filtered.
        "time": _hats(seconds) - 1.0 / _KNOTS,
    }
    torque = {
        ("torque", "angle", "odd"): hats["angle"] * direction[:, None],
        ("torque", "angle", "even"): hats["angle"],
        ("torque", "velocity", "odd"): hats["velocity"],
        ("torque", "time", "odd"): hats["time"] * direction[:, None],
        ("torque", "time", "even"): hats["time"],
        ("torque", "angle, times velocity", "odd"): hats["angle"] * velocity[:, None],
    }
    found = {key: filtered(b, splines, 0) for key, splines in torque.items()}
    if b.has[1] and m.current is not None:
        current = m.current
        for key, splines in {
            ("voltage", "current", "odd"): _hats(current),
            ("voltage", "time, times current", "odd"): hats["time"] * current[:, None],
            ("voltage", "time, times velocity", "odd"): hats["time"] * velocity[:, None],
            ("voltage", "angle", "even"): hats["angle"],
        }.items():
            found[key] = filtered(b, splines, 1)
    if b.has[2]:
        found[("angle", "angle", "even")] = filtered(b, hats["angle"], 2)
        found[("angle", "angle", "odd")] = filtered(b, hats["angle"] * direction[:, None], 2)
    return found


def filtered(b: Balances, splines: Float64, channel: int) -> Float64:
    """Return what splines (n, knots) in a balance are in the residual (3 m, knots), whitened and weighted as it is."""
    spectrum: Spectrum = b.spectrum
    out = np.zeros((3 * b.rows, splines.shape[1]))
    part = slice(channel * b.rows, (channel + 1) * b.rows)
    for k in range(splines.shape[1]):
        out[part, k] = spectrum.back(spectrum.of(splines[:, k]) * b.whitening(channel)) * b.weights[part]
    return out


def _hats(x: Float64) -> Float64:
    """Return linear splines (n, knots) over a coordinate, as many rows about each knot; nothing in those that coincide.

    Every segment of a record has as many, wherever it rests for long.
    """
    knots = np.unique(np.quantile(x, np.linspace(0.0, 1.0, _KNOTS)))
    if len(knots) < 3:
        knots = np.linspace(float(x.min()) - 1e-9, float(x.max()) + 1e-9, 3)
    apart = [np.interp(x, knots, row) for row in np.eye(len(knots))]
    return np.column_stack(apart + [np.zeros(len(x))] * (_KNOTS - len(knots)))
