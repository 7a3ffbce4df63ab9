"""The declaration of an effect: equation, parameters, terms and states.

The declaration also says what is known of the effect in practice.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum, StrEnum
from functools import cache
from inspect import signature

from etb_hil.plant.component import Component, component_at
from etb_hil.plant.effects.layout import row
from etb_hil.plant.effects.port import FRICTION, Port

Function = Callable[..., object]

REFERENCE = 25.0  # degC at which effects of temperature are none


class Parity(StrEnum):
    """What the effect's term does when the motion is run through backwards."""

    ODD = "odd"
    EVEN = "even"
    NEITHER = "neither"


class Balance(StrEnum):
    """The balance that the effect's term stands in, with its unit."""

    TORQUE = "N·m"
    VOLTAGE = "V"
    ANGLE = "rad"


class Need(Enum):
    """What must be there for an effect to be distinguished from the base model.

    The record has it, or the device under test.
    """

    CURRENT = "a measured current"
    DRIVING = "a measured current, force or torque"
    TEMPERATURE = "a measured temperature that changes"
    PLATE_ANGLE = "the plate's angle"
    MOTOR_ANGLE = "the motor's angle"
    BOTH_WAYS = "motion in both directions"
    OPEN_BRIDGE = "coasting with the bridge open"
    THROTTLE = "a plate with springs, stops and a gear"
    SPRING = "a spring"
    STOPS = "stops"
    FREE = "a travel without stops"
    PENDULUM = "a shaft that may turn a load against gravity"


class BenchMeasurement(StrEnum):
    """What can be measured at the bench without running a test.

    An effect may name one of its own.
    """

    RESISTANCE = (
        "measure the winding's resistance at the motor's terminals with a four-wire ohmmeter, in several positions"
    )
    CURRENT = "compare the current's reading with a shunt or a clamp meter, at two currents and with the bridge off"
    MOTOR_CONSTANT = "turn the motor at a known speed, its leads open, and read its voltage"
    MAGNETS = "turn the motor at a known speed, cold and 40 K warmer, its leads open, and compare its voltages"
    SPRINGS = "move the plate with a torque gauge from stop to stop, the gear taken out and no air flowing"
    STOPS = "read the plate's angle at both stops and, let go from either side, at limp-home"
    FRICTION = (
        "open the motor's leads; measure opening and closing torque with a torque gauge at the plate, slowly and at "
        "the first movement; take half the difference"
    )
    PLAY = (
        "lock the motor; load the plate's lever in both directions under a dial gauge; read the free play, and the "
        "angle over the load"
    )
    SUPPLY = "read the supply at the bridge with a voltmeter, at rest and under a known current"
    BRUSHES = (
        "hold the motor at several currents of both signs; read the voltage at its terminals; extrapolate it to "
        "zero current"
    )
    BRIDGE = "compare the mean voltage at the bridge's output with the commanded duty, at several currents"


@dataclass(frozen=True, slots=True)
class EffectParameter:
    """A number of an effect, SI at the throttle shaft unless its unit says otherwise.

    `starts`: for a strength the physical steps that a search tries, for a shape the grid of its values. A strength at
    zero is no effect, whatever the shapes; one without steps is only fitted, never searched by itself. `scale`: how
    far a shape moves at a time, where a quarter of it is too far. `elsewhere`: where a fit has to begin, too,
    because no slope leads there. `under`: the shape by whose value of 0 it is no part of the effect, as the order of a
    further wave. `is_count`: in a motor it is a whole number. `is_width`: how far the
    effect reaches about a place, in rad.
    """

    name: str
    unit: str
    low: float
    high: float
    starts: tuple[float, ...]
    source: str
    is_strength: bool = False
    scale: float = 0.0
    elsewhere: tuple[float, ...] = ()
    is_count: bool = False
    is_width: bool = False
    under: str = ""


@dataclass(frozen=True, slots=True)
class State:
    """A number that an effect remembers from instant to instant.

    Its terms take it as an argument by its name.

    `step` returns the state after `dt` s from the state before (the argument of its name), `start` the state of a
    device that has long been at rest at a temperature, 0 without it.
    """

    name: str
    step: Function
    start: Function | None = None


@dataclass(frozen=True, slots=True)
class SensorMemory:
    """Numbers that a sensor remembers: `size` float64, zero at the start.

    `step` moves them by 50 us, in place.
    """

    size: int
    step: Function


@dataclass(frozen=True, slots=True)
class Law:
    """A law over the temperature in a model file that an effect obeys.

    The law is that of the first of its `parameters`.

    A coefficient of `per_kelvin` (1/K) is a `strength` of 1. What lags behind the housing's temperature is set by the
    shape `lag`, if there is one.
    """

    parameters: tuple[str, ...]
    strength: str
    per_kelvin: float
    lag: str = ""


