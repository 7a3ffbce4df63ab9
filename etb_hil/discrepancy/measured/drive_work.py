"""Plausibility of what drives an axis, by its work: its unit and its sign."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.base.errors import InputError, Problem
from etb_hil.discrepancy.measured.device_roles import drives_of
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.plant.drive_effects import gravity
from etb_hil.plant.parameters import Model

_BLOCK = 0.02  # s: positions are averaged over it, or an encoder's noise would count as a way against friction
_HALFWAY = 30.0  # times: the geometric mean of 1 and 1,000, what an A and an mA differ by
_BACKWARDS = 1.0 / 3.0  # of what friction takes: the model's may be off
_LATE = 0.02  # s by which filters and buses make a reading late: its work is that of another instant


def must_do_its_work(segments: Sequence[Measurement], model: Model) -> None:
    """Refuse a current or force that does no such work as the motion takes.

    Its work is what friction takes, and what mass, load and springs may keep. That of a motor in volts is judged by its
    winding.
    """
    driven = [_Work.of(m, model) for m in segments if not m.device.has_winding]
    if not driven:
        return
    m, role = segments[0], " or ".join(drives_of(segments[0].device))
    done, to_and_fro, taken, most, unsure = (
        sum(getattr(one, name) for one in driven) for name in ("done", "to_and_fro", "taken", "most", "unsure")
    )
    if to_and_fro < -_BACKWARDS * taken - unsure:
        what = f"the angle moves opposite to {role}"
        remedy = f"invert the sign of the angle, or that of {role}"
    elif done > _HALFWAY * most:
        what = f"{role} does {done / most:.3g} times the work that the model's friction and mass take"
        remedy = f"check the unit of {role} (mA or A, mN or N) in the column's header or in the map"
    elif abs(done) + unsure < taken / _HALFWAY:
        what = f"{role} does {done / taken:.2g} of the work that the model's friction takes"
        remedy = f"check the unit of {role} (A or mA, N or kN) in the column's header or in the map"
    else:
        return
    raise InputError(Problem(f"{m.origin}: {what}", remedy=remedy))


@dataclass(frozen=True, slots=True)
class _Work:
    """Work in J over a segment.

    `done` by the drive; `to_and_fro`: without what a constant load may do on the way from begin to end. `taken` by the
    model's friction, along a way without an encoder's noise; `most`: along every sample, and with what mass, load and
    springs of the model may keep. `unsure`: what these may keep, with what late readings may seem to do.
    """

    done: float
    to_and_fro: float
    taken: float
    most: float
    unsure: float

    @classmethod
    def of(cls, m: Measurement, model: Model) -> _Work:
        """Return the work over a segment."""
        v = model.values
        torque, many = m.voltage * v.torque_per_ampere / v.resistance, max(round(_BLOCK * m.rate), 1)
        slow = np.stack([torque, m.angle])[:, : len(m) // many * many].reshape(2, -1, many).mean(axis=2)
        pushes, ways = np.diff(slow)
        middle, steps = 0.5 * (torque[:-1] + torque[1:]), np.diff(m.angle)
        fastest = float(np.abs(np.gradient(m.angle)).max()) * m.rate
        hangs = math.hypot(*model.vector()[list(gravity().stated_indices)])
        load = max(abs(v.preload_open), abs(v.preload_close)) + 0.5 * max(v.slope_open, v.slope_close) * np.ptp(m.angle)
        kept = 0.5 * v.inertia * fastest * fastest + load * np.ptp(m.angle) + 2.0 * hangs
        late = _LATE * abs(float(pushes @ ways)) * m.rate / many
        along = float(v.coulomb * np.abs(steps).sum() + v.viscous * fastest**2 * len(m) / m.rate)
        return cls(
            done=float(middle @ steps),
            to_and_fro=float((middle - middle.mean()) @ steps),
            taken=float(v.coulomb * np.abs(ways).sum() + v.viscous * (ways @ ways) * m.rate / many),
            most=float(along + kept),
            unsure=float(kept + late),
        )
