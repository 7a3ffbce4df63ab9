"""What an effect does to the balances along one and the same motion: columns for the separability of effects.

Seen through the sensors that a tool gets: without a current, torque and voltage are one balance; with the plate's
sensor alone, or beside an encoder that is coarser, its angle stands for the motor's; without it the motor's for its.
"""

from dataclasses import replace

import numpy as np

from generator import layout as at
from generator.balances import BREAKING_AWAY, CHANNELS, balances, low_passed, root_mean_square, split_at_stops
from generator.following import follow
from generator.recipes import RECIPES
from generator.replay import shortfall
from generator.rig import no_effects
from generator.sensors import Sensors, measure
from generator.unit import vector

QUIET = Sensors(1 << 28, 1e-9, 0.0, 1e-9, 0.0, 1e-9, 0.0, 1e-3, 0.0)
_IN_TABLE = {
    "gear_backlash",
    "shaft_compliance",
    "angle_sensor_eccentricity",
    *(name for name, recipe in RECIPES.items() if recipe.reads_only),
}

_BY_THE_PLATE = ("plate_only", "coarse_encoder")


class Sensitivities:
    """Residual of the balances per effect and per base parameter, noise-free, over the noise of each balance."""

    def __init__(self, rig, view="full", sensors=None):
        rate = min(rig.rate, 2000)  # more rows would show noise
        rig = replace(rig, rate=rate, sensors=sensors or rig.sensors, _motion=None)
        self._view = view
        self._rig = replace(rig, sensors=QUIET)
        noisy = self._balances(rig.record(no_effects()), rig.parameters)
        self._floors = {channel: root_mean_square(values) for channel, values in noisy.items()}
        self._rows = rig.motion(no_effects())
        self._table = self._measured(no_effects())
        self._plain = self._balances(self._table, rig.parameters)
        self._unchanged = shortfall(self._rows, rig.inputs, rig.parameters, no_effects(), rig.rate)

    def of_effect(self, name, row):
        """Whitened residual that an effect with this row leaves."""
        effects = no_effects()
        effects[at.ROW[name]] = row
        if name in _IN_TABLE:
            table = self._loose(row, name) if name in ("gear_backlash", "shaft_compliance") else self._measured(effects)
            return self._whitened(_difference(self._balances(table, self._rig.parameters), self._plain))
        with_it = shortfall(self._rows, self._rig.inputs, self._rig.parameters, effects, self._rig.rate)
        torque, voltage = low_passed(self._unchanged - with_it, self._rig.rate)
        off, stops = split_at_stops(torque, self._rows[:, at.LOG_ANGLE], self._rig.parameters, self._rig.rate)
        found = {"torque": off, "torque_at_stops": stops, "voltage": voltage, "angle": np.zeros_like(off)}
        return self._whitened(self._as_seen(found, stops != 0.0))

    def visible(self, rest):
        """Residual over noise of what is left of a column, in the balance or the break-aways that show it most."""
        channels = rest.reshape(len(CHANNELS), -1)
        rows = [np.count_nonzero(channel) or 1 for channel in channels]
        squares = [channel @ channel / count for channel, count in zip(channels, rows, strict=True)]
        breaking = self._plain[BREAKING_AWAY] != 0.0
        if breaking.any() and self._floors[BREAKING_AWAY] > 0.0:  # a noisy angle may tell of no rest at all
            scale = self._floors["torque"] / self._floors[BREAKING_AWAY]
            squares.append(np.mean((channels[0][breaking] * scale) ** 2))
        return float(np.sqrt(1.0 + max(squares)))

    def of_parameters(self):
        """Whitened residual per relative change (per rad for the stops) of each base parameter that the motion shows.

        The plate's inertia adds to the motor's: one of the two stands for both.
        """
        columns = {}
        for name, value in self._rig.unit.items():
            if name in ("gear_ratio", "plate_inertia"):
                continue
            step = 1e-3 if name in ("stop_low", "stop_high") else 0.01 * value
            moved = self._balances(self._table, vector({**self._rig.unit, name: value + step}))
            scale = step if name in ("stop_low", "stop_high") else 0.01
            column = self._whitened(_difference(moved, self._plain)) / scale
            if np.linalg.norm(column) > 1e-9:
                columns[name] = column
        return columns

    def _balances(self, table, p):
        if self._view == "encoder_only":
            table = {**table, "throttle_angle": table["motor_angle"] / p[at.N]}
        plates = {**table, "motor_angle": table["throttle_angle"] * p[at.N]}
        found = balances(plates if self._view in _BY_THE_PLATE else table, p, self._rig.rate)
        if self._view == "coarse_encoder":
            found["angle"] = balances(table, p, self._rig.rate)["angle"]  # the encoder's steps are its noise
        return self._as_seen(found, found["torque_at_stops"] != 0.0)

    def _as_seen(self, found, at_stops):
        if self._view != "no_current":
            return found
        # The current that the torque balance asks for, put into the voltage balance: its noise cancels.
        p = self._rig.parameters
        volts = p[at.R] / (p[at.K] * p[at.N])
        whole = volts * (found["torque"] + found["torque_at_stops"]) + found["voltage"]
        seen = {"torque": np.where(at_stops, 0.0, whole), "torque_at_stops": np.where(at_stops, whole, 0.0)}
        if BREAKING_AWAY in found:
            seen[BREAKING_AWAY] = np.where(found[BREAKING_AWAY] != 0.0, whole, 0.0)
        return {**found, **seen, "voltage": np.zeros_like(whole)}

    def _measured(self, effects):
        rig = self._rig
        return measure(self._rows, rig.rate, rig.inputs, rig.parameters, effects, QUIET, np.random.default_rng(0))

    def _loose(self, row, name):
        """Table of the same motor motion, the plate behind it by play or twist, under the current that this takes."""
        rig, p, table = self._rig, self._rig.parameters, self._table
        effects = no_effects()
        effects[at.ROW[name]] = row
        lag, unloaded = follow(self._rows, rig.inputs, p, effects, rig.rate)
        swing = p[at.J_PLATE] * np.gradient(np.gradient(lag)) * rig.rate**2
        less = (unloaded + swing) / (p[at.K] * p[at.N])  # A
        volts = p[at.R] * less + p[at.L] * np.gradient(less) * rig.rate
        return {
            **table,
            "throttle_angle": table["throttle_angle"] - lag,
            "motor_current": table["motor_current"] - less,
            "motor_voltage": table["motor_voltage"] - 0.5 * (volts + np.append(volts[1:], volts[-1])),
        }

    def _whitened(self, residuals):
        return np.concatenate([residuals[channel] / (self._floors[channel] or np.inf) for channel in CHANNELS])


def _difference(first, second):
    return {channel: first[channel] - second[channel] for channel in CHANNELS}
