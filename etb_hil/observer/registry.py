"""The observers by name: every file in `kinds` declares one as `OBSERVER`, and its name is the file's."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from etb_hil.base.errors import InputError, Problem
from etb_hil.observer import kinds
from etb_hil.observer.estimate import Observer, SensorNoise
from etb_hil.plant.parameters import Model, ThrottleParameters

DEFAULT = "angle"


@dataclass(frozen=True, slots=True)
class ObserverKind:
    """One observer: what it is in a line, and how it is made.

    `make` takes the bench's model, that model's values at the unit's temperature, and the sensors' noise.
    """

    summary: str
    make: Callable[[Model, ThrottleParameters, SensorNoise], Observer]


@cache
def observer_names() -> tuple[str, ...]:
    """Return the names of all observers, in order of the alphabet; imports none of them."""
    return tuple(sorted(module.name.replace("_", "-") for module in pkgutil.iter_modules(kinds.__path__)))


def require_observer(name: str) -> None:
    """Raise InputError, with the names of all observers, where there is none of a name."""
    if name not in observer_names():
        raise InputError(Problem("there is no such observer", value=name, allowed=", ".join(observer_names())))


def observer_kind(name: str) -> ObserverKind:
    """Return the observer of a name; InputError lists the names where there is none."""
    require_observer(name)
    module = importlib.import_module(f"{kinds.__name__}.{name.replace('-', '_')}")
    found: ObserverKind = module.OBSERVER
    return found
