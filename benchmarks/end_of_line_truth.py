"""What an end-of-line run should have measured: the plant's true motion of the same unit, and its parameters.

The motion is recorded beside the run, on the clock of the bus. What noise of the sensors changes through the controller
is averaged over other runs of the same unit. The code that reads times and angles from the motion shares no line with
the diagnosis.
"""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from etb_hil.canio.bus.link import VirtualLink
from etb_hil.canio.bus.virtual_network import VirtualNetwork
from etb_hil.canio.frames import concatenate_frames
from etb_hil.controller.virtual_controller import VirtualController
from etb_hil.plant.integrator import CURRENT, OMEGA, THETA

SLOW = math.radians(10.0)
FINE = 20e-6  # s
BAND = math.radians(1.0)


class Recorder:
    """A node that runs a controller in pieces and keeps the plant's true state after each.

    Pieces begin with the controller's ticks: its voltage, and with it the third derivative of the angle, steps there.
    """

    def __init__(self, controller, piece_ns):
        self._controller, self._piece_ns = controller, piece_ns
        self._now_ns = 0
        self.rows = []

    def run(self, until_ns, inbox):
        blocks, first = [], inbox
        while self._now_ns < until_ns:
            since_ns = self._now_ns - self._controller.start_ns
            self._now_ns = min(until_ns, self._now_ns + self._piece_ns - since_ns % self._piece_ns)
            blocks.append(self._controller.run(self._now_ns, first))
            first = None
            state = self._controller.plant_state
            time = self._controller.start_ns * 1e-9 + self._controller.time
            self.rows.append((time, state[THETA], state[OMEGA], state[CURRENT]))
        return concatenate_frames(blocks) if blocks else self._controller.run(until_ns, inbox)

    @property
    def motion(self):
        """Time s on the clock of the bus, true angle rad, velocity rad/s and current A: (n, 4)."""
        rows = np.array(self.rows)
        return rows[np.flatnonzero(np.diff(rows[:, 0], prepend=-1.0) > 0.0)]


def recording_connect(piece_s, start_ns, ambient, recorders):
    """Return what opens the virtual bench with a recorder around the controller, which is appended to `recorders`."""

    def connect(job, seed):
        bus, dialect = job.setup.bench.bus, job.setup.dialect
        network = VirtualNetwork(int(bus.bitrate), int(bus.data_bitrate), fd=bus.fd)
        controller = VirtualController(
            job.unit, dialect, seed, nominal=job.model, start_ns=start_ns, ambient=ambient,
            law=job.setup.bench.law or "pd",
        )  # fmt: skip
        recorders.append(Recorder(controller, round(piece_s * 1e9)))
        network.attach(recorders[-1], controller.sends)
        return VirtualLink(network), network.clock

    return connect


@dataclass(frozen=True)
class Commands:
    """The commands of a run: s on the clock of the bus, mode, position rad."""

    time: np.ndarray
    mode: np.ndarray
    position: np.ndarray


def commands_of(finished):
    recording = finished.analysis.recording
    block = next(recording.block(one) for one in recording.sources if "command_mode" in recording.block(one).columns)
    return Commands(block.stamp_ns * 1e-9, block.columns["command_mode"], block.columns["command_position"])


def phases_of(finished, kind):
    """Yield begin and end in s of the phases of a kind."""
    for phase in finished.record.phases:
        if phase.kind == kind:
            yield phase.start_ns * 1e-9, phase.end_ns * 1e-9


