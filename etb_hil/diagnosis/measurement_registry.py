"""The registry of measurements.

Each file of `measurements/` holds one as `MEASUREMENT`; plug-ins add theirs.
"""

from __future__ import annotations

import math
import pkgutil
import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING

from etb_hil.base.errors import InputError
from etb_hil.base.plugins import Part, parts, when_changed
from etb_hil.diagnosis import measurements
from etb_hil.diagnosis.measurement_kind import Estimate, FailedEstimate, MeasurementKind, misstatements

if TYPE_CHECKING:
    from collections.abc import Callable

    from etb_hil.diagnosis.findings import Findings
    from etb_hil.diagnosis.measurement_kind import Found


@cache
def measurement_kinds() -> Mapping[str, MeasurementKind]:
    """Return the declarations of all measurements by id.

    They are in the order in which people read them. Raises InputError where a plug-in's declaration breaks the
    contract.
    """
    names = [module.name for module in pkgutil.iter_modules(measurements.__path__)]
    kinds: list[MeasurementKind] = [import_module(f"{measurements.__name__}.{name}").MEASUREMENT for name in names]
    for part in parts("measurements"):
        part.require(MeasurementKind)
        for name in ("id", "name", "unit"):
            part.require_text(name, getattr(part.value, name))
        if wrong := misstatements(part.value, {kind.id for kind in kinds}):
            raise InputError(*(problem for one in wrong for problem in part.refused(one).problems))
        kinds.append(replace(part.value, compute=_guarded(part)))
    return {kind.id: kind for kind in sorted(kinds, key=lambda kind: (kind.order, kind.id))}


def kind_of(measurement_id: str) -> MeasurementKind | None:
    """Return the declaration of a measurement by its id, None for any other id.

    The id may also be that of one of its several values.
    """
    kinds = measurement_kinds()
    return kinds.get(measurement_id) or next(
        (
            kind
            for kind in kinds.values()
            if kind.suffixes and re.fullmatch(f"{re.escape(kind.id)}_(?:{kind.suffixes})", measurement_id)
        ),
        None,
    )


def name_of(measurement_id: str) -> str:
    """Return the declared name of a measurement by its id, or the id itself."""
    kind = kind_of(measurement_id)
    return measurement_id if kind is None else kind.name_of(measurement_id.removeprefix(kind.id))


@cache
def phases_needed() -> frozenset[str]:
    """Return the kinds of phase whose samples some measurement is taken from."""
    return frozenset(phase for kind in measurement_kinds().values() for phase in kind.phases)


def _guarded(part: Part) -> Callable[[Findings], Found]:
    """Return the function of a plug-in's measurement, guarded against its faults.

    Where it fails, it gives no value and says why. What was recorded and all other measurements outlive a fault of a
    plug-in.
    """
    compute = part.value.compute

    def guarded(run: Findings) -> Found:
        try:
            with part.guarded("computing"):
                found = compute(run)
                return found if found is None else _estimates((found,) if isinstance(found, Estimate) else found)
        except InputError as error:
            return FailedEstimate(None, note=f"the plug-in failed: {error}")

    return guarded


def _estimates(found: Iterable[Estimate]) -> tuple[Estimate, ...]:
    several = tuple(found)
    if not all(isinstance(one, Estimate) for one in several):
        raise TypeError("it returned something else than Estimate, several of them, or None")
    for one in several:
        if not all(value is None or math.isfinite(value) for value in (one.value, one.low, one.high)):
            raise ValueError(f"it returned {one.value} [{one.low}, {one.high}]; values must be finite, or None")
    return several


when_changed(measurement_kinds.cache_clear)
when_changed(phases_needed.cache_clear)
when_changed(measurement_kinds)
