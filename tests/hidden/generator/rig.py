"""One unit on one rig: simulate, measure and weigh the residual for any set of effects."""

from dataclasses import dataclass, field

import numpy as np

from generator import layout as at
from generator.balances import balances, root_mean_square
from generator.bench import control_gains, simulate
from generator.excitation import EXCITATIONS
from generator.recipes import RECIPES
from generator.sensors import Sensors, measure
from generator.surroundings import surround
from generator.unit import draw_nominal, draw_unit, vector

_LATE = [at.DELAY, at.ANGLE_DELAY, at.MOTOR_DELAY, at.PLATE_DELAY]
_READS_ONLY = [at.ROW[name] for name, recipe in RECIPES.items() if recipe.reads_only]


def no_effects():
    """An effects' table with nothing in it; shape parameters are 1 so that none divides by zero."""
    table = np.zeros((len(at.EFFECTS), at.ROW_WIDTH))
    table[:, at.A :] = 1.0
    return table


@dataclass
class Rig:
    """A drawn unit, what the bench believes of it, its programme and its sensors."""

    seed: int
    unit: dict
    nominal: dict
    excitation: str
    rate: int
    inputs: np.ndarray
    gains: np.ndarray
    sensors: Sensors = field(default_factory=Sensors)
    _motion: tuple | None = None

    @property
    def parameters(self):
        return vector(self.unit)

    def motion(self, effects):
        """True record; kept while only sensor effects change."""
        moving = effects.copy()
        moving[_READS_ONLY] = 0.0
        # What is late is read between the rows.
        finer = 4 if effects[_LATE, at.STRENGTH].any() and self.rate <= 2000 else 1
        if self._motion and self._motion[0] == finer and np.array_equal(self._motion[1], moving):
            return self._motion[2]
        rows = simulate(self.inputs, self.parameters, effects, self.gains, self.rate * finer)
        self._motion = (finer, moving, rows)
        return rows

    def record(self, effects, sensors=None):
        """Measured table; the noise is the same whatever is hidden."""
        noise = np.random.default_rng([self.seed, 1])
        rows = self.motion(effects)
        return measure(rows, self.rate, self.inputs, self.parameters, effects, sensors or self.sensors, noise)

    def residuals(self, effects):
        """Residual of each balance with the true base parameters."""
        return balances(self.record(effects), self.parameters, self.rate)

    def floors(self):
        """Noise-only rms of each balance."""
        return {channel: root_mean_square(values) for channel, values in self.residuals(no_effects()).items()}


def set_up(seed, excitation, seconds, rate, adapt=None):
    """Draw a rig; `adapt` may change the unit where an effect needs it."""
    rng = np.random.default_rng([seed, 0])
    unit = draw_unit(rng)
    unit = adapt(unit, rng) if adapt else unit
    nominal = draw_nominal(rng, unit)
    inputs = surround(EXCITATIONS[excitation](rng, unit, nominal, seconds), rng)
    gains = control_gains(nominal, rng.uniform(100.0, 150.0))
    return Rig(seed, unit, nominal, excitation, rate, inputs, gains)
