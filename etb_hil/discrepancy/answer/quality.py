"""Quality of the data: gaps, saturation, encoder steps, noise at rest, limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.angles import grid_of
from etb_hil.discrepancy.measured.device_roles import driven_in
from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.regimes import GUARD_TIME
from etb_hil.discrepancy.measured.sampling import in_blocks
from etb_hil.plant.effects.effect import REFERENCE
from etb_hil.plant.effects.laws import laws, terms
from etb_hil.plant.parameters import Model
from etb_hil.results.explained.residual import DataQuality

_BURST = 64
_AT_LIMIT = 0.02  # of the time at the voltage's limit that is worth a word
_TINY = 1e-12
_GRID_SLACK = 0.05  # of a step
_FEWEST_JUMPS = 5
_SAME_UNIT = 0.2
_WIDE = 0.5  # rad of motion that tells a scale
_SAME_RATIO = 0.003  # soft shafts and play are 0.002 and less, sensors that are no line 0.001
_OFF_GRID = 0.5  # share of the samples from which it is said


def data_quality(balances: Sequence[Balances], model: Model) -> tuple[DataQuality, ...]:
    """Return the quality of each segment, with remarks on its limits."""
    return tuple(_of(b, model) for b in balances)


def _of(b: Balances, model: Model) -> DataQuality:
    m = b.measured
    flags = list(m.flags)
    bridged = float(1.0 - np.mean(m.is_good))
    if bridged > 0.0:
        unjudged = float(1.0 - np.mean(b.regimes.is_good))
        what = f"are missing or bad{', or the bridge was open' if m.device.has_winding else ''}"
        excluded = f"the analysis excludes them and {GUARD_TIME:g} s around them, {100.0 * unjudged:.3g} % in all"
        flags.append(f"{100.0 * bridged:.2g} % of the samples {what}: {excluded}")
    limit = model.values.voltage_limit
    saturated = float(np.mean(np.abs(m.voltage) > 0.995 * limit))
    if saturated > _AT_LIMIT:
        flags.append(f"the voltage is at its limit {100.0 * saturated:.0f} % of the time")
    if not m.device.has_winding:
        flags.append(f"driven in {driven_in(m.device)}: electrical causes cannot be judged")
    elif m.current is None:
        flags.append("motor_current is missing: one balance only, from the voltage; electrical causes cannot be judged")
    if m.device.is_throttle and m.plate is None and not m.is_plates:
        flags.append("no second angle: gear and shaft between motor and plate cannot be judged")
    if not m.has_temperature:
        flags.append(
            "no temperature, or a constant one: effects of temperature cannot be distinguished from changes over time"
        )
    flags += _laws(model)
    travel = (float(m.angle.min()), float(m.angle.max()))
    if m.device.is_throttle and (travel[0] > model.values.limp_home or travel[1] < model.values.limp_home):
        flags.append("limp-home is never crossed: preload, offset and asymmetry cannot be distinguished")
    flags += _off_grid(m) + _other_unit(m) + _other_ratio(m, model)
    unit = "m" if m.device.is_linear else "rad"
    return DataQuality(
        origin=m.origin,
        rate_hz=m.rate,
        duration_s=len(m) / m.rate,
        flags=tuple(flags),
        travel=travel,
        angle_noise=float(m.angle_noise),
        travel_unit=unit,
        noise_at_rest=_at_rest(m),
    )


def _off_grid(m: Measurement) -> list[str]:
    """Flag an angle that is off its encoder's steps: it was filtered or resampled."""
    step = m.angle_noise * np.sqrt(12.0)
    if step <= 0.0 or grid_of(m.angle) > 0.0 or m.is_plates:
        return []
    away = m.angle / step - np.round(m.angle / step)
    away -= np.median(away)
    off = float(np.mean(np.abs(away - np.round(away)) > _GRID_SLACK))
    if off < _OFF_GRID:
        return []
    return [
        f"{100.0 * off:.1f} % of the angles lie off the encoder's steps: the signal was filtered or resampled before"
    ]


def _other_ratio(m: Measurement, model: Model) -> list[str]:
    """Flag two angles whose ratio a compliant shaft does not explain."""
    if m.plate is None or float(np.ptp(m.angle)) < _WIDE:
        return []
    # Backlash adds a step to the plate's angle at limp-home, where the springs' torque changes its sign.
    side = np.sign(m.angle - model.values.limp_home)
    times = float(np.linalg.lstsq(np.column_stack([m.angle, side, np.ones(len(m))]), m.plate)[0][0])
    if abs(times - 1.0) < _SAME_RATIO:
        return []
    gear = f"the gear ratio of {model.values.gear_ratio:g}"
    moves = f"the plate sensor moves {times:.4f} times as far as the motor's angle through {gear}"
    return [f"{moves}: check that ratio and the scales of both sensors"]


def _other_unit(m: Measurement) -> list[str]:
    """Flag a commanded force whose steps differ from the drive's."""
    if m.added is None:
        return []
    jumps = np.diff(m.added)
    edges = np.flatnonzero(np.abs(jumps) > 0.5 * np.abs(jumps).max(initial=0.0))
    if len(edges) < _FEWEST_JUMPS:
        return []
    times = float(np.median(np.diff(m.voltage)[edges] / jumps[edges]))
    if abs(times - 1.0) < _SAME_UNIT:
        return []
    what, unit = ("force", "N") if m.device.is_linear else ("torque", "N·m")
    come = f"a step of 1 {unit} changes the drive's {what} by {times:.2g} {unit}"
    return [f"command_{what} has another unit than stated: {come}; it may be a voltage"]


def _at_rest(m: Measurement) -> dict[str, float]:
    """Return the noise (rms of second differences, as white noise) at rest."""
    rest = np.ptp(in_blocks(m.angle, _BURST), axis=1) < 4.0 * max(m.angle_noise, _TINY) * np.sqrt(12.0)
    if not rest.any():
        return {}
    found = {}
    for name, values in (
        ("motor_current_A", m.current),
        ("motor_voltage_V", m.voltage),
        ("throttle_angle_rad", m.plate),
    ):
        if values is not None:
            found[name] = float(np.sqrt(np.mean(np.diff(in_blocks(values, _BURST)[rest], 2, axis=1) ** 2) / 6.0))
    return found


def _laws(model: Model) -> list[str]:
    """Return remarks on the use of the model file's temperature laws."""
    stated = laws(model.parameters)
    if not stated:
        return []
    if model.has_laws_as_terms:
        obeyed = terms(model.parameters)
        rest = {name: law.reference for name, law in stated.items() if name not in obeyed}
        what = "follow the model file's temperature coefficients; their values are given at"
        found = [f"{', '.join(obeyed)} {what} {REFERENCE:g} degC"] if obeyed else []
        for at in set(rest.values()):
            what = f"are constant at the model file's values for {at:.3g} degC, the recording's middle temperature"
            found.append(f"{', '.join(rest)} {what}: their change with temperature is neglected")
        return found
    more = ", ".join(f"{name} {1000.0 * law.coefficient:+.2g} %" for name, law in stated.items())
    what = "no temperature: 10 K above the model file's reference temperature a healthy unit has"
    return [f"{what} {more}, and the analysis takes that for a fault"]
