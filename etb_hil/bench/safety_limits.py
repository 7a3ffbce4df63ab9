"""The safety limits of a bench file."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from etb_hil.base.quantity import AngularVelocity, Current, Duration, Temperature, Voltage
from etb_hil.base.yamlfile import FileModel
from etb_hil.scenario.phase import Between


class SafetyLimits(FileModel):
    """What the bench never commands, and never lets happen with the drive on."""

    current: Annotated[Current, Field(gt=0)]
    voltage: Annotated[Voltage, Field(gt=0)]
    angle: Annotated[Between, Field(description="of the driven plate; with the drive off, its springs move it")]
    velocity: Annotated[AngularVelocity, Field(gt=0, description="of the driven plate, measured as its mean over 5 ms")]
    temperature: Temperature
    duration: Annotated[Duration, Field(gt=0, description="of a whole run with all its attempts")]
    frame_age: Annotated[Duration, Field(gt=0, description="oldest sample on which the plate may move")] = 0.1