def of_motion(finished, motion):
    """Return the truths that the motion of a run holds, by the ids of the measurements."""
    coarse, true_angle, velocity, current = motion.T
    time = np.arange(coarse[0], coarse[-1], FINE)
    angle = CubicHermiteSpline(coarse, true_angle, velocity)(time)
    current = np.interp(time, coarse, current)
    given = commands_of(finished)
    found = defaultdict(list)
    for begin, end in phases_of(finished, "step"):
        for name, value in _steps(time, angle, given, begin, end):
            found[name].append(value)
    rests = {"open": [], "closed": []}
    for begin, end in phases_of(finished, "release"):
        off = given.time[(given.time > begin) & (given.mode == 0.0)][0]
        part = (time >= off) & (time < end)
        t, a = time[part], angle[part]
        rest = float(a[t > end - 0.05].mean())
        side = "open" if a[0] > rest else "closed"
        rests[side].append(rest)
        found[f"return_time_{side}"].append(_stays(t, a - rest, BAND) - off)
    for _, end in phases_of(finished, "hold"):
        found["holding_current"].append(float(current[(time > end - 0.2) & (time < end)].mean()))
    truths = {name: float(np.mean(values)) for name, values in found.items()}
    if all(rests.values()):
        truths["default_position"] = 0.5 * (np.mean(rests["open"]) + np.mean(rests["closed"]))
        truths["default_position_spread"] = max(map(max, rests.values())) - min(map(min, rests.values()))
    return truths


def _steps(time, angle, given, begin, end):
    inside = np.flatnonzero((given.time > begin) & (given.time < end + 1e-3))
    position = given.position[inside]
    jumps = [
        k
        for k in range(3, len(inside))
        if abs(position[k] - position[k - 1]) > 0.017 and not np.ptp(position[k - 3 : k])
    ]
    edges = [*jumps, len(inside) - 1]
    for k, after in pairwise(edges):
        start, stop = given.time[inside[k]], given.time[inside[after]]
        old = angle[(time > start - 0.02) & (time < start)].mean()
        new = angle[(time > stop - 0.02) & (time < stop)].mean()
        part = (time > start) & (time < stop)
        share = (angle[part] - old) / (new - old)
        t = time[part]
        size = "small" if abs(position[k] - position[k - 1]) < SLOW else "large"
        way = "opening" if new > old else "closing"
        tenth, ninth = _reaches(t, share, 0.1), _reaches(t, share, 0.9)
        yield f"step_delay_{size}_{way}", tenth - start
        yield f"step_rise_{size}_{way}", ninth - tenth
        yield f"step_settling_{size}_{way}", _stays(t, share - 1.0, 0.05) - start
        yield f"step_overshoot_{size}_{way}", max(share.max() - 1.0, 0.0)


def _reaches(time, value, level):
    k = int(np.argmax(value >= level))
    return np.interp(level, value[k - 1 : k + 1], time[k - 1 : k + 1])


def _stays(time, away, band):
    k = int(np.flatnonzero(np.abs(away) > band)[-1])
    return np.interp(-band, -np.abs(away[k : k + 2]), time[k : k + 2])


def of_parameters(unit, soaked=0.0):
    """Return the truths that the unit's parameters hold; its winding is `soaked` K warmer than its housing."""
    values, parameter = unit.values, unit.parameters["resistance"]
    law = parameter.temperature
    strengths = {entry.id: entry.strengths for entry in unit.effects}
    disc, lag = strengths.get("angle_sensor_eccentricity", {}), strengths.get("sensor_hysteresis", {})
    wave = math.hypot(_si(disc.get("sine")), _si(disc.get("cosine"))) / values.gear_ratio
    half = _si(lag.get("half_width"))
    return {
        "T_st": values.stiction,
        "T_c": values.coulomb,
        "viscous": values.viscous,
        "return_margin": values.return_margin,
        "spring_torque_open": values.preload_open,
        "spring_torque_close": values.preload_close,
        "spring_slope_open": values.slope_open,
        "spring_slope_close": values.slope_close,
        "winding_resistance": parameter.value * law.factor(20.0) / (1.0 + law.coefficient * soaked),
        "plate_sensor_deviation": wave + half,
        "plate_sensor_hysteresis": 2.0 * half,
    }


def _si(text):
    return 0.0 if text is None else float(str(text).split()[0])
