"""Where nothing is hidden, generator and package mean the same throttle."""

import numpy as np
import pytest
from generator import layout as at
from generator.bench import control_gains, simulate
from generator.rig import no_effects
from generator.unit import draw_unit, vector

from etb_hil.plant import integrator
from etb_hil.plant.values import ThrottleParameters


def _as_the_package_has_it(unit):
    gear = unit["gear_ratio"]
    per_ampere = unit["motor_constant"] * gear
    same = {name: unit[name] for name in unit if name in ThrottleParameters.__dataclass_fields__}
    return ThrottleParameters(
        **same,
        back_emf=per_ampere,
        torque_per_ampere=per_ampere,
        inertia=unit["motor_inertia"] * gear**2 + unit["plate_inertia"],
        supply_voltage=13.5,
        voltage_limit=12.0,
    )


@pytest.mark.parametrize("seed", range(4))
def test_both_plants_move_alike_under_one_voltage(seed):
    rng = np.random.default_rng(seed)
    unit = draw_unit(rng)
    volts = np.repeat(rng.uniform(-6.0, 12.0, 40), 50)
    inputs = np.zeros((volts.size, at.INPUTS))
    inputs[:, at.IN_VOLTAGE], inputs[:, at.IN_MODE] = volts, at.OPEN_LOOP
    ours = simulate(inputs, vector(unit), no_effects(), control_gains(unit, 120.0), 1000)
    state = integrator.new_state(unit["limp_home"])
    parameters = _as_the_package_has_it(unit).vector()
    theirs = np.empty((volts.size, 4))
    for tick, volt in enumerate(volts):
        theirs[tick] = state[:4]
        integrator.advance(state, parameters, volt, 20)
    apart = theirs[:, integrator.THETA] - ours[:, at.LOG_ANGLE]
    # Two methods at their own steps, stops hit at speed: a tenth of the plate sensor's step.
    assert np.sqrt(np.mean(apart**2)) < 4e-5
    assert np.ptp(ours[:, at.LOG_ANGLE]) > 1.0
