"""Columns of a run for the plots of its report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Self

import numpy as np

from etb_hil.recording.samples import Float64


def _none() -> Float64:
    return np.empty(0)


@dataclass(frozen=True, slots=True)
class ReportSeries:
    """Columns for the plots, each group of one length; empty where the run has none.

    Traces (n): `time` s, `angle` rad, `velocity` rad/s, `current` A, `friction` N·m, `temperature` degC (or empty).
    Points that the Stribeck curve was fitted to (m): `point_velocity` rad/s, `point_friction` N·m, and for the map
    `point_angle` rad, `point_temperature` degC, `point_excess` (share above the curve), `point_overlap` (of their
    windows).
    The curve (k): `curve_velocity`, `curve_friction`, and its 95 % band `curve_low`, `curve_high`.
    Friction over angle while sliding slowly, points in any order: `opening_angle`, `opening_friction`;
    `closing_angle`, `closing_friction`.
    Break-aways from rest: `break_away_rate` N·m/s, `break_away_torque` N·m (negative ones closing), and the means at
    several rates: `ramp_rate`, `ramp_torque`, `ramp_low`, `ramp_high`.
    """

    time: Float64 = field(default_factory=_none)
    angle: Float64 = field(default_factory=_none)
    velocity: Float64 = field(default_factory=_none)
    current: Float64 = field(default_factory=_none)
    friction: Float64 = field(default_factory=_none)
    temperature: Float64 = field(default_factory=_none)
    point_velocity: Float64 = field(default_factory=_none)
    point_friction: Float64 = field(default_factory=_none)
    point_angle: Float64 = field(default_factory=_none)
    point_temperature: Float64 = field(default_factory=_none)
    point_excess: Float64 = field(default_factory=_none)
    point_overlap: Float64 = field(default_factory=_none)
    curve_velocity: Float64 = field(default_factory=_none)
    curve_friction: Float64 = field(default_factory=_none)
    curve_low: Float64 = field(default_factory=_none)
    curve_high: Float64 = field(default_factory=_none)
    opening_angle: Float64 = field(default_factory=_none)
    opening_friction: Float64 = field(default_factory=_none)
    closing_angle: Float64 = field(default_factory=_none)
    closing_friction: Float64 = field(default_factory=_none)
    break_away_rate: Float64 = field(default_factory=_none)
    break_away_torque: Float64 = field(default_factory=_none)
    ramp_rate: Float64 = field(default_factory=_none)
    ramp_torque: Float64 = field(default_factory=_none)
    ramp_low: Float64 = field(default_factory=_none)
    ramp_high: Float64 = field(default_factory=_none)

    def __post_init__(self) -> None:
        for leader, *followers in _GROUPS:
            length = len(getattr(self, leader))
            for name in followers:
                if len(getattr(self, name)) not in (0, length):
                    raise ValueError(f"'{name}' has {len(getattr(self, name))} values, '{leader}' has {length}")

    @classmethod
    def from_mapping(cls, columns: Mapping[str, Any]) -> Self:
        """Take the columns by name.

        Names not known here are left alone, missing ones are empty.
        """
        known = {f.name for f in fields(cls)}
        return cls(**{name: np.asarray(values, float) for name, values in columns.items() if name in known})


_GROUPS = (
    ("time", "angle", "velocity", "current", "friction", "temperature"),
    ("point_velocity", "point_friction", "point_angle", "point_temperature", "point_excess", "point_overlap"),
    ("curve_velocity", "curve_friction", "curve_low", "curve_high"),
    ("opening_angle", "opening_friction"),
    ("closing_angle", "closing_friction"),
    ("break_away_rate", "break_away_torque"),
    ("ramp_rate", "ramp_torque", "ramp_low", "ramp_high"),
)
