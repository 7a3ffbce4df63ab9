"""Friction that has risen since a unit was first measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from etb_hil.histories.temperature import LEAST_SPREAD, TemperatureEffect, UnitLaws
from etb_hil.histories.tolerance import change_limit
from etb_hil.recording.samples import Float64


@dataclass(frozen=True, slots=True)
class Rise:
    """A unit whose latest run lies `rise` (share) above its first.

    The first began at `since`, ISO 8601.
    """

    unit: str
    rise: float
    since: str


@dataclass(frozen=True, slots=True)
class Rises:
    """What units say that were measured again.

    There are `looked_at` of them; `limit` is a share.

    `apart` are units whose latest run cannot be held against their first; an earlier run of theirs may have been.
    """

    looked_at: int
    limit: float
    found: list[Rise]
    apart: list[str]


def rises(
    started: Sequence[str], values: Float64, temperature: Float64, units: Sequence[str], laws: UnitLaws
) -> Rises | None:
    """Return the units that have risen, of values (n) in order of time.

    None where no unit was measured again.

    The law of temperature (n) in degC is taken out as the other units tell it: a unit that was tested warm after it
    had risen would tell one of its own. Without that law, only runs of a unit within 5 K are held against each other.
    """
    runs: dict[str, list[int]] = {}
    for k, unit in enumerate(units):
        if values[k] > 0.0:
            runs.setdefault(unit, []).append(k)
    again = {unit: places for unit, places in runs.items() if len(places) > 1}
    if not again:
        return None
    telling, whole = set(laws.name.tolist()), laws.together()
    compared: dict[str, _Compared] = {}
    for unit, places in again.items():
        law = laws.together(without=unit) if unit in telling else whole
        if (latest := _latest(places, values, temperature, law)) is not None:
            compared[unit] = latest
    level = change_limit(np.array([one.ratio for one in compared.values()]))
    found = [
        Rise(unit, math.expm1(one.ratio), started[one.since])
        for unit, one in compared.items()
        if one.ratio > level + one.uncertainty
    ]
    apart = [unit for unit, places in again.items() if unit not in compared or compared[unit].run != places[-1]]
    return Rises(len(compared), math.expm1(level), found, apart)


@dataclass(frozen=True, slots=True)
class _Compared:
    """The logarithm of a unit's value in `run` over its first, that of `since`.

    The comparison says how unsure its law leaves it.
    """

    ratio: float
    uncertainty: float
    since: int
    run: int


def _latest(
    places: Sequence[int], values: Float64, temperature: Float64, law: TemperatureEffect | None
) -> _Compared | None:
    """Return the last of some runs against the first of known temperature.

    None where none can be compared with it.
    """
    at = [k for k in places if math.isfinite(temperature[k])]
    for k in reversed(at[1:]):
        first, warmer = at[0], float(temperature[k] - temperature[at[0]])
        ratio = math.log(values[k] / values[first])
        if law is not None and np.all(law.carries(temperature[[first, k]], float(temperature[first]))):
            return _Compared(ratio - law.coefficient * warmer, float(law.uncertainty(warmer)), first, k)
        if abs(warmer) <= LEAST_SPREAD:
            return _Compared(ratio, 0.0, first, k)
    return None
