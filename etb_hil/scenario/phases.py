"""The kinds of phase that a scenario is made of.

Each file of `kinds/` declares one; plug-ins add theirs.
"""

from __future__ import annotations

import math
import pkgutil
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, Union, get_args

from pydantic import Field, GetCoreSchemaHandler, TypeAdapter

from etb_hil.base.modes import Mode
from etb_hil.base.plugins import Part, parts, when_changed
from etb_hil.diagnosis.phase_use import Use
from etb_hil.scenario import kinds
from etb_hil.scenario.phase import NAME, PhaseModel
from etb_hil.scenario.trajectory import Chain, Held, Motion, Released, SetPoint, Steps, Trajectory

if TYPE_CHECKING:
    from etb_hil.plant.parameters import ThrottleParameters


@cache
def phase_kinds() -> dict[str, type[PhaseModel]]:
    """Return the kinds of phase by name, ours first.

    Raises InputError where a plug-in's breaks the contract.
    """
    files = pkgutil.iter_modules(kinds.__path__)
    own: list[type[PhaseModel]] = [import_module(f"{kinds.__name__}.{one.name}").PHASE for one in files]
    found = {kind_name(phase): phase for phase in own}
    for part in parts("phases"):
        name = name_of_part(part)
        if name in found or name in {"group", LOG}:
            raise part.refused(f"there is a kind of phase {name} already")
        found[name] = _guarded(part)
    return found


def kind_name(phase: type[PhaseModel]) -> str:
    """Return the name by which scenarios choose a kind of phase."""
    return str(get_args(phase.model_fields["kind"].annotation)[0])


def name_of_part(part: Part) -> str:
    """Return the name of a plug-in's kind of phase.

    InputError where its declaration breaks the contract.
    """
    phase = part.value
    if not (isinstance(phase, type) and issubclass(phase, PhaseModel)):
        raise part.refused(
            "PHASE must be a subclass of PhaseModel", "write class MyPhase(PhaseModel), and PHASE = MyPhase"
        )
    field = phase.model_fields.get("kind")
    names = () if field is None else get_args(field.annotation)
    if len(names) != 1 or not NAME.fullmatch(str(names[0])):
        raise part.refused("its field `kind` has no single name", 'write kind: Literal["my_phase"]')
    if phase.trajectory is PhaseModel.trajectory:
        raise part.refused("it has no method `trajectory`", "write one that returns the set-points")
    return str(names[0])


def _guarded(part: Part) -> type[PhaseModel]:
    """Return a plug-in's kind of phase with its set-points checked.

    Its faults name the plug-in.
    """
    phase: type[PhaseModel] = part.value

    def trajectory(self: PhaseModel, start: float, throttle: ThrottleParameters) -> Trajectory:
        with part.guarded("its trajectory"):
            found = _own_trajectory(part, phase.trajectory(self, start, throttle))
            if not found.duration > 0.0:
                raise ValueError(f"its duration must be above 0 s (it is {found.duration!r} s)")
            found.at(0.0)
        return found

    space = {"__module__": phase.__module__, "__doc__": phase.__doc__, "trajectory": trajectory}
    return type(phase.__name__, (phase,), space)


class _GuardedTrajectory:
    """The set-points of a class that a plug-in wrote.

    Its faults name the plug-in, and its numbers are ours.
    """

    def __init__(self, part: Part, found: Trajectory) -> None:
        self._part, self._at, self.duration = part, found.at, _finite("duration", found.duration)

    def at(self, t: float) -> SetPoint:
        """Return the set-point t seconds after the start."""
        with self._part.guarded("its trajectory"):
            found = self._at(t)
            if not isinstance(found, SetPoint):
                raise TypeError(f"it returned {found!r} in place of SetPoint")
            numbers = {name: _finite(name, getattr(found, name)) for name in ("position", "velocity", "voltage")}
            return SetPoint(Mode(found.mode), **numbers)


def _own_trajectory(part: Part, found: Trajectory) -> Trajectory:
    """Return a trajectory of our classes as it is, and any other guarded."""
    if type(found) is Chain:
        return Chain(*(_own_trajectory(part, one) for one in found.parts))
    return found if type(found) in {Released, Held, Steps, Motion} else _GuardedTrajectory(part, found)


def _finite(name: str, value: object) -> float:
    number = math.nan if isinstance(value, bool) else float(value)  # type: ignore[arg-type] # TypeError says it
    if not math.isfinite(number):
        raise ValueError(f"{name} must be a finite number (it is {value!r})")
    return number


class AnyPhase:
    """The kinds of phase, and others beside them, as a type for pydantic.

    Rebuilding a model takes in what plug-ins added.
    """

    def __init__(self, *others: Any) -> None:  # noqa: ANN401 (types, and names of types)
        self._others = others

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> Any:  # noqa: ANN401
        phases: Any = Union[(*phase_kinds().values(), *self._others)]
        return handler.generate_schema(Annotated[phases, Field(discriminator="kind")])


if TYPE_CHECKING:
    Phase = PhaseModel
else:
    Phase = Annotated[PhaseModel, AnyPhase()]

LOG = "log"  # a bare log is one phase of this kind: nothing says what was asked of the unit


@cache
def _adapter() -> TypeAdapter[PhaseModel]:
    return TypeAdapter(Phase)


def read_phase(entry: object) -> PhaseModel:
    """Return the phase that a mapping describes, as in a scenario file.

    ValidationError where it is wrong.
    """
    return _adapter().validate_python(entry)


def use_of(kind: str) -> Use:
    """Return what the diagnosis does with the samples of a kind of phase.

    Of one that is not known, nothing.
    """
    if kind == LOG:
        return Use.FITTED
    known = phase_kinds().get(kind)
    return Use.NOTHING if known is None else known.use


def is_timed(kind: str) -> bool:
    """Return whether measurements ask how long after a command something happens.

    Of a kind of phase that is not known they do not.
    """
    known = phase_kinds().get(kind)
    return known is not None and known.is_timed


for _known in (phase_kinds, _adapter):
    when_changed(_known.cache_clear)
when_changed(phase_kinds)
