"""The observers by name: every file in `kinds` declares one as `OBSERVER` and names it; plug-ins add theirs."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.plugins import Part, parts, when_changed
from etb_hil.observer import kinds
from etb_hil.observer.estimate import Observer, SensorNoise
from etb_hil.observer.guarded import GuardedObserver
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
    """Return the names of all observers, in order of the alphabet; imports none of ours."""
    return tuple(sorted({*_own(), *_of_plugins()}))


def require_observer(name: str) -> None:
    """Raise InputError, with the names of all observers, where there is none of a name."""
    if name not in observer_names():
        raise InputError(Problem("there is no such observer", value=name, allowed=", ".join(observer_names())))


def observer_kind(name: str) -> ObserverKind:
    """Return the observer of a name; InputError lists the names where there is none."""
    require_observer(name)
    if name in _own():
        found: ObserverKind = importlib.import_module(f"{kinds.__name__}.{_own()[name]}").OBSERVER
        return found
    part = _of_plugins()[name]
    kind: ObserverKind = part.value

    def make(model: Model, throttle: ThrottleParameters, noise: SensorNoise) -> Observer:
        with part.guarded("making it"):
            return GuardedObserver(part, kind.make(model, throttle, noise))

    return ObserverKind(kind.summary, make)


@cache
def _own() -> dict[str, str]:
    return {module.name.replace("_", "-"): module.name for module in pkgutil.iter_modules(kinds.__path__)}


@cache
def _of_plugins() -> dict[str, Part]:
    found = {}
    for part in parts("observers"):
        part.require(ObserverKind)
        name = part.name.replace("_", "-")
        if name in _own() or name in found:
            raise part.refused(f"there is an observer {name} already")
        found[name] = part
    return found


for _known in (_of_plugins, observer_names):
    when_changed(_known.cache_clear)
when_changed(observer_names)
