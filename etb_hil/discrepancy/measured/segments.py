"""Segments of a recording: without gaps, evenly sampled, long enough."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.errors import InputError, Problem
from etb_hil.discrepancy.measured.angles import Angles, must_count_turns
from etb_hil.discrepancy.measured.device_roles import angles_of, drives_of, read_beside
from etb_hil.discrepancy.measured.measurement import CHANGES, SLOWEST, Measurement
from etb_hil.discrepancy.measured.plausibility import TOO_FAR, off_by, suspected
from etb_hil.discrepancy.measured.repair.clock import even_times
from etb_hil.discrepancy.measured.repair.repaired import repaired
from etb_hil.plant.device import Device
from etb_hil.plant.parameters import Model
from etb_hil.recording.recording import Recording
from etb_hil.recording.samples import Float64, Int64

SHORTEST = 2.0  # s; what is shorter shows no cause
LONGEST_GAP = 0.05  # s that are bridged; beyond it the record falls apart
ROOM_TEMPERATURE = 25.0
_SLOW = ("temperature", "supply_voltage")  # between their samples a straight line is as good
_ONE_SAMPLE = (1.5, 2.5)  # steps from one value to the next with one sample missing between
_MOST_POINTS = 10  # on the even clock for each sample: more lie in gaps, cost memory and time, and say nothing
_STANDS = 12.0  # times the angle's noise: what moves less stands still
_NEEDS = {  # what to do about a drive or an angle that is missing
    "drive": "a free run needs it: record one of them, or name its column in a map",
    "angle": "give it, calibrated, in its unit, or name its column in a map",
}


def measurements_of(recording: Recording, model: Model) -> list[Measurement]:
    """Return a recording's segments that are long enough and move.

    InputError where roles are missing.
    """
    roles = [role for role in recording.roles if np.isfinite(recording.series(role).values).any()]
    drives, angles = drives_of(model.device), angles_of(model.device)
    for kind, wanted in (("drive", drives), ("angle", angles)):
        if not set(wanted) & set(roles):
            what = f"{recording.origin} has no values of {' or '.join(wanted)}, only of {', '.join(roles) or 'nothing'}"
            raise InputError(Problem(what, remedy=_NEEDS[kind]))
    if model.device.has_winding and "motor_current" in roles and math.isinf(model.sensors.current_noise):
        what = f"{recording.origin} has a motor_current, and the model '{model.name}' does not say how noisy it is"
        raise InputError(Problem(what, remedy="state driven_by.voltage.current_noise, or leave the column out"))
    drive = next(role for role in drives if role in roles)
    samples = recording.joined([drive, *(role for role in read_beside(model.device) if role in roles)])
    columns = dict(samples.columns)
    for role in (role for role in _SLOW if role in roles):
        series = recording.series(role)
        known = np.isfinite(series.values)
        columns[role] = np.interp(samples.time_ns, series.time_ns[known], series.values[known])
    return _segments(recording, samples.time_ns, columns, model)


def _segments(
    recording: Recording, time_ns: NDArray[np.int64], columns: dict[str, Float64], model: Model
) -> list[Measurement]:
    origin = recording.origin
    if len(time_ns) < 2:
        raise InputError(Problem(f"{origin} has fewer than two samples"))
    samples = _without_long_gaps(time_ns, columns, model.device)
    time_ns, columns = time_ns[samples], {role: values[samples] for role, values in columns.items()}
    if len(time_ns) < 2:
        raise InputError(Problem(f"{origin} has fewer than two samples with both a voltage or force and an angle"))
    must_count_turns(origin, (time_ns - time_ns[0]) * 1e-9, columns)
    steps = np.diff(time_ns)
    step = float(np.median(steps)) * 1e-9
    if float(steps.max()) < 1.5e9 * step:
        step = float(time_ns[-1] - time_ns[0]) * 1e-9 / len(steps)
    cuts = np.flatnonzero(np.diff(time_ns) * 1e-9 > max(LONGEST_GAP, 3.0 * step)) + 1
    found: list[Measurement] = []
    problems: list[Problem] = []
    short: list[NDArray[np.int64]] = []
    for part in np.split(np.arange(len(time_ns)), cuts):
        if len(part) < 2 or (time_ns[part[-1]] - time_ns[part[0]]) * 1e-9 < SHORTEST:
            short.append(part)
            continue
        try:
            own = {role: values[part] for role, values in columns.items()}
            times, scattered = even_times(
                time_ns[part], own[next(role for role in angles_of(model.device) if role in own)]
            )
            apart = float(times[-1] - times[0]) * 1e-9 / (len(times) - 1) if scattered else step
            even = _even(origin, times, own, apart, model)
            _must_move(even, model)
            even = repaired(even, model)
            flags = (*scattered, *even.flags, *_filled_in(times, own, apart))
            found.append(replace(even, flags=flags))
        except InputError as error:
            problems += error.problems
    if problems and not found:
        raise InputError(*problems)
    if found and found[0].rate < SLOWEST:
        what, rate = f"{origin} is sampled too slowly", f"{found[0].rate:.0f} Hz"
        raise InputError(Problem(what, value=rate, allowed=f"from {SLOWEST:g} Hz"))
    if not found:
        what = f"{origin} has no segment of {SHORTEST:g} s without a gap"
        raise InputError(Problem(what, remedy="measure longer, look for lost samples"))
    said = [*recording.notes, *_left_out(time_ns, short, SHORTEST), *(f"left out: {problem}" for problem in problems)]
    return [replace(found[0], flags=(*found[0].flags, *said)), *found[1:]]


def _without_long_gaps(time_ns: NDArray[np.int64], columns: dict[str, Float64], device: Device) -> NDArray[np.bool_]:
    """Return the samples (n) outside gaps of drive or angle that are too long."""
    kept = np.ones(len(time_ns), np.bool_)
    for wanted in (drives_of(device), angles_of(device)):
        role = next(role for role in wanted if role in columns)
        known = np.isfinite(columns[role])
        times = np.concatenate([time_ns[:1] - 1, time_ns[known], time_ns[-1:] + 1])
        after = np.searchsorted(times, time_ns, "right")
        gap = times[np.minimum(after, len(times) - 1)] - times[after - 1]
        kept &= known | (gap * 1e-9 <= LONGEST_GAP)
    return kept


def _must_move(m: Measurement, model: Model) -> None:
    """Refuse a segment at rest, or with more travel than the model's stops allow."""
    way, unit = float(np.ptp(m.angle)), "m" if m.device.is_linear else "rad"
    if way <= _STANDS * m.angle_noise:
        what = f"{m.origin} stands still from {m.start_s:.1f} s on"
        least = f"more than {_STANDS * m.angle_noise:.2g} {unit}"
        remedy = "move it over its travel, such as by the scenario isolability"
        raise InputError(Problem(what, value=f"{way:.2g} {unit}", allowed=least, remedy=remedy))
    between = model.values.stop_high - model.values.stop_low
    if m.device.is_throttle and way > TOO_FAR * between:
        what = f"{m.origin}: the plate moves beyond the model's stops"
        if way / off_by("deg", "rad") <= TOO_FAR * between:
            what += f"; {suspected('deg', 'rad')}"
        remedy = "check the angle's unit (rad or deg), and the model's gear_ratio and stops"
        far, most = (f"{math.degrees(one):.3g} deg" for one in (way, TOO_FAR * between))
        raise InputError(Problem(what, value=far, allowed=f"up to {most}", remedy=remedy))


