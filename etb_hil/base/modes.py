"""Modes of a throttle controller.

The numbers are those of the command frame.
"""

from __future__ import annotations

from enum import IntEnum


class Mode(IntEnum):
    """Command modes of the controller."""

    OFF = 0
    POSITION = 1
    VELOCITY = 2
    VOLTAGE = 3
    LIMP_HOME = 4
