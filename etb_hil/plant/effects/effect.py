"""What an effect says of itself: its equation, its parameters, and what people do with it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from etb_hil.plant.effects.layout import WIDTH, row


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


@dataclass(frozen=True, slots=True)
class EffectParameter:
    """A number of an effect, SI at the throttle shaft unless its unit says otherwise.

    `starts`: for a strength the physical steps that a search tries, for a shape the grid of its values. A strength at
    zero is no effect, whatever the shapes; one without steps is only fitted, never searched by itself. `scale`: how
    far a shape moves at a time, where a quarter of it is too far. `elsewhere`: where a fit of a finer shape has to
    begin, too, because no slope leads there.
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


@dataclass(frozen=True, slots=True)
class Effect:
    """An effect of the catalogue.

    `parameters` are what a search fits. `finer`: shapes behind them, 0 for the plain curve, without which a cause is
    found all the same; a last fit in free run alone moves them. `is_one_way`: there is none below zero; what its bounds
    leave there keeps a fit off them.
    """

    id: str
    equation: str
    balance: Balance
    parity: Parity
    parameters: tuple[EffectParameter, ...]
    looks_like: str
    check: str
    look_alikes: tuple[str, ...]
    separated_by: str
    source: str
    limits: str = ""
    is_one_way: bool = False
    is_of_place: bool = False
    finer: tuple[EffectParameter, ...] = ()

    def __post_init__(self) -> None:
        if len(self.stated) > WIDTH:
            raise ValueError(f"{self.id}: at most {WIDTH} parameters")

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
    def strengths(self) -> tuple[int, ...]:
        """Places, among the parameters, of those that make the effect."""
        return tuple(k for k, parameter in enumerate(self.parameters) if parameter.is_strength)

    @property
    def searched(self) -> tuple[int, ...]:
        """Places, among the parameters, of the strengths that a search tries."""
        return tuple(k for k in self.strengths if self.parameters[k].starts)


def strength(name: str, unit: str, low: float, high: float, steps: tuple[float, ...], source: str) -> EffectParameter:
    """Return a parameter without which the effect is none."""
    return EffectParameter(name, unit, low, high, steps, source, is_strength=True)


def shape(
    name: str, unit: str, low: float, high: float, grid: tuple[float, ...], source: str, scale: float = 0.0
) -> EffectParameter:
    """Return a parameter that says what the effect looks like, not how much of it there is."""
    return EffectParameter(name, unit, low, high, grid, source, scale=scale)


def finer(
    name: str, unit: str, low: float, high: float, source: str, scale: float, elsewhere: tuple[float, ...] = ()
) -> EffectParameter:
    """Return a shape that is 0 for the plain curve; `scale`: how far it moves at a time; `elsewhere`: other starts."""
    return EffectParameter(name, unit, low, high, (0.0,), source, scale=scale, elsewhere=elsewhere)
