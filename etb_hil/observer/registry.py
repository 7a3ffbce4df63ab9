"""The observers by name.

Every file in `kinds` declares one as `OBSERVER` and names it; plug-ins add theirs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from etb_hil.base.named_parts import NamedParts
from etb_hil.base.plugins import Part
from etb_hil.observer import kinds
from etb_hil.observer.estimate import Observer, SensorNoise
from etb_hil.observer.guarded import GuardedObserver
from etb_hil.plant.parameters import Model, ThrottleParameters

DEFAULT = "adaptive"


@dataclass(frozen=True, slots=True)
class ObserverKind:
    """One observer: what it is in a line, and how it is made.

    `make` takes the bench's model, that model's values at the unit's temperature, and the sensors' noise.
    """

    summary: str
    make: Callable[[Model, ThrottleParameters, SensorNoise], Observer]


def _check(part: Part) -> None:
    kind: ObserverKind = part.value
    part.require_text("summary", kind.summary)
    part.require_function("make", kind.make, "model", "throttle", "noise")


OBSERVERS = NamedParts("observers", kinds, "observer", ObserverKind, _check)


def observer_kind(name: str) -> ObserverKind:
    """Return the observer of a name; InputError lists the names where there is none."""
    OBSERVERS.require(name)
    if (found := OBSERVERS.own(name)) is not None:
        return found
    part = OBSERVERS.of_plugins()[name]
    kind: ObserverKind = part.value

    def make(model: Model, throttle: ThrottleParameters, noise: SensorNoise) -> Observer:
        return GuardedObserver(part, lambda: kind.make(model, throttle, noise))

    return ObserverKind(kind.summary, make)
