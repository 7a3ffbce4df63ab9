"""Terms of a record: of the bench, and of friction that drifts.

A plate's sensor has a zero of its own. Friction that drifts over time is a hypothesis without a name: use does
that, and so does a lubricant. Its share of the friction is a polygon over time whose knots have the mean 0. While T_c
stays inside its tolerance, the model is right.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from etb_hil.estimation.climbing import Fitted
from etb_hil.estimation.filtering import Column
from etb_hil.estimation.forces import AT_PLATE, LEVEL
from etb_hil.estimation.record import Record, Term
from etb_hil.estimation.unknown import Unknown
from etb_hil.hypotheses.constants import BEYOND, CHANCE, DRIFTS, KNOTS, ZERO
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import COULOMB
from etb_hil.recording.samples import Float64

DRIFT = "friction over time"
BENCH = ("plate_zero",)  # the first terms


@dataclass(frozen=True, slots=True)
class Drift:
    """A polygon over time; `parameters` is the whole vector without it."""

    parameters: Float64

    @property
    def id(self) -> str:
        """The id of the hypothesis."""
        return DRIFT

    def unknowns(self) -> list[Unknown]:
        """Return the sizes at the knots."""
        return drift_unknowns()

    def columns(self) -> list[Column]:
        """Return the columns of the sizes."""
        return [one.column() for one in self.unknowns()]

    def at(self, sizes: Float64) -> Float64:
        """Return the whole vector with sizes at the knots."""
        found = self.parameters.copy()
        found[EXTENDED + len(BENCH) :] = np.clip(sizes, -DRIFTS, DRIFTS)
        return found


def with_terms(record: Record) -> Record:
    """Return a record that may have terms of its bench, and a drift of friction."""
    knots = np.linspace(record.elapsed[0], record.elapsed[-1], KNOTS)
    # T_c is the mean of the knots: a drift that could raise it would be likelier than friction raised everywhere.
    drifts = [Term(LEVEL, np.interp(record.elapsed, knots, one)) for one in np.eye(KNOTS) - 1.0 / KNOTS]
    return replace(record, terms=(Term(AT_PLATE, np.ones(len(record))), *drifts))


def with_room(parameters: Float64) -> Float64:
    """Return a whole vector with room for the sizes of all terms."""
    return np.concatenate([parameters[:EXTENDED], np.zeros(len(BENCH) + KNOTS)])


def bench_unknowns(record: Record) -> list[Unknown]:
    """Return the sizes of the bench's terms that a record shows."""
    _, motor, plate = (bool(np.isfinite(one).any()) for one in record.readings.T)
    zero = Unknown(BENCH[0], EXTENDED, 0.0, ZERO / np.sqrt(3.0), ZERO, term=0)
    return [zero] if motor and plate else []


def friction_over_time(fit: Fitted) -> tuple[Float64, Float64]:
    """Return T_c at each knot of a fit with a drift (k), and its covariance (k, k)."""
    names, sizes = [one.name for one in fit.unknowns], fit.parameters[EXTENDED + len(BENCH) :]
    first, share = names.index(drift_unknowns()[0].name), 1.0 + sizes - sizes.mean()
    slopes = np.zeros((KNOTS, len(names)))
    slopes[:, [one.place == COULOMB for one in fit.unknowns]] = share[:, None]
    slopes[:, first : first + KNOTS] = fit.parameters[COULOMB] * (np.eye(KNOTS) - 1.0 / KNOTS)
    return fit.parameters[COULOMB] * share, slopes @ fit.covariance @ slopes.T


def drifts_in_tolerance(fit: Fitted) -> bool:
    """Tell whether T_c of a fit with a drift is nowhere shown to leave its tolerance.

    Where T_c is a cause itself, the tolerance is about its mean. Without a tolerance it is not inside it.
    """
    friction, covariance = friction_over_time(fit)
    stated = next((one for one in fit.unknowns if one.place == COULOMB), None)
    if stated is None:
        return False
    is_cause = not np.isfinite(stated.reach)
    mean, reach = (friction.mean(), stated.deviation / BEYOND) if is_cause else (stated.mean, stated.reach)
    shown = np.abs(friction - mean) - CHANCE * np.sqrt(np.diag(covariance))
    return bool(np.all(shown <= reach))


def least_change(fit: Fitted) -> float:
    """Return by which share of its mean a drift changes friction at least."""
    friction, covariance = friction_over_time(fit)
    variances = np.diag(covariance)
    apart = np.sqrt(np.maximum(variances[:, None] + variances - 2.0 * covariance, 0.0))
    shown = np.abs(friction[:, None] - friction) - CHANCE * apart
    return float(shown.max() / friction.mean())


def drift_unknowns() -> list[Unknown]:
    """Return the sizes of a drift at its knots; each is a share of the friction."""
    first = len(BENCH)
    return [
        Unknown(f"{DRIFT}.{k}", EXTENDED + k, 0.0, DRIFTS / np.sqrt(3.0), low=-DRIFTS, high=DRIFTS, term=k)
        for k in range(first, first + KNOTS)
    ]
