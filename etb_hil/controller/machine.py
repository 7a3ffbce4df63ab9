"""The throttle with its controller, without a bus.

Events go in, samples and statuses come out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.reference_temperature import REFERENCE_TEMPERATURE
from etb_hil.base.rewinding import Rewindable
from etb_hil.controller import monitors
from etb_hil.controller.kernel import ARRIVED, run_ticks
from etb_hil.controller.laws.choice import failed_law, law_gains, law_number
from etb_hil.controller.noise import generator
from etb_hil.controller.reference import PRESS
from etb_hil.controller.sensors import data_sheet
from etb_hil.controller.state import (
    BURST_SAMPLES,
    CONTROL_TICKS,
    EVENT_WIDTH,
    STATUS_TICKS,
    TICK_NS,
    Sample,
    Settings,
    State,
    Status,
    Switch,
    record,
)
from etb_hil.plant.extended import new_sensed_state
from etb_hil.plant.failed_unit import failed_unit
from etb_hil.plant.integrator import CURRENT, OMEGA, STATES, THETA, new_state
from etb_hil.plant.model_file import FrictionModel
from etb_hil.plant.parameters import Model, ThrottleParameters
from etb_hil.plant.physics import GEAR_RATIO, SUPPLY_VOLTAGE, Vector

AMBIENT_C = REFERENCE_TEMPERATURE  # where the stock models state their values
HEATING_K_PER_W = 3.0  # housing over ambient; a throttle body in still air
HEATING_TIME_S = 600.0
BRAKING_SHARE = 0.6  # of the torque at stall: what is counted on for braking before a stop

_SLICE_TICKS = 20_000  # a second a call of the kernel, so that its buffers stay in the cache's reach
_FIRST_INTERVAL = 10e-3  # s
_NO_EVENTS_NS = np.empty(0, np.int64)
_NO_EVENTS = np.empty((0, EVENT_WIDTH))


@dataclass(slots=True)  # not frozen: a bench in lock-step makes one a beat, and freezing trebles what it costs
class Output:
    """What came out of one segment, valid until the next.

    They are rows of `state.Sample`, `Status` and `Switch`.
    """

    samples: NDArray[np.void]
    statuses: NDArray[np.void]
    switches: NDArray[np.void]


class Machine(Rewindable):
    """One unit and its controller, switched on at `start_ns`.

    Its plate is at rest at `start_angle` (rad).

    `nominal` is what the controller believes of the unit and need not be true; `law` names its position law. Without a
    `start_angle` the plate rests where springs and friction may have left it. `has_single` and `has_burst` say for
    which kinds of measurement there are frames. `track_2_offset` (rad) is a fault of the second plate track.
    """

    LIVES = ("_state", "_plant", "_unit", "_burst")

    def __init__(
        self,
        unit: Model,
        nominal: Model,
        seed: int,
        *,
        start_ns: int = 0,
        start_angle: float | None = None,
        law: str = "pd",
        ambient: float = AMBIENT_C,
        has_single: bool = True,
        has_burst: bool = True,
        track_2_offset: float = 0.0,
    ) -> None:
        values, known = unit.values_at(ambient), nominal.values
        angle = resting_angle(values, seed) if start_angle is None else _inside_the_stops(start_angle, values)
        self._state = record(State)
        self._state["voltage"] = math.nan
        self._state["interval"] = _FIRST_INTERVAL
        self._state["temperature"] = ambient
        self._settings = record(Settings)
        self._settings["start_ns"] = start_ns
        self._settings["has_single"], self._settings["has_burst"] = has_single, has_burst
        self._law, self._model = law, unit
        self._settings["law"] = law_number(law)
        self._settings["gain"] = law_gains(law, known)
        stall_torque = known.torque_per_ampere * known.voltage_limit / known.resistance
        self._settings["braking"] = BRAKING_SHARE * stall_torque / known.inertia
        self._settings["ambient"] = ambient
        self._settings["heating"] = HEATING_K_PER_W
        self._settings["heating_time"] = HEATING_TIME_S
        self._sheet = data_sheet(unit.sensors, values.gear_ratio, angle, seed)
        self._sheet["track_2_offset"] = track_2_offset
        base = values.vector()
        change = unit.values_at(ambient + 1.0).vector() - base
        if unit.effects or unit.friction_model is not FrictionModel.LUGRE:
            whole = unit.vector()
            self._plant = new_sensed_state(angle, ambient, whole)
            behind = whole[len(base) :]
            base = np.concatenate([base, behind])
            change = np.concatenate([change, np.zeros(len(behind))])
        else:
            self._plant = new_state(angle)
        self._extended = self._plant if len(self._plant) > STATES else None
        self._laws = np.stack([base, change])
        self._unit = base.copy()
        self._nominal = known.vector()
        self._records_out = (
            record(Sample, _SLICE_TICKS + 1),
            record(Status, _SLICE_TICKS // STATUS_TICKS + 1),
            record(Switch, _SLICE_TICKS // CONTROL_TICKS + 1),
        )
        self._burst = np.zeros((3, BURST_SAMPLES))
        self._start_ns = start_ns
        self._tick: NDArray[np.int64] = self._state["tick"]  # a view
        self._law_failed: NDArray[np.int64] = self._state["law_failed"]  # likewise

    @property
    def tick(self) -> int:
        """The next tick of 50 us, counted from power-on."""
        return int(self._tick[0])

    @property
    def start_ns(self) -> int:
        """The instant of tick 0 on the bus's clock."""
        return self._start_ns

    @property
    def plate_angle(self) -> float:
        """The plate's true angle in rad, for tests and benchmarks."""
        return float(self._plant[THETA])

    @property
    def plant_state(self) -> Vector:
        """The plant's true state, for tests and benchmarks: a copy."""
        return self._plant.copy()

    @property
    def temperature(self) -> float:
        """The housing's temperature in degC."""
        return float(self._state["temperature"][0])

    @property
    def is_driving(self) -> bool:
        """Whether the bridge is on."""
        return bool(self._state["driving"][0])

    @property
    def mode(self) -> int:
        """The mode that the last command set."""
        return int(self._state["mode"][0])

    @property
    def measured_position(self) -> float:
        """The plate's angle in rad as encoder and tracks tell it."""
        return float(self._state["measured_position"][0])

    @property
    def measured_velocity(self) -> float:
        """The plate's velocity in rad/s as the encoder tells it."""
        return float(self._state["measured_velocity"][0])

    def reading(self, role: str) -> float:
        """Return what the controller's own sensors said last, in SI.

        KeyError for a role that it does not measure.
        """
        gear_ratio = float(self._nominal[GEAR_RATIO])
        return {
            "motor_current": float(self._state["current"][0]),
            "motor_angle": float(self._state["encoder"][0]) * gear_ratio,
            "throttle_angle": float(self._state["track"][0]),
            "throttle_angle_2": float(self._state["track_2"][0]),
            "temperature": self.temperature,
            "supply_voltage": float(self._unit[SUPPLY_VOLTAGE]),
        }[role]

    @property
    def codes(self) -> tuple[int, int, int]:
        """The trouble codes that fail now, that failed, and that were tested, as bits.

        The last two count since they were cleared.
        """
        return int(self._state["failing"][0]), int(self._state["failed"][0]), int(self._state["tested"][0])

    def judge_code(self, code: int, *, fails: bool) -> None:
        """Note what the test of a code says (a bit of `monitors`).

        No sensor sets such a code by itself.
        """
        monitors.judge(self._state[0], code, fails)

    def forget_codes(self, codes: int) -> None:
        """Clear trouble codes (bits): what still fails is set again by its next test."""
        for name in ("failing", "failed", "tested"):
            self._state[name] &= ~codes
        if codes & monitors.NO_RETURN:
            self._state["off_ms"] = 0

    def check(self) -> None:
        """Raise PartFault, once, where the law had no finite torque."""
        if self._law_failed[0]:
            self._law_failed[0] = 0
            raise failed_law(self._law, self._state["law_refused"][0])

    def run(
        self,
        until_ns: int,
        event_ns: NDArray[np.int64] = _NO_EVENTS_NS,
        event: NDArray[np.float64] = _NO_EVENTS,
    ) -> tuple[int, list[Output]]:
        """Run every tick before `until_ns`; return how many events acted, and output.

        The output is in order.

        `event_ns` int64 (n), `event` float64 (n, `EVENT_WIDTH`) are sorted by stamp; an event takes effect at the first
        control tick at or after its stamp. Each output is overwritten by the next, so a segment of more than a second
        comes as copies. PartFault where the law had no finite torque in an earlier call (the bridge is off since then),
        or where the unit's model has no finite state.
        """
        self.check()
        end = -((self._start_ns - until_ns) // TICK_NS)
        used = 0
        outputs: list[Output] = []
        samples, statuses, switches = self._records_out
        while (tick := self.tick) < end:
            angle = self._plant[THETA]
            slice_end = min(end, tick + _SLICE_TICKS)
            taken, sampled, stated, switched = run_ticks(
                slice_end, self._state, self._settings, self._sheet, self._plant, self._extended, self._laws,
                self._unit, self._nominal, event_ns[used:], event[used:], samples, statuses, switches, self._burst,
            )  # fmt: skip
            if not math.isfinite(self._plant[THETA] + self._plant[OMEGA] + self._plant[CURRENT]):
                raise failed_unit(self._model, angle)
            used += taken
            parts = samples[:sampled], statuses[:stated], switches[:switched]
            is_whole = slice_end == end and not outputs
            outputs.append(Output(*parts) if is_whole else Output(*(part.copy() for part in parts)))
        return used, outputs


def _inside_the_stops(angle: float, values: ThrottleParameters) -> float:
    low, high = values.stop_low - PRESS, values.stop_high + PRESS
    if not low <= angle <= high:
        allowed = f"{math.degrees(low):.1f} to {math.degrees(high):.1f} deg"
        raise InputError(
            Problem("no plate can stand at this angle", value=f"{math.degrees(angle):.3g} deg", allowed=allowed)
        )
    return angle


def resting_angle(values: ThrottleParameters, seed: int) -> float:
    """Return an angle in rad at which a released plate may have come to rest.

    The angle lies about limp-home.

    Break-away friction holds it wherever the springs pull less: inside the dead zone, or, in a unit whose plate does
    not come back by itself, as far off as the controller's own limp-home drive leaves it.
    """
    rng = generator(seed, 2)
    above = min(values.dead_zone * values.stiction / values.preload_open, ARRIVED)
    below = min(values.dead_zone * values.stiction / values.preload_close, ARRIVED)
    return float(values.limp_home + rng.uniform(-below, above))
