"""Residual curves of a balance over the coordinate that shows most, by direction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.fitting.balances import CHANNELS, Balances
from etb_hil.discrepancy.fitting.noise_floor import group_means
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import STRIBECK_VELOCITY, Vector
from etb_hil.recording.samples import Float64

ANGLE = "position"
_BINS = 40
_FEWEST = 5
_MOVING = 0.01  # of omega_s
_BETTER = 1.2  # times what the angle shows, from where another coordinate shows more
_UNITS = {"torque": "N·m", "voltage": "V", "angle": "rad"}


@dataclass(frozen=True, slots=True)
class ResidualCurve:
    """Means of a balance over a coordinate by direction, before and with the causes.

    SI; NaN where there are too few samples. Without causes there is the first alone.
    """

    balance: str
    unit: str
    over: str
    over_unit: str
    place: Float64
    forward: list[Float64]
    back: list[Float64]


def residual_curves(b: Balances, before: Vector, after: Vector | None) -> list[ResidualCurve]:
    """Return the torque residual over angle and, if it shows more, another curve.

    `after`: with the causes, None where there are none.
    """
    models = [before] if after is None else [before, after]
    means, samples = group_means([b], before)
    over = [float(np.sum((samples * np.maximum(means - 1.0, 0.0))[3 * k : 3 * k + 3])) for k in range(3)]
    worst = int(np.argmax(over))
    coordinates = _coordinates(b, before)
    shares = {name: _share(b, before, worst, values) for name, (values, _) in coordinates.items()}
    best = max(shares, key=lambda name: shares[name])
    if shares[best] < _BETTER * shares[ANGLE]:
        best = ANGLE
    found = [_residual_curve(b, models, 0, ANGLE, coordinates)]
    if worst != 0 or best != ANGLE:
        found.append(_residual_curve(b, models, worst, best, coordinates))
    return found


def _coordinates(b: Balances, whole: Vector) -> Mapping[str, tuple[Float64, str]]:
    """Return coordinates (samples) by name with their units."""
    m, spectrum = b.measured, b.spectrum
    angle, velocity = b.motion(whole[:EXTENDED])
    length, turns = ("m", "m/s") if m.device.is_linear else ("rad", "rad/s")
    found = {
        ANGLE: (angle, length),
        "motor turn": (np.mod(angle * b.gear / (2.0 * np.pi), 1.0), "turns"),
        "velocity": (velocity, turns),
        "time": (np.arange(len(m)) * m.dt, "s"),
    }
    if m.has_temperature:
        found["temperature"] = (m.temperature, "degC")
    if m.current is not None and m.device.has_winding:
        found["current"] = (m.current, "A")
    return {name: (spectrum.picked(values), unit) for name, (values, unit) in found.items()}


def _share(b: Balances, whole: Vector, channel: int, values: Float64) -> float:
    """Return the share of a balance's square that its binned means explain."""
    left = b.channels(whole[:EXTENDED], whole[EXTENDED:])[channel]
    place = _place(values)
    made = total = 0.0
    for moving in _directions(b, whole):
        count = np.bincount(place[moving], minlength=_BINS)
        sums = np.bincount(place[moving], left[moving], _BINS)
        made += float(np.sum(sums**2 / np.maximum(count, 1)))
        total += float(np.sum(left[moving] ** 2))
    return made / max(total, 1e-12)


def _residual_curve(
    b: Balances, models: Sequence[Vector], channel: int, name: str, coordinates: Mapping[str, tuple[Float64, str]]
) -> ResidualCurve:
    values, unit = coordinates[name]
    edges = _edges(values)
    place = _place(values)
    means: list[list[Float64]] = []
    for whole in models:
        left = b.channels(whole[:EXTENDED], whole[EXTENDED:])[channel] / float(b.whitening(channel)[0])
        found = []
        for moving in _directions(b, whole):
            count = np.bincount(place[moving], minlength=_BINS)
            total = np.bincount(place[moving], left[moving], _BINS)
            with np.errstate(invalid="ignore", divide="ignore"):
                found.append(np.where(count >= _FEWEST, total / count, np.nan))
        means.append(found)
    balance = CHANNELS[channel]
    its = "N" if b.measured.device.is_linear and balance == "torque" else _UNITS[balance]
    shown = "force" if its == "N" else balance
    centres = 0.5 * (edges[1:] + edges[:-1])
    return ResidualCurve(shown, its, name, unit, centres, [one[0] for one in means], [one[1] for one in means])


def _directions(b: Balances, whole: Vector) -> list[NDArray[np.bool_]]:
    speed = b.spectrum.picked(b.motion(whole[:EXTENDED])[1])
    least = _MOVING * whole[STRIBECK_VELOCITY]
    good = b.regimes.is_good & ~b.regimes.is_stuck
    return [(speed > least) & good, (speed < -least) & good]


def _edges(values: Float64) -> Float64:
    return np.linspace(float(values.min()), float(values.max()) + 1e-12, _BINS + 1)


def _place(values: Float64) -> NDArray[np.int64]:
    return np.clip(np.digitize(values, _edges(values)) - 1, 0, _BINS - 1)