def _even(
    origin: str, time_ns: NDArray[np.int64], columns: dict[str, Float64], step: float, model: Model
) -> Measurement:
    start = int(time_ns[0])
    seconds = (time_ns - start) * 1e-9
    count = int(np.floor(seconds[-1] / step + 1e-6)) + 1
    if count > _MOST_POINTS * len(seconds):
        what = (
            f"{origin} has {len(seconds)} samples in {seconds[-1]:.3g} s, half of them within {step:.2g} s of another"
        )
        remedy = "remove rows that repeat the one before, or record at a steady rate"
        raise InputError(Problem(what, remedy=remedy))
    clock = np.arange(count) * step
    is_even = count == len(seconds) and float(np.abs(seconds - clock).max()) < 0.05 * step
    good = np.ones(count, bool)
    even = {}
    for role, values in columns.items():
        known = np.isfinite(values)
        if not known.any():
            continue
        if is_even and known.all():
            even[role] = np.asarray(values, np.float64)
            continue
        even[role] = np.interp(clock, seconds[known], values[known])
        nearest = np.clip(np.searchsorted(seconds[known], clock), 1, int(known.sum()) - 1)
        if role not in _SLOW:
            good &= seconds[known][nearest] - seconds[known][nearest - 1] < 2.5 * step
    return _measurement(origin, start * 1e-9, 1.0 / step, even, good, model)


