"""An extended model is taken as it is: what its effects do is no friction, and no contradiction."""

from dataclasses import replace

import numpy as np
import pytest
from throttle_as_model import phase_of

from etb_hil.base.stock import find
from etb_hil.bench.simulation import Simulation
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limits_file import load_limits
from etb_hil.observer.compensation import Compensation
from etb_hil.plant.effects import ports, readings
from etb_hil.plant.model_file import EffectEntry
from etb_hil.plant.parameters import load_model
from etb_hil.plant.physics import GEAR_RATIO
from etb_hil.recording.samples import SampleBlock
from etb_hil.scenario.scenario_file import load_scenario

MODEL = load_model(find("model", "default"))
LIMITS = load_limits(find("limits", "default"))
EFFECTS = (
    EffectEntry(id="current_sensor_gain", strengths={"gain_error": 0.12}),
    EffectEntry(id="cogging_torque", strengths={"sine": "0.02 N·m", "order": "5 1/turn"}),
    EffectEntry(id="spring_nonlinear", strengths={"quadratic": "0.04 N·m"}),
    EffectEntry(id="angle_sensor_eccentricity", strengths={"sine": "0.03 rad"}),
)
EXTENDED = replace(MODEL, effects=EFFECTS)


def test_readings_become_those_of_the_base_models_unit():
    p = EXTENDED.vector()
    angle = np.linspace(0.1, 1.4, 400)
    current = np.sin(7.0 * angle)
    read = readings.measured_angle(angle * p[GEAR_RATIO], p) / p[GEAR_RATIO]
    springs, plain = (np.array([ports.elastic_torque(a, 0.0, q) for a in angle]) for q in (p, MODEL.vector()))
    extra = np.array([ports.motor_torque(a, p) for a in angle]) + springs - plain
    true = current + extra / MODEL.values.torque_per_ampere
    shown = readings.measured_current(true, np.full(400, 25.0), p)
    time_ns = np.arange(400) * 1_000_000
    missing = np.full(400, np.nan)
    found, where, voltage = Compensation(EXTENDED).push(time_ns, shown, read, 1.5 * true, missing)
    np.testing.assert_allclose(found, current, atol=1e-9)
    np.testing.assert_allclose(where, angle, atol=1e-9)
    np.testing.assert_allclose(voltage, 1.5 * true + MODEL.values.resistance * (current - true), atol=1e-9)


def test_the_stream_may_be_cut_anywhere():
    rng = np.random.default_rng(3)
    columns = [np.cumsum(rng.normal(size=300)) * 0.01 + 0.7 for _ in range(3)]
    time_ns, warm = np.arange(300) * 500_000, np.linspace(20.0, 60.0, 300)
    loose = replace(EXTENDED, effects=(*EFFECTS, EffectEntry(id="gear_backlash", strengths={"play": "0.01 rad"})))
    whole = Compensation(loose).push(time_ns, *columns, warm)
    cut = Compensation(loose)
    parts = [cut.push(time_ns[a:b], *(c[a:b] for c in columns), warm[a:b]) for a, b in ((0, 1), (1, 120), (120, 300))]
    for k in range(3):
        np.testing.assert_array_equal(np.concatenate([part[k] for part in parts]), whole[k])


@pytest.fixture(scope="module")
def checked():
    """A friction check of the extended unit: rows by phase."""
    steps = load_scenario(find("scenario", "friction_check")).content.steps
    simulation = Simulation(EXTENDED, MODEL, law="pd", seed=1, rate=1000.0)
    found, done = [], 0
    for step in steps:
        time_ns, columns = simulation.run([step])
        part = slice(done, len(time_ns))
        rows = {role: values[part] for role, values in columns.items()}
        block = SampleBlock("samples", time_ns[part], time_ns[part], rows, np.zeros(len(time_ns) - done, np.int64))
        found.append((block, step.phase.kind))
        done = len(time_ns)
    return found


def _judged(rows, model):
    diagnosis = Diagnosis(model, LIMITS)
    for block, kind in rows:
        diagnosis.push(block, phase_of(kind))
    return diagnosis.finish()


def test_friction_is_found_beside_the_effects(checked):
    with_it, without = _judged(checked, EXTENDED), _judged(checked, MODEL)
    assert [reason.id for reason in with_it.reasons] == ["within_limits"]
    assert with_it.measurements.get("T_st").value == pytest.approx(MODEL.values.stiction, rel=0.03)
    assert with_it.measurements.get("T_c").value == pytest.approx(MODEL.values.coulomb, rel=0.06)
    assert {reason.id for reason in without.reasons} & {"model_contradicted", "current_scale"}
