"""A model: what is known of a throttle, with tolerances and sources.

A model is read from a model file.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from etb_hil.base.arguments import checked
from etb_hil.base.errors import InputError, Problem
from etb_hil.plant.device import THROTTLE, Device
from etb_hil.plant.measured import Measured, with_measured
from etb_hil.plant.model_check import impossible
from etb_hil.plant.model_file import EffectEntry, FrictionModel, Sensors, read_model_file
from etb_hil.plant.parameter import Parameter, referred
from etb_hil.plant.values import ThrottleParameters

if TYPE_CHECKING:
    from numpy.random import Generator

    from etb_hil.plant.physics import Vector

__all__ = ["Model", "ThrottleParameters", "load_model"]

_DRAWS = 1000


@dataclass(frozen=True)
class Model:
    """A throttle as a model file states it, or as drawn from one.

    `device`: the machine that it is of; a linear one has N for N·m, and m for rad.

    What was measured of it is in its parameters and effects already; `measured` says what that was.
    `friction_model`: the law of its bristles. `has_laws_as_terms`: `vector` obeys the parameters' laws over the
    temperature, too.
    """

    name: str
    parameters: Mapping[str, Parameter]
    sensors: Sensors
    effects: tuple[EffectEntry, ...] = ()
    device: Device = THROTTLE
    measured: Mapping[str, Measured] = field(default_factory=dict)
    has_laws_as_terms: bool = False
    friction_model: FrictionModel = FrictionModel.LUGRE

    @classmethod
    @checked
    def load(cls, source: str | Path) -> Model:
        """Read a throttle's or a drive's model file, by path or stock name.

        InputError lists problems.
        """
        from etb_hil.base.stock import find  # noqa: PLC0415 (its own file loads this one)
        from etb_hil.plant.drive_file import load_plant  # noqa: PLC0415

        return load_plant(find("model", str(source)))

    @checked
    def write(self, path: str | Path, description: str = "") -> None:
        """Write a model file that `load` reads as the same model.

        InputError where it cannot be written.
        """
        from etb_hil.base.files import write_text  # noqa: PLC0415
        from etb_hil.plant.drive_text import drive_text  # noqa: PLC0415
        from etb_hil.plant.model_text import model_text  # noqa: PLC0415

        write_text(Path(path), (model_text if self.device.is_throttle else drive_text)(self, description or self.name))

    def with_laws_as_terms(self, temperature: float) -> Model:
        """Return the model for data whose temperature is known.

        What has a law is stated at the terms' reference.

        What has a law that no term obeys is stated at a `temperature` in degC.
        """
        from etb_hil.plant.effects.laws import at_reference  # noqa: PLC0415 (numba)

        parameters, measured = at_reference(self.parameters, self.measured, temperature)
        return replace(self, parameters=parameters, measured=measured, has_laws_as_terms=True)

    def knowing(self, numbers: Iterable[Measured]) -> Model:
        """Return the model of one unit of which these numbers were measured, too."""
        new = {one.name: one for one in numbers}
        strengths = {entry.id: dict(entry.strengths) for entry in self.effects}
        for one in new.values():
            if one.is_of_effect:
                value = one.value if one.unit == "1" else f"{one.value:.9g} {one.unit}"
                strengths.setdefault(one.id, {})[one.name.partition(".")[2]] = value
        effects = tuple(EffectEntry(id=id_, strengths=its) for id_, its in strengths.items())
        parameters = with_measured(self.parameters, new)
        return replace(self, parameters=parameters, effects=effects, measured={**self.measured, **new})

    def as_stated(self) -> Model:
        """Return the model as the file states it, where measured numbers are off.

        Measured numbers inside of what the file states stay.
        """
        off = [one for one in self.measured.values() if one.is_off]
        return self.knowing(replace(one, value=one.stated, uncertainty=one.tolerance) for one in off) if off else self

    @property
    def values(self) -> ThrottleParameters:
        """The values of the equations, as stated: at the throttle shaft, in SI."""
        return referred(self.parameters)

    def vector(self) -> Vector:
        """Return the extended parameter vector: base values and effects.

        `etb_hil.plant.effects.layout` has its order.
        """
        from etb_hil.plant.bristle import ELASTIC_SHARE  # noqa: PLC0415 (numba)
        from etb_hil.plant.effects.entries import whole_vector  # noqa: PLC0415 (numba)
        from etb_hil.plant.effects.laws import put_laws  # noqa: PLC0415 (numba)
        from etb_hil.plant.effects.layout import ELASTIC  # noqa: PLC0415 (numba)

        inertia = self.parameters["throttle_inertia"].value
        vector = whole_vector(self.values.vector(), inertia, [(entry.id, entry.strengths) for entry in self.effects])
        if self.friction_model is FrictionModel.ELASTO_PLASTIC:
            vector[ELASTIC] = ELASTIC_SHARE
        if self.has_laws_as_terms:
            put_laws(vector, self.parameters)
        return vector

    def values_at(self, temperature: float) -> ThrottleParameters:
        """Return the values of the equations at a temperature in degC.

        Parameters that have no law for it stay.
        """
        return referred(
            {
                name: replace(p, value=p.value * p.temperature.factor(temperature)) if p.temperature else p
                for name, p in self.parameters.items()
            }
        )

    def tolerance(self, name: str) -> float:
        """Return how far a field of `ThrottleParameters` may be off, in SI.

        The tolerance is the worst case over what it is made of.
        """
        nominal = getattr(self.values, name)
        return float(sum(abs(getattr(moved, name) - nominal) for moved in self._one_moved))

    @property
    def tolerances(self) -> ThrottleParameters:
        """How far each value of the equations may be off, in SI; see `tolerance`.

        The tolerance is at the throttle shaft.
        """
        return ThrottleParameters(*(self.tolerance(one.name) for one in fields(ThrottleParameters)))

    @cached_property
    def _one_moved(self) -> list[ThrottleParameters]:
        """The values with one parameter after the other at the end of its tolerance."""
        moved = [
            replace(parameter, value=parameter.value + parameter.half_width)
            for parameter in self.parameters.values()
            if parameter.half_width
        ]
        return [referred({**self.parameters, parameter.name: parameter}) for parameter in moved]

    def drawn(self, rng: Generator) -> Model:
        """Return a unit of this model, drawn inside the tolerances.

        Every parameter is drawn evenly, K_e and K_t by one factor.

        InputError where the tolerances leave next to no unit that is physically possible.
        """
        for _ in range(_DRAWS):
            drawn = {
                name: replace(p, value=p.value + p.half_width * rng.uniform(-1.0, 1.0))
                for name, p in self.parameters.items()
            }
            torque, back_emf = self.parameters["torque_constant"], self.parameters["back_emf_constant"]
            factor = drawn["torque_constant"].value / torque.value
            drawn["back_emf_constant"] = replace(back_emf, value=back_emf.value * factor)
            if not impossible(drawn):
                return replace(self, name=f"{self.name} (drawn)", parameters=drawn)
        raise InputError(Problem(f"no unit could be drawn from the model {self.name}", remedy="narrow its tolerances"))


def load_model(path: Path) -> Model:
    """Read a model file.

    Raises InputError that lists every problem with file, line and key; warns with `ParameterRangeWarning` of values
    outside table I of the seed paper.
    """
    content = read_model_file(path)
    stated = Model(
        content.name,
        content.parameters,
        content.sensors,
        content.effects,
        friction_model=content.friction_model,
    )
    return stated.knowing(content.measured.values()) if content.measured else stated