def _measurement(
    origin: str, start: float, rate: float, even: dict[str, Float64], good: NDArray[np.bool_], model: Model
) -> Measurement:
    device, flags = model.device, list[str]()
    if "motor_duty" in even and "motor_voltage" not in even:
        voltage = even["motor_duty"] * even.get(
            "supply_voltage", np.full_like(even["motor_duty"], model.values.supply_voltage)
        )
        flags.append("motor_voltage is duty times supply")
    else:
        voltage = even[next(role for role in drives_of(device) if role in even)]
    temperature = even.get("temperature")
    angles = Angles.of(even, model)
    return Measurement(
        origin=origin,
        rate=rate,
        start_s=start,
        voltage=voltage,
        angle=angles.angle,
        angle_noise=angles.noise,
        current=even.get("motor_current") if device.has_winding else voltage,
        plate=angles.plate,
        temperature=np.full(len(angles.angle), ROOM_TEMPERATURE) if temperature is None else temperature,
        has_temperature=temperature is not None and float(np.ptp(temperature)) > CHANGES,
        is_good=good,
        sensors=model.sensors,
        flags=(*angles.flags, *flags),
        is_plates=angles.is_plates,
        encoder=angles.encoder,
        device=device,
        added=even.get("command_force", even.get("command_torque")),
    )


def _filled_in(time_ns: Int64, columns: Mapping[str, Float64], step: float) -> list[str]:
    """Say what share of samples of columns (n) is missing, and what share filled in.

    `step`: time between two samples in s.
    """
    samples = round(float(time_ns[-1] - time_ns[0]) * 1e-9 / step) + 1
    found: dict[tuple[int, int], list[str]] = {}
    for role, values in columns.items():
        known = time_ns[np.isfinite(values)]
        if role in _SLOW or not len(known) or len(known) >= samples:
            continue
        apart = np.diff(known) * 1e-9 / step
        filled = int(np.count_nonzero((apart > _ONE_SAMPLE[0]) & (apart < _ONE_SAMPLE[1])))
        filled += round(float(known[0] - time_ns[0] + time_ns[-1] - known[-1]) * 1e-9 / step)
        if filled:
            found.setdefault((samples - len(known), min(filled, samples - len(known))), []).append(role)
    return [
        f"{_percent(lacking, samples)} of the samples have no {', '.join(roles)}; {_percent(filled, samples)}, single "
        "ones and those at the ends, are interpolated and judged"
        for (lacking, filled), roles in found.items()
    ]


def _left_out(time_ns: Int64, parts: Sequence[Int64], shortest: float) -> list[str]:
    """Say which parts (sample numbers) of a record are shorter than `shortest` in s."""
    if not parts:
        return []
    pieces = "1 segment" if len(parts) == 1 else f"{len(parts)} segments"
    seconds = sum(float(time_ns[part[-1]] - time_ns[part[0]]) * 1e-9 for part in parts)
    samples = _percent(sum(map(len, parts)), len(time_ns))
    return [f"{pieces} of less than {shortest:g} s between gaps left out: {seconds:.2g} s, {samples} of the samples"]


def _percent(part: int, whole: int) -> str:
    return f"{100.0 * part / whole:.2g} %"
