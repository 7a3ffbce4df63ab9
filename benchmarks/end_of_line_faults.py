"""Twenty kinds of faulty unit, each with the measurement that has to fail."""

from __future__ import annotations

from dataclasses import dataclass, replace

from etb_hil.plant.model_file import EffectEntry


@dataclass(frozen=True)
class Fault:
    """A fault: factors of parameters, amounts added in SI, effects; and the measurement that shows it."""

    name: str
    measurement: str
    factors: dict
    added: dict
    effects: dict

    def unit(self, model):
        """Return the model with the fault."""
        parameters = dict(model.parameters)
        for name, factor in self.factors.items():
            parameters[name] = replace(parameters[name], value=parameters[name].value * factor)
        for name, amount in self.added.items():
            parameters[name] = replace(parameters[name], value=parameters[name].value + amount)
        effects = tuple(EffectEntry(id=name, strengths=strengths) for name, strengths in self.effects.items())
        return replace(model, name=self.name, parameters=parameters, effects=effects)


def _fault(name, measurement, *, effects=None, added=None, **factors):
    return Fault(name, measurement, factors, added or {}, effects or {})


DEGREE = 0.017453292519943295
FAULTS = (
    _fault("plate sticks (break-away x 3.3)", "T_st", stiction=3.3),
    _fault("sliding friction x 1.7", "T_c", coulomb=1.7, stiction=1.7),
    _fault("plate sensor that lags by 0.6 deg", "plate_sensor_hysteresis",
           effects={"sensor_hysteresis": {"half_width": "0.005 rad"}}),
    _fault("spring above limp-home weak by 40 %", "return_margin", preload_open=0.6),
    _fault("stiff grease (viscosity x 6)", "viscous", viscous=6.0),
    _fault("spring above limp-home weak by 20 %", "spring_torque_open", preload_open=0.8),
    _fault("spring below limp-home weak by 20 %", "spring_torque_close", preload_close=0.8),
    _fault("spring above limp-home too stiff (x 2)", "spring_slope_open", slope_open=2.0),
    _fault("spring below limp-home too stiff (x 12)", "spring_slope_close", slope_close=12.0),
    _fault("default position 2 deg too far open", "default_position", added={"limp_home": 2.0 * DEGREE}),
    _fault("default position 2 deg too far closed", "default_position", added={"limp_home": -2.0 * DEGREE}),
    _fault("default position found loosely", "default_position_spread", dead_zone=30.0),
    _fault("spring above limp-home broken", "return_time_open", preload_open=0.3, slope_open=0.05),
    _fault("spring below limp-home broken", "return_time_closed", preload_close=0.3, slope_close=0.05),
    _fault("connector with 0.4 ohm", "winding_resistance", resistance=1.27),
    _fault("shorted turns", "winding_resistance", resistance=0.75),
    _fault("magnets weak by 35 %", "holding_current", torque_constant=0.65, back_emf_constant=0.65),
    _fault("heavy plate (inertia x 3)", "return_time_open", motor_inertia=3.0),
    _fault("encoder disc off centre", "plate_sensor_deviation",
           effects={"angle_sensor_eccentricity": {"sine": "0.15 rad"}}),
    _fault("play in the gear of 1 deg", "plate_sensor_deviation",
           effects={"gear_backlash": {"play": f"{DEGREE} rad"}}),
)  # fmt: skip
