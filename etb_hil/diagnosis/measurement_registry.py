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

import numpy as np

from etb_hil.base.errors import InputError
from etb_hil.base.plugins import Part, parts, when_changed
from etb_hil.base.read_only import lent
from etb_hil.diagnosis import measurements
from etb_hil.diagnosis.measurement_kind import Estimate, FailedEstimate, MeasurementKind, misstatements
from etb_hil.diagnosis.result import Reason

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
        check_measurement_part(part)
        if wrong := list(misstatements(part.value, {kind.id for kind in kinds})):
            raise InputError(*(problem for one in wrong for problem in part.refused(one).problems))
        phases, roles = frozenset(part.value.phases), frozenset(part.value.roles)
        kinds.append(replace(part.value, compute=_guarded(part), phases=phases, roles=roles))
    return {kind.id: kind for kind in sorted(kinds, key=lambda kind: (kind.order, kind.id))}


def check_measurement_part(part: Part) -> None:
    """Raise InputError where a field of a measurement's declaration has another type."""
    part.require(MeasurementKind)
    kind: MeasurementKind = part.value
    for name in ("id", "name", "unit"):
        part.require_text(name, getattr(kind, name))
    part.require_texts("source", "too_high", "too_low", "suffixes", "friction_of", "judged_at_rest_by")
    part.require_names("phases", "roles")
    if isinstance(kind.order, bool) or not isinstance(kind.order, int):
        raise part.refused(f"`order` must be a whole number (it is {kind.order!r})")
    for name in ("is_friction", "is_model_free"):
        if not isinstance(value := getattr(kind, name), bool):
            raise part.refused(f"`{name}` must be True or False (it is {value!r})")
    least = kind.least_limit
    if least is not None and (isinstance(least, bool) or not isinstance(least, int | float)):
        raise part.refused(f"`least_limit` must be a number, or None (it is {least!r})")


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
    plug-in, which can write to no array of a run.
    """
    kind: MeasurementKind = part.value

    def guarded(run: Findings) -> Found:
        try:
            with part.guarded("computing"), lent(run):
                return _estimates(kind, kind.compute(run))
        except InputError as error:
            return FailedEstimate(None, note=f"the plug-in failed: {error}")

    return guarded


def _estimates(kind: MeasurementKind, found: object) -> tuple[Estimate, ...]:
    """Return what a plug-in's measurement returned as estimates of ours.

    TypeError or ValueError say what is wrong with it.
    """
    if found is None:
        return ()
    if not isinstance(found, Estimate | Iterable) or isinstance(found, str):
        raise TypeError(_NO_ESTIMATE)
    estimates = tuple(_estimate(kind, one) for one in ((found,) if isinstance(found, Estimate) else found))
    ids = [f"{kind.id}{one.suffix}" for one in estimates]
    for id_ in ids:
        if ids.count(id_) > 1:
            raise ValueError(f"it returned {ids.count(id_)} values with the id {id_!r}; a `suffix` sets each apart")
        owner = kind_of(id_)
        if owner is not None and owner.id != kind.id:
            raise ValueError(f"{id_!r} is an id of the measurement {owner.id!r}; choose another suffix")
    return estimates


_NO_ESTIMATE = "it returned something else than Estimate, several of them, or None"


def _estimate(kind: MeasurementKind, found: object) -> Estimate:
    if not isinstance(found, Estimate):
        raise TypeError(_NO_ESTIMATE)
    if not isinstance(found.suffix, str):
        raise TypeError(f"`suffix` must be a text (it is {found.suffix!r})")
    if found.suffix and not (kind.suffixes and re.fullmatch(f"_(?:{kind.suffixes})", found.suffix)):
        allowed = f"'_' and then {kind.suffixes!r}" if kind.suffixes else "none: `suffixes` declares no pattern"
        raise ValueError(f"`suffix` does not fit the declaration (it is {found.suffix!r}); allowed: {allowed}")
    value, low, high = (_number(name, getattr(found, name)) for name in ("value", "low", "high"))
    stated = [one for one in (low, value, high) if one is not None]
    if stated != sorted(stated):
        raise ValueError(f"{kind.id}{found.suffix} = {value} lies outside its interval, {low} to {high}")
    for name in ("note", "name", "if_failed"):
        if not isinstance(getattr(found, name), str):
            raise TypeError(f"`{name}` must be a text (it is {getattr(found, name)!r})")
    if found.undecided is not None and not isinstance(found.undecided, Reason):
        raise TypeError(f"`undecided` must be a Reason or None (it is {found.undecided!r})")
    return Estimate(
        value,
        low,
        high,
        found.note,
        found.suffix,
        found.name,
        bool(found.may_pass),
        found.undecided,
        found.if_failed,
        bool(found.is_least),
    )


def _number(name: str, value: object) -> float | None:
    """Return a number of a plug-in as Python's, which files and comparisons take."""
    if value is None:
        return None
    if np.ndim(value) or np.asarray(value).dtype.kind not in "fiuO":  # type: ignore[arg-type]
        raise TypeError(f"`{name}` must be a number, or None (it is {value!r})")
    number = float(value)  # type: ignore[arg-type]
    if not math.isfinite(number):
        raise ValueError(f"`{name}` is {number}; values must be finite, or None")
    return number


when_changed(measurement_kinds.cache_clear)
when_changed(phases_needed.cache_clear)
when_changed(measurement_kinds)
