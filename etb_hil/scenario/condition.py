"""Conditions on a signal, as scenarios state them.

An edge, a level, a window, or a signal that has settled.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, WithJsonSchema, field_validator, model_validator

from etb_hil.base.quantity import Duration, dimension_of_unit, parse_quantity, unit_of
from etb_hil.base.roles import COMMANDED, ROLES
from etb_hil.base.yamlfile import FileModel

EDGES = ("rises_above", "falls_below")
LEVELS = ("above", "below")
WINDOWS = ("inside", "outside")
KINDS = (*EDGES, *LEVELS, *WINDOWS, "settles_within")


def _of_role(value: object, info: ValidationInfo) -> float:
    role = info.data.get("role")
    return math.nan if role is None else parse_quantity(_plain(value, role), role_dimension(role))


def _difference_of_role(value: object, info: ValidationInfo) -> float:
    """Read an amount of change, in which the zeros of scales do not count.

    Half a K is half a degC.
    """
    role = info.data.get("role")
    if role is None:
        return math.nan
    text, dimension = _plain(value, role), role_dimension(role)
    unit = text.strip().lstrip("+-0123456789.eE").strip() if isinstance(text, str) else ""
    zero = parse_quantity(f"0 {unit}", dimension) if unit else 0.0
    return parse_quantity(text, dimension) - zero


def _plain(value: object, role: str) -> object:
    """Let plain numbers stand for numbers that have no unit, as modes and fault bits."""
    return value if isinstance(value, str) or role_dimension(role) == "ratio" else _unit_is_missing(value, role)


def _unit_is_missing(value: object, role: str) -> object:
    raise ValueError(f"{value!r} has no unit; write it for instance as '1 {unit_of(role_dimension(role))}'")


def role_dimension(role: str) -> str:
    """Return the dimension that values of a role have."""
    return dimension_of_unit(ROLES[role].unit) or "ratio"


_WRITTEN = WithJsonSchema({"type": ["string", "number"], "description": "a value of the role, with its unit"})
Value = Annotated[float, BeforeValidator(_of_role), _WRITTEN]
Change = Annotated[float, BeforeValidator(_difference_of_role), _WRITTEN]
Window = tuple[Value, Value]


class Condition(FileModel):
    """One condition on one role, held against every sample as it arrives.

    The sample that completes it fires it.

    Exactly one of `rises_above`, `falls_below` (edges: the signal has to be on the other side first), `above`, `below`
    (levels), `inside`, `outside` (windows) and `settles_within` is given. `for` is how long it has to stay true, on the
    clock of the samples; a bad sample or a gap starts that time anew.
    """

    role: Annotated[str, Field(description="the role of the signal, as the bench file maps it")]
    rises_above: Value | None = None
    falls_below: Value | None = None
    above: Value | None = None
    below: Value | None = None
    inside: Window | None = None
    outside: Window | None = None
    settles_within: Annotated[
        Change | None, Field(description="the trend over the time `over` changes the signal by no more than this")
    ] = None
    over: Annotated[Duration | None, Field(gt=0, description="goes with `settles_within`")] = None
    for_: Annotated[Duration, Field(alias="for", ge=0)] = 0.0

    @field_validator("role")
    @classmethod
    def _is_measured(cls, role: str) -> str:
        if role not in ROLES or role in COMMANDED:
            measured = ", ".join(name for name in ROLES if name not in COMMANDED)
            raise ValueError(f"must be a measured role; allowed: {measured}")
        return role

    @field_validator("inside", "outside")
    @classmethod
    def _rises(cls, window: tuple[float, float] | None) -> tuple[float, float] | None:
        if window is not None and window[0] >= window[1]:
            raise ValueError("the first value must lie below the second")
        return window

    @model_validator(mode="after")
    def _is_one(self) -> Condition:
        given = [kind for kind in KINDS if getattr(self, kind) is not None]
        if len(given) != 1:
            told = f"it has {' and '.join(given)}" if given else "it has none"
            raise ValueError(f"a condition needs one of {', '.join(KINDS)}; {told}")
        if (self.settles_within is None) != (self.over is None):
            raise ValueError("'settles_within' and 'over' go together")
        if self.settles_within is not None and self.settles_within <= 0.0:
            raise ValueError("'settles_within' must be above zero")
        return self

    @property
    def kind(self) -> str:
        """Which of `KINDS` it is."""
        return next(kind for kind in KINDS if getattr(self, kind) is not None)

    def holds(self, value: float) -> bool:
        """Return whether a value fulfils an edge's, a level's or a window's condition.

        NaN does not.
        """
        kind: Any = self.kind
        bound = getattr(self, kind)
        if kind in {"rises_above", "above"}:
            return bool(value > bound)
        if kind in {"falls_below", "below"}:
            return bool(value < bound)
        if kind == "inside":
            return bool(bound[0] <= value <= bound[1])
        return bool(value < bound[0] or value > bound[1])

    def __str__(self) -> str:
        bound = getattr(self, self.kind)
        unit = ROLES[self.role].unit.removesuffix("1")
        factor = 180.0 / math.pi if unit.startswith("rad") else 1.0
        values = " to ".join(f"{part * factor:g}" for part in (bound if isinstance(bound, tuple) else (bound,)))
        text = f"{self.role} {self.kind.replace('_', ' ')} {values} {unit.replace('rad', 'deg')}".rstrip()
        if self.over is not None:
            text += f" over {self.over:g} s"
        return f"{text} for {self.for_:g} s" if self.for_ else text


class Until(Condition):
    """A condition that ends a phase.

    Where the phase is over first, the run stops or goes on.
    """

    otherwise: Annotated[Literal["stop", "go_on"], Field(description="what to do where it never fires")] = "stop"
