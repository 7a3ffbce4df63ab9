"""Which signals of a recording tell the drive and the motion of a machine."""

from __future__ import annotations

from collections.abc import Sequence

from etb_hil.base.errors import InputError, Problem
from etb_hil.plant.device import Device, Driven
from etb_hil.plant.parameters import Model
from etb_hil.recording.recording import Recording

_FORCES = ("drive_force", "drive_torque")
_PLATE = "throttle_angle"


def driven_in(device: Device) -> str:
    """Return what a record says of the drive, in a word."""
    return "torque" if device.driven is Driven.FORCE and not device.is_linear else str(device.driven)


def drives_of(device: Device) -> tuple[str, ...]:
    """Return the roles of which one has to say what drives the machine."""
    if device.driven is Driven.VOLTAGE:
        return ("motor_voltage", "motor_duty")
    return ("motor_current",) if device.driven is Driven.CURRENT else _FORCES[:1] if device.is_linear else _FORCES[1:]


def angles_of(device: Device) -> tuple[str, ...]:
    """Return the roles of which one has to say where the machine is."""
    if device.is_throttle:
        return ("motor_angle", _PLATE)
    return ("linear_position" if device.is_linear else "drive_angle", "motor_angle")


def read_beside(device: Device) -> tuple[str, ...]:
    """Return the roles that are read beside the drive."""
    if device.is_throttle:
        return ("motor_current", *angles_of(device))
    beside = ("motor_current",) if device.has_winding else ("command_force" if device.is_linear else "command_torque",)
    return (*beside, *angles_of(device))


def must_be_of_one_kind(recordings: Sequence[Recording], model: Model) -> None:
    """Refuse a throttle's recording with a drive's model, and the reverse."""
    device, problems = model.device, list[Problem]()
    drives, angles = drives_of(device), angles_of(device)
    for recording in recordings:
        origin, roles = recording.origin, set(recording.roles)
        if device.is_throttle:
            if roles & set(_FORCES):
                what = f"{origin} is measured on a drive, but the model '{model.name}' is a throttle's"
                problems.append(Problem(what, remedy="give a drive's model file (schema etb_hil/drive/2)"))
        elif _PLATE in roles or not (roles & set(drives) and roles & set(angles)):
            motion = "linear" if device.is_linear else "rotary"
            of = f"a {motion} drive in {driven_in(device)}"
            what = f"{origin} is not measured on {of}, but the model '{model.name}' is one's"
            remedy = (
                "give the model file of what was measured: a drive's (schema etb_hil/drive/2) with its 'motion' and "
            )
            remedy += "'driven_by', a throttle's (schema etb_hil/model/1), or a stock one such as --model default"
            allowed = f"data with the roles {' or '.join(drives)} and {' or '.join(angles)}, and no {_PLATE}"
            problems.append(Problem(what, allowed=allowed, remedy=remedy))
    if problems:
        raise InputError(*problems)
