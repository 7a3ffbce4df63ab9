"""Model files: value, unit, shaft, tolerance and source of each parameter.

They are YAML.
"""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, create_model

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.quantity import Angle, Current, Temperature, TemperatureCoefficient, Voltage, parse_quantity
from etb_hil.base.yamlfile import Document, FileModel, load
from etb_hil.plant.measured import NEVER, Measured, measured_parameter, with_measured
from etb_hil.plant.model_check import (
    ParameterRangeWarning,
    impossible,
    motor_constants_differ,
    motor_laws_differ,
    outside_table_one,
)
from etb_hil.plant.parameter import Parameter, TemperatureLaw, Tolerance
from etb_hil.plant.table_one import KINDS, Shaft

Text = Annotated[str, Field(min_length=1, max_length=2000)]


class TemperatureEntry(FileModel):
    """How a parameter changes with the housing's temperature, linearly.

    The parameter changes about a reference.
    """

    coefficient: TemperatureCoefficient
    reference: Temperature


class ParameterEntry(FileModel):
    """One parameter of a model file."""

    value: Annotated[str | float, Field(description="the value with its unit, for instance '0.35 N·m'")]
    shaft: Annotated[Shaft | None, Field(description="the shaft that a rotary value is stated for")] = None
    tolerance: Annotated[str | float, Field(description="a share ('3 %') or an amount with its unit ('0.2 deg')")]
    source: Annotated[Text, Field(description="where the value comes from; 'chosen' is an honest source")]
    temperature: TemperatureEntry | None = None
    outside_table_one: Annotated[
        Text | None, Field(description="why the value rightly lies outside table I; silences the warning")
    ] = None


class Sensors(FileModel):
    """The data sheet of the controller's sensors."""

    motor_counts_per_turn: Annotated[int, Field(ge=4, le=1 << 24, description="quadrature counts a motor turn")]
    plate_bits: Annotated[int, Field(ge=6, le=24, description="resolution of each plate track")]
    plate_range: Annotated[Angle, Field(gt=0.0)]
    plate_noise: Annotated[Angle, Field(ge=0.0)]
    current_step: Annotated[Current, Field(gt=0.0, description="what one count of the converter is worth")]
    current_noise: Annotated[Current, Field(ge=0.0)]
    voltage_step: Annotated[Voltage, Field(gt=0.0)]
    voltage_noise: Annotated[Voltage, Field(ge=0.0)]


class FrictionModel(StrEnum):
    """The law of the bristles; `etb_hil/plant/bristle.py` has its equations."""

    LUGRE = "lugre"
    ELASTO_PLASTIC = "elasto-plastic"


class EffectEntry(FileModel):
    """An effect that the base model leaves out, with its strengths."""

    id: Text
    strengths: dict[str, str | float] = Field(default_factory=dict)


class MeasuredEntry(FileModel):
    """A parameter of this unit that was measured at the bench."""

    value: Annotated[str | float, Field(description="as measured, with its unit; of an effect that is not there 0")]
    shaft: Annotated[
        Shaft | None, Field(description="the shaft that a rotary value was measured at, whichever it is stated for")
    ] = None
    uncertainty: Annotated[
        str | float,
        Field(description="how far at most the true value may be off: an amount; of a parameter also a share"),
    ]
    source: Annotated[Text, Field(description="how it was measured")]


if TYPE_CHECKING:

    class ParameterTable(FileModel):
        """Every parameter of the base model, a field each."""

else:
    # One field a parameter: unknown and missing names are found, and spelt out in the JSON schema, by pydantic itself.
    ParameterTable = create_model(
        "ParameterTable",
        __base__=FileModel,
        __doc__="Every parameter of the base model.",
        **{
            name: (ParameterEntry, Field(description=f"{kind.symbol}, a value of {kind.dimension}"))
            for name, kind in KINDS.items()
        },
    )


class ModelFile(FileModel):
    """A model file."""

    schema_: Annotated[Literal["etb_hil/model/1"], Field(alias="schema")]
    name: Text
    description: Text
    parameters: ParameterTable
    sensors: Sensors
    friction_model: Annotated[
        FrictionModel, Field(description="law of the bristles: LuGre creeps below break-away, elasto-plastic stays")
    ] = FrictionModel.LUGRE
    effects: list[EffectEntry] = Field(default_factory=list)
    measured: Annotated[
        dict[str, MeasuredEntry],
        Field(description="numbers of one unit, by the name of the parameter or as <effect>.<strength>"),
    ] = Field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class ModelContent:
    """What a model file says, checked and in SI."""

    name: str
    parameters: Mapping[str, Parameter]
    sensors: Sensors
    effects: tuple[EffectEntry, ...]
    friction_model: FrictionModel
    measured: Mapping[str, Measured]


def read_model_file(path: Path) -> ModelContent:
    """Read and check a model file.

    InputError lists the problems, `ParameterRangeWarning` what is unusual.
    """
    document = load(path, ModelFile)
    parameters = _parameters(document)
    measured = _measured(document, parameters)
    problems = [
        dataclasses.replace(
            problem, place=document.place("measured" if name in measured else "parameters", name, "value")
        )
        for name, problem in impossible(with_measured(parameters, measured)).items()
    ]
    if not problems and (problem := motor_constants_differ(parameters)):
        problems.append(dataclasses.replace(problem, place=document.place("parameters", "back_emf_constant", "value")))
    if problem := motor_laws_differ(parameters):
        problems.append(dataclasses.replace(problem, place=document.place("parameters", "back_emf_constant")))
    problems += _wrong_effects(document)
    if problems:
        raise InputError(*problems)
    _warn_of_ranges(document, parameters)
    content = document.content
    return ModelContent(
        content.name, parameters, content.sensors, tuple(content.effects), content.friction_model, measured
    )


