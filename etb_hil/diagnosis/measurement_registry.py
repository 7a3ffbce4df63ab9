"""The measurements that there are: every file of `measurements/` holds one as `KIND`."""

from __future__ import annotations

import pkgutil
import re
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING

from etb_hil.diagnosis import measurements

if TYPE_CHECKING:
    from etb_hil.diagnosis.measurement_kind import MeasurementKind


@cache
def measurement_kinds() -> Mapping[str, MeasurementKind]:
    """Return the declarations of all measurements by id, in the order in which people read them."""
    names = [module.name for module in pkgutil.iter_modules(measurements.__path__)]
    kinds: list[MeasurementKind] = [import_module(f"{measurements.__name__}.{name}").KIND for name in names]
    return {kind.id: kind for kind in sorted(kinds, key=lambda kind: (kind.order, kind.id))}


def kind_of(measurement_id: str) -> MeasurementKind | None:
    """Return the declaration behind the id of a measurement, or of one of its several values; None of any other id."""
    kinds = measurement_kinds()
    return kinds.get(measurement_id) or next(
        (
            kind
            for kind in kinds.values()
            if kind.suffixes and re.fullmatch(f"{re.escape(kind.id)}_(?:{kind.suffixes})", measurement_id)
        ),
        None,
    )


@cache
def phases_needed() -> frozenset[str]:
    """Return the kinds of phase whose samples some measurement is taken from."""
    return frozenset(phase for kind in measurement_kinds().values() for phase in kind.phases)
