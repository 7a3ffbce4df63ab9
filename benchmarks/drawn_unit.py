"""Units drawn at random for studies, from a box that production throttles lie in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from etb_hil.base.stock import stock_file
from etb_hil.plant.model_check import impossible
from etb_hil.plant.parameter import Parameter
from etb_hil.plant.parameters import Model, load_model
from etb_hil.plant.reach import peak_velocities
from etb_hil.plant.values import FAR_ABOVE

if TYPE_CHECKING:
    from numpy.random import Generator

# In SI, at the shafts of the default model; table I leaves some of its ranges open.
BOX = {
    "resistance": (1.0, 3.0),
    "inductance": (0.5e-3, 3e-3),
    "torque_constant": (0.012, 0.03),
    "gear_ratio": (15.0, 22.0),
    "motor_inertia": (2e-6, 8e-6),
    "throttle_inertia": (20e-6, 50e-6),
    "preload_open": (0.25, 0.45),
    "preload_close": (0.3, 0.4),
    "coulomb": (0.005, 0.009),
    "viscous": (0.001, 0.005),
    "stribeck_velocity": (100.0, 180.0),
}
HEALTHY_RATIO = (1.05, 1.4)  # T_st / T_c
FAULTY_RATIO = (2.5, 4.0)


@dataclass(frozen=True, slots=True)
class RandomUnit:
    """A unit with the velocities in rad/s of its quickest dash each way.

    From them it still stops.
    """

    model: Model
    peak_opening: float
    peak_closing: float

    @property
    def reaches_coulomb(self) -> bool:
        """Whether dashes both ways pass 2.15 omega_s, so that T_c can be read."""
        return min(self.peak_opening, self.peak_closing) > FAR_ABOVE * self.model.values.stribeck_velocity


def random_unit(rng: Generator, *, healthy: bool) -> RandomUnit:
    """Return a unit from the box whose springs bring the plate back.

    They do with healthy friction.
    """
    base = load_model(stock_file("model", "default"))
    while True:
        drawn = _draw(rng, base.parameters, HEALTHY_RATIO)
        model = replace(base, name="random healthy unit", parameters=drawn)
        if impossible(drawn) or model.values.return_margin <= 0.0:
            continue
        if not healthy:
            stiction = drawn["coulomb"].value * rng.uniform(*FAULTY_RATIO)
            drawn = drawn | {"stiction": replace(drawn["stiction"], value=stiction)}
            model = replace(base, name="random faulty unit", parameters=drawn)
        return RandomUnit(model, *peak_velocities(model.values))


def _draw(rng: Generator, base: Mapping[str, Parameter], ratio: tuple[float, float]) -> dict[str, Parameter]:
    values = {name: rng.uniform(low, high) for name, (low, high) in BOX.items()}
    values["back_emf_constant"] = values["torque_constant"]
    values["stiction"] = values["coulomb"] * rng.uniform(*ratio)
    return {name: replace(p, value=values[name]) if name in values else p for name, p in base.items()}