@dataclass(frozen=True, slots=True)
class Effect:
    """An effect of the catalogue.

    `terms` holds the functions of the equation by port: one, or several in their order. A function takes, by the names
    of its arguments, the effect's parameters, base parameters (fields of `ThrottleParameters`), the port's quantities,
    and the effect's states. A term is zero (at a chain: the value itself) where the strengths are zero.

    `parameters` are what a search fits. `finer`: shapes behind them, 0 for the plain curve, without which a cause is
    found all the same; a last fit in free run alone moves them. `is_one_way`: there is none below zero; what its bounds
    leave there keeps a fit off them.

    `name` stands in reports where the id with spaces is not the effect's name. `check` and `separated_by` are
    instructions to a technician, in the imperative. `component` is the one that it sits in, where its ports do not say
    so. `look_alikes`: effects (`id`) and base parameters (`parameter:name`) that are hard to distinguish from it.
    `without_current_like`: effects that it cannot be distinguished from where no current was measured. `by_bench`: how
    its strengths are measured at the bench, with the uncertainty of each.
    """

    id: str
    equation: str
    balance: Balance
    parity: Parity
    parameters: tuple[EffectParameter, ...]
    looks_like: str
    check: str
    separated_by: str
    source: str
    terms: Mapping[Port, Function | tuple[Function, ...]]
    name: str = ""
    component: Component | None = None
    look_alikes: tuple[str, ...] = ()
    states: tuple[State, ...] = ()
    sensor: SensorMemory | None = None
    finer: tuple[EffectParameter, ...] = ()
    needs: frozenset[Need] = frozenset()
    separated_on_drive: str = ""
    limits: str = ""
    is_one_way: bool = False
    is_of_place: bool = False
    without_current_like: tuple[str, ...] = ()
    by_bench: tuple[str, Mapping[str, float]] = field(default=("", {}))
    laws: tuple[Law, ...] = ()

    @property
    def components(self) -> frozenset[Component]:
        """The components that it may sit in."""
        return frozenset((self.component,) if self.component else map(component_at, self.terms))

    @property
    def indices(self) -> tuple[int, ...]:
        """Where the parameters stand in the extended vector."""
        return self.stated_indices[: len(self.parameters)]

    @property
    def stated(self) -> tuple[EffectParameter, ...]:
        """All that a model file may state: the parameters, and the finer shapes."""
        return self.parameters + self.finer

    @property
    def stated_indices(self) -> tuple[int, ...]:
        """Where all that a model file may state stands in the extended vector."""
        return tuple(range(row(self.id), row(self.id) + len(self.stated)))

    @property
    def acting_indices(self) -> tuple[int, ...]:
        """Where all that makes the effect by itself stands in the extended vector."""
        return tuple(k for one, k in zip(self.stated, self.stated_indices, strict=True) if one.is_strength)

    @property
    def strengths(self) -> tuple[int, ...]:
        """Places, among the parameters, of those that make the effect."""
        return tuple(k for k, parameter in enumerate(self.parameters) if parameter.is_strength)

    @property
    def searched(self) -> tuple[int, ...]:
        """Places, among the parameters, of the strengths that a search tries."""
        return tuple(k for k in self.strengths if self.parameters[k].starts)

    def place(self, name: str) -> int:
        """Return the index of a parameter in the extended vector, by its name."""
        return row(self.id) + [parameter.name for parameter in self.stated].index(name)

    def at(self, *ports: Port) -> tuple[Function, ...]:
        """Return the functions of the terms at some ports."""
        found = [self.terms[port] for port in ports if port in self.terms]
        return tuple(one for each in found for one in (each if isinstance(each, tuple) else (each,)))

    def acts_at(self, *ports: Port) -> bool:
        """Tell whether a term of the effect stands at one of some ports."""
        return bool(self.at(*ports))

    @property
    def depends_on_angle(self) -> bool:
        """Whether a term takes the angle itself: it has a place, or a phase."""
        return any(
            {"theta", "angle"} & set(arguments(one))
            for port in self.terms
            if not port.has_memory
            for one in self.at(port)
        )

    @property
    def is_of_friction(self) -> bool:
        """Whether it changes friction: its level, its curve, or the viscosity."""
        return self.acts_at(*FRICTION)


@cache
def arguments(function: Function) -> tuple[str, ...]:
    """Return the names of a function's arguments, compiled or not."""
    return tuple(signature(getattr(function, "py_func", function)).parameters)


def strength(
    name: str,
    unit: str,
    low: float,
    high: float,
    steps: tuple[float, ...],
    source: str,
    elsewhere: tuple[float, ...] = (),
) -> EffectParameter:
    """Return a parameter without which the effect is none.

    `elsewhere` are strengths that are tried before a fit.
    """
    return EffectParameter(name, unit, low, high, steps, source, is_strength=True, elsewhere=elsewhere)


def shape(
    name: str,
    unit: str,
    low: float,
    high: float,
    grid: tuple[float, ...],
    source: str,
    scale: float = 0.0,
    *,
    is_count: bool = False,
    is_width: bool = False,
) -> EffectParameter:
    """Return a parameter that says what the effect looks like, not its amount."""
    return EffectParameter(name, unit, low, high, grid, source, scale=scale, is_count=is_count, is_width=is_width)


def finer(
    name: str,
    unit: str,
    low: float,
    high: float,
    source: str,
    scale: float,
    elsewhere: tuple[float, ...] = (),
    *,
    is_strength: bool = False,
    under: str = "",
) -> EffectParameter:
    """Return a shape that is 0 for the plain curve.

    `scale` is how far it moves at a time, `elsewhere` are other starts. `is_strength`: it makes the effect by itself.
    `under`: see `EffectParameter`.
    """
    start = (0.0,)
    return EffectParameter(
        name, unit, low, high, start, source, is_strength, scale=scale, elsewhere=elsewhere, under=under
    )
