"""Plausibility of what drives an axis, by its work: its unit and its sign."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from etb_hil.base.errors import InputError, Problem
from etb_hil.discrepancy.measured.device_roles import drives_of
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.plant.drive_effects import gravity
from etb_hil.plant.parameters import Model

_BLOCK = 0.02  # s: over it an encoder's noise is no way that friction brakes
_HALFWAY = 30.0  # times: the geometric mean of 1 and 1,000, what an A and an mA differ by
_BACKWARDS = 1.0 / 3.0  # of what friction takes: the model's may be off


def must_do_its_work(segments: Sequence[Measurement], model: Model) -> None:
    """Refuse a current or force that does no such work as the motion takes.

    Its work is what friction takes, and what mass, load and springs may keep. That of a motor in volts is judged by its
    winding.
    """
    for m in segments:
        if m.device.has_winding:
            continue
        role = " or ".join(drives_of(m.device))
        work = float(m.voltage[:-1] @ np.diff(m.angle)) * model.values.torque_per_ampere / model.values.resistance
        taken, kept = _taken(m, model), _kept(m, model)
        if work < -_BACKWARDS * taken - kept:
            what = f"the angle moves opposite to {role}"
            remedy = f"invert the sign of the angle, or that of {role}"
        elif work > _HALFWAY * (taken + kept):
            what = f"{role} does {work / (taken + kept):.3g} times the work that the model's friction and mass take"
            remedy = f"check the unit of {role} (mA or A, mN or N) in the column's header or in the map"
        elif abs(work) + kept < taken / _HALFWAY:
            what = f"{role} does {work / taken:.2g} of the work that the model's friction takes"
            remedy = f"check the unit of {role} (A or mA, N or kN) in the column's header or in the map"
        else:
            continue
        raise InputError(Problem(f"{m.origin}: {what}", remedy=remedy))


def _taken(m: Measurement, model: Model) -> float:
    """Return the work in J that friction takes over a segment, by the model."""
    many = max(round(_BLOCK * m.rate), 1)
    ways = np.diff(m.angle[: len(m) // many * many].reshape(-1, many).mean(axis=1))
    return float(model.values.coulomb * np.abs(ways).sum() + model.values.viscous * (ways @ ways) * m.rate / many)


def _kept(m: Measurement, model: Model) -> float:
    """Return the work in J that mass, load and spring may keep over a segment."""
    v, travel = model.values, float(np.ptp(m.angle))
    fastest = float(np.abs(np.gradient(m.angle)).max()) * m.rate
    hangs = math.hypot(*model.vector()[list(gravity().stated_indices)])
    load = max(abs(v.preload_open), abs(v.preload_close)) + 0.5 * max(v.slope_open, v.slope_close) * travel
    return 0.5 * v.inertia * fastest * fastest + load * travel + 2.0 * hangs
