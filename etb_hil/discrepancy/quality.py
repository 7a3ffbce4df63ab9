"""What the data are worth: gaps, saturation, encoder steps, noise at rest, and what they cannot show."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.balances import Balances
from etb_hil.discrepancy.measurement import Measurement
from etb_hil.plant.parameters import Model

Float64 = NDArray[np.float64]

_BURST = 64
_AT_LIMIT = 0.02  # of the time at the voltage's limit that is worth a word
_TINY = 1e-12


def data_quality(balances: Sequence[Balances], model: Model) -> list[dict[str, Any]]:
    """Return what was found of each stretch, and in words what it cannot show."""
    return [_of(b, model) for b in balances]


def _of(b: Balances, model: Model) -> dict[str, Any]:
    m = b.measured
    flags = list(m.flags)
    bridged = float(1.0 - np.mean(m.is_good))
    if bridged > 0.0:
        flags.append(f"{100.0 * bridged:.2f} % of the rows were missing or bad and are not judged")
    limit = model.values.voltage_limit
    saturated = float(np.mean(np.abs(m.voltage) > 0.995 * limit))
    if saturated > _AT_LIMIT:
        flags.append(f"the voltage is at its limit {100.0 * saturated:.0f} % of the time")
    if m.current is None:
        flags.append("motor_current is missing: one balance only, from the voltage; electrical causes cannot be judged")
    if m.plate is None:
        flags.append("no second angle: what lies between motor and plate cannot be judged")
    if not m.has_temperature:
        flags.append("no temperature, or a constant one: heat cannot be told from time")
    travel = (float(m.angle.min()), float(m.angle.max()))
    if travel[0] > model.values.limp_home or travel[1] < model.values.limp_home:
        flags.append("limp-home is never crossed: preload, offset and asymmetry cannot be told apart")
    flags += _filtered(m)
    found: dict[str, Any] = {
        "origin": m.origin,
        "rate_hz": m.rate,
        "seconds": len(m) / m.rate,
        "travel_rad": list(travel),
        "encoder_noise_rad": m.angle_noise,
        "flags": flags,
    }
    at_rest = _at_rest(m)
    if at_rest:
        found["noise_at_rest"] = at_rest
    return found


def _filtered(m: Measurement) -> list[str]:
    """Flag an angle whose noise is far below what its own sensor's steps would leave: somebody filtered it."""
    step = np.diff(m.angle)
    high = np.diff(step, 2)
    still = np.abs(high) > 0.0
    if not still.any() or m.angle_noise <= 0.0:
        return []
    rms = float(np.sqrt(np.mean(high**2)))
    promised = m.angle_noise * np.sqrt(20.0)  # white steps through a third difference
    if rms < 0.05 * promised and "motor_angle is missing" not in " ".join(m.flags):
        return ["the angle is smoother than its encoder can be: it was filtered before"]
    return []


def _at_rest(m: Measurement) -> dict[str, float]:
    """Return the noise (rms of second differences, as white noise) where the angle rests."""
    count = len(m) // _BURST
    angle = m.angle[: count * _BURST].reshape(count, _BURST)
    rest = np.ptp(angle, axis=1) < 4.0 * max(m.angle_noise, _TINY) * np.sqrt(12.0)
    if not rest.any():
        return {}
    found = {}
    for name, values in (
        ("motor_current_A", m.current),
        ("motor_voltage_V", m.voltage),
        ("throttle_angle_rad", m.plate),
    ):
        if values is not None:
            blocks = values[: count * _BURST].reshape(count, _BURST)[rest]
            found[name] = float(np.sqrt(np.mean(np.diff(blocks, 2, axis=1) ** 2) / 6.0))
    return found
