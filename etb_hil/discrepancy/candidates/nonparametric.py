"""Nonparametric terms: splines fitted on top of the best candidate.

They show that something remains, and where.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.discrepancy.fitting.balances import CHANNELS, Balances
from etb_hil.discrepancy.fitting.fit import Fit, box_least_squares
from etb_hil.discrepancy.fitting.unknowns import Unknown, box_of
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import RESISTANCE, TORQUE_PER_AMPERE, Vector
from etb_hil.recording.samples import Float64
from etb_hil.results.explained.residual import NonparametricTerm

_KNOTS = 9
_RIDGE = 1e-6
_ON_EDGE = 1e-3  # tolerances
_DRIVES = (TORQUE_PER_AMPERE, RESISTANCE)


def beyond_tolerances(
    jacobian: Float64, fit: Fit, unknowns: Sequence[Unknown], *, is_electrical: bool
) -> NonparametricTerm:
    """Return what parameters on their tolerances would explain beyond them.

    Without an electrical balance (`is_electrical`), what turns the drive into torque stays: with it all terms together
    could shrink to nothing, whatever is wrong.
    """
    x = np.array([u.x_of(fit.whole) for u in unknowns])
    low, high = _within_box(fit, unknowns)
    normal, right = jacobian.T @ jacobian + _RIDGE * np.eye(len(x)), -jacobian.T @ fit.residual
    inside = _gain(normal, right, low, high)
    for k, unknown in enumerate(unknowns):
        if (
            unknown.is_toleranced
            and (is_electrical or unknown.place not in _DRIVES)
            and (low[k] > -_ON_EDGE or high[k] < _ON_EDGE)
        ):
            free = unknown.free()
            low[k], high[k] = free.low - x[k], free.high - x[k]
    share = (_gain(normal, right, low, high) - inside) / max(fit.cost, 1e-12)
    return NonparametricTerm("all", "base parameters beyond their tolerances", "neither", share)


def in_their_own_balances(
    balances: Sequence[Balances], jacobian: Float64, fit: Fit, unknowns: Sequence[Unknown]
) -> list[NonparametricTerm]:
    """Return what splines explain of a residual in one balance each, largest first.

    That is given what the parameters inside their bounds explain in that balance alone. Two balances constrain a shared
    parameter: if one lacks something, a spline in the other frees the parameter, and explains much although nothing is
    missing there.
    """
    low, high = _within_box(fit, unknowns)
    banks = [_bank(b, fit.whole[:EXTENDED]) for b in balances]
    found = []
    for channel, name in enumerate(CHANNELS):
        counted = np.concatenate([np.repeat(np.arange(3) == channel, b.samples) for b in balances])
        own, left = jacobian[counted], fit.residual[counted]
        base = _gain(own.T @ own + _RIDGE * np.eye(len(low)), -own.T @ left, low, high)
        for key in (key for key in banks[0] if key[0] == name):
            splines = np.concatenate([bank[key] for bank in banks])[counted]
            both = np.column_stack([own, splines])
            ridge = [*np.full(len(low), _RIDGE), *np.full(_KNOTS, _RIDGE * float(np.sum(splines**2)) + _RIDGE)]
            free = np.full(_KNOTS, np.inf)
            normal = both.T @ both + np.diag(ridge)
            took = _gain(normal, -both.T @ left, np.concatenate([low, -free]), np.concatenate([high, free])) - base
            found.append(NonparametricTerm(*key, took / max(fit.cost, 1e-12)))
    return sorted(found, key=lambda spline: -spline.explained_share)


def _within_box(fit: Fit, unknowns: Sequence[Unknown]) -> tuple[Float64, Float64]:
    """Return how far unknowns may still go down and up from their fit."""
    x = np.array([u.x_of(fit.whole) for u in unknowns])
    low, high = box_of(unknowns)
    return np.minimum(low, x) - x, np.maximum(high, x) - x


def _gain(normal: Float64, right: Float64, low: Float64, high: Float64) -> float:
    step = box_least_squares(normal, right, low, high)
    return float(2.0 * right @ step - step @ normal @ step)


def _bank(b: Balances, p: Vector) -> dict[tuple[str, str, str], Float64]:
    """Return the splines (3 m, knots) of one segment, whitened and weighted."""
    angle, velocity = b.motion(p)
    m = b.measured
    seconds = np.arange(len(m), dtype=np.float64) * m.dt
    direction = np.tanh(velocity / 0.05)
    hats = {
        "angle": _hats(angle),
        "velocity": _hats(np.arcsinh(velocity / 0.3)),
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
    """Return splines (n, knots) of a balance as in the residual (3 m, knots)."""
    spectrum = b.spectrum
    out = np.zeros((3 * b.samples, splines.shape[1]))
    part = slice(channel * b.samples, (channel + 1) * b.samples)
    for k in range(splines.shape[1]):
        out[part, k] = spectrum.back(spectrum.of(splines[:, k]) * b.whitening(channel)) * b.weights[part]
    return out


def _hats(x: Float64) -> Float64:
    """Return linear splines (n, knots) over a coordinate, knots at its quantiles.

    Knots that coincide are empty, so that every segment of a record has as many, wherever it rests for long.
    """
    knots = np.unique(np.quantile(x, np.linspace(0.0, 1.0, _KNOTS)))
    if len(knots) < 3:
        knots = np.linspace(float(x.min()) - 1e-9, float(x.max()) + 1e-9, 3)
    apart = [np.interp(x, knots, sample) for sample in np.eye(len(knots))]
    return np.column_stack(apart + [np.zeros(len(x))] * (_KNOTS - len(knots)))