def _parameters(document: Document[ModelFile]) -> dict[str, Parameter]:
    parameters, problems = {}, []
    for name in KINDS:
        found = _parameter(document, name, getattr(document.content.parameters, name))
        if isinstance(found, Parameter):
            parameters[name] = found
        else:
            problems.append(found)
    if problems:
        raise InputError(*problems)
    return parameters


def _parameter(document: Document[ModelFile], name: str, entry: ParameterEntry) -> Parameter | Problem:
    kind = KINDS[name]
    if kind.gear_power is not None and entry.shaft is None:
        place = document.place("parameters", name, "shaft")
        return Problem(f"{kind.symbol} needs its shaft", place, allowed="motor, throttle", remedy="add 'shaft'")
    if kind.gear_power is None and entry.shaft is not None:
        place = document.place("parameters", name, "shaft")
        return Problem(f"{kind.symbol} belongs to no shaft", place, remedy="remove 'shaft'")
    try:
        value = parse_quantity(entry.value, kind.dimension)
    except ValueError as error:
        return Problem(f"{kind.symbol}: {error}", document.place("parameters", name, "value"), value=entry.value)
    try:
        tolerance = _tolerance(entry.tolerance, kind.dimension)
    except ValueError as error:
        place = document.place("parameters", name, "tolerance")
        return Problem(
            f"{kind.symbol}: {error}", place, value=entry.tolerance, allowed="'3 %' or an amount with its unit"
        )
    if tolerance.half_width(value) >= abs(value) and value != 0.0 and not kind.may_be_zero:
        place = document.place("parameters", name, "tolerance")
        return Problem(
            f"the tolerance of {kind.symbol} reaches zero", place, entry.tolerance, allowed="less than the value"
        )
    law = entry.temperature and TemperatureLaw(entry.temperature.coefficient, entry.temperature.reference)
    return Parameter(name, value, entry.shaft, tolerance, entry.source, law or None)


def _tolerance(text: str | float, dimension: str) -> Tolerance:
    is_relative = isinstance(text, str) and text.rstrip().endswith("%")
    amount = parse_quantity(text, "ratio" if is_relative else dimension)
    if amount < 0.0:
        raise ValueError("a tolerance is not negative")
    return Tolerance(amount, is_relative)


def _measured(document: Document[ModelFile], parameters: Mapping[str, Parameter]) -> dict[str, Measured]:
    found, problems = {}, []
    for name, entry in document.content.measured.items():
        try:
            found[name] = _one_measured(name, entry, parameters)
        except ValueError as error:
            problems.append(Problem(str(error), document.place("measured", name), value=entry.value))
    if "torque_constant" in found and "back_emf_constant" in found:
        what = "K_e and K_t are one number of one motor"
        problems.append(Problem(what, document.place("measured", "back_emf_constant"), remedy="give one of them"))
    if problems:
        raise InputError(*problems)
    return found


def _one_measured(name: str, entry: MeasuredEntry, parameters: Mapping[str, Parameter]) -> Measured:
    if name in NEVER:
        raise ValueError("no explanation moves it: state the value among the parameters")
    gear = parameters["gear_ratio"].value
    is_rotary = name in parameters and KINDS[name].gear_power is not None
    if is_rotary != (entry.shaft is not None):
        raise ValueError(
            f"{name}: add the 'shaft' that it was measured at, motor or throttle"
            if is_rotary
            else f"{name} belongs to no shaft"
        )
    if name in parameters:
        dimension = KINDS[name].dimension
        value = parse_quantity(entry.value, dimension)
        uncertainty = _tolerance(entry.uncertainty, dimension).half_width(value)
        value, uncertainty = (
            dataclasses.replace(parameters[name], value=one, shaft=entry.shaft).at_shaft(parameters[name].shaft, gear)
            for one in (value, uncertainty)
        )
        if uncertainty == 0.0:
            raise ValueError("an uncertainty is above 0")
        if uncertainty >= abs(value) and not KINDS[name].may_be_zero:
            raise ValueError("the uncertainty reaches zero")
        return measured_parameter(parameters[name], value, uncertainty)
    from etb_hil.plant.effects.entries import measured_strength  # noqa: PLC0415 (numba comes only where there are effects)

    return measured_strength(name, entry.value, entry.uncertainty)


def _wrong_effects(document: Document[ModelFile]) -> list[Problem]:
    if not document.content.effects:
        return []
    from etb_hil.plant.effects.entries import problem_of  # noqa: PLC0415 (numba comes only where there are effects)

    found = [problem_of(entry.id, entry.strengths) for entry in document.content.effects]
    return [
        dataclasses.replace(wrong[1], place=document.place("effects", index, *wrong[0]))
        for index, wrong in enumerate(found)
        if wrong is not None
    ]


def _warn_of_ranges(document: Document[ModelFile], parameters: Mapping[str, Parameter]) -> None:
    gear = parameters["gear_ratio"].value
    for name, parameter in parameters.items():
        sentence = outside_table_one(parameter, gear)
        if sentence and getattr(document.content.parameters, name).outside_table_one is None:
            where = document.place("parameters", name, "value")
            warnings.warn(f"{where}: {sentence}", ParameterRangeWarning, stacklevel=4)
