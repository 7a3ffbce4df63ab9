"""What a model file states of heat is no cause: neither in data that warm up nor in data from a warm room."""

from dataclasses import replace

import numpy as np
import pytest
from answers import plain
from synthetic import MODEL, measurement

from etb_hil.base.errors import InputError
from etb_hil.discrepancy.answer.quality import data_quality
from etb_hil.discrepancy.explain import explain
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.search.extended_model import extended_model
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.effects.layout import row
from etb_hil.plant.model_file import EffectEntry
from etb_hil.plant.parameter import TemperatureLaw
from etb_hil.plant.parameters import Model
from etb_hil.plant.voltage_run import run_voltage
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import SampleBlock

OBEYING = MODEL.with_laws_as_terms(25.0)
TIME_NS = np.arange(0, 3_000_000_000, 500_000)
VOLTAGE = np.round(6.0 * np.sin(2.0 * np.pi * 0.7 * TIME_NS * 1e-9) ** 3, 2)
GREASE = TemperatureLaw(-0.004, 20.0)


def _with(laws):
    """The model with laws of other parameters, too."""
    parameters = {name: replace(p, temperature=laws.get(name, p.temperature)) for name, p in MODEL.parameters.items()}
    return replace(MODEL, parameters=parameters)


def _explained(truth: Model):
    """The findings of a record, 20 to 70 degC, of a unit that obeys its laws."""
    return search(OBEYING, [Balances(measurement(truth.vector(), 5), OBEYING)])


@pytest.mark.parametrize("temperature", [-20.0, 20.0, 70.0])
def test_the_terms_are_what_the_file_states_at_every_temperature(temperature):
    # As terms of the vector, and in the numbers themselves: two ways to the same motion.
    stated = _with({"coulomb": GREASE, "stiction": GREASE})
    obeying = stated.with_laws_as_terms(25.0)
    vector = obeying.vector()
    strengths = {
        "resistance_temperature": ("housing_share", {"time_constant": "0.001 s"}),
        "magnet_temperature": ("coefficient", {"time_constant": "0.001 s"}),
        "friction_temperature": ("friction_per_30_kelvin", {}),
    }
    terms = tuple(
        EffectEntry(id=id_, strengths={name: float(vector[row(id_)]), **more})
        for id_, (name, more) in strengths.items()
    )
    without = {name: replace(p, temperature=None) for name, p in obeying.parameters.items()}
    by_terms = run_voltage(Model("terms", without, MODEL.sensors, terms), TIME_NS, VOLTAGE, 0.3, temperature)
    by_numbers = run_voltage(stated, TIME_NS, VOLTAGE, 0.3, temperature)
    assert np.ptp(by_numbers.angle) > 0.5
    np.testing.assert_allclose(by_terms.angle, by_numbers.angle, atol=1e-6)
    np.testing.assert_allclose(by_terms.current, by_numbers.current, atol=1e-5)
    if temperature != 20.0:
        cold = run_voltage(stated, TIME_NS, VOLTAGE, 0.3, 20.0)
        assert np.abs(cold.current - by_numbers.current).max() > 0.1


def test_a_healthy_unit_that_warms_is_adequate_and_its_file_keeps_its_laws():
    findings = _explained(OBEYING)
    assert findings.verdict == "adequate"
    written = extended_model(findings)
    assert not written.effects
    for name in ("resistance", "torque_constant", "back_emf_constant"):
        assert written.parameters[name].temperature == OBEYING.parameters[name].temperature
    assert written.values_at(20.0).resistance == pytest.approx(MODEL.values.resistance, rel=1e-3)
    np.testing.assert_array_equal(written.vector()[row("resistance_temperature") :][:3], 0.0)


@pytest.mark.study
def test_magnets_that_weaken_by_more_are_named_by_all_that_they_weaken_and_no_law_says_it_again():
    weak = OBEYING.vector()
    stated = float(weak[row("magnet_temperature")])
    weak[row("magnet_temperature")] = 4.0
    findings = search(OBEYING, [Balances(measurement(weak, 6), OBEYING)])
    (found,) = findings.accepted
    assert found.winner.id == "magnet_temperature"
    written = extended_model(findings)
    (entry,) = written.effects
    assert stated == pytest.approx(1.01, abs=0.01)
    assert float(entry.strengths["coefficient"]) == pytest.approx(4.0, rel=0.1)
    assert written.parameters["torque_constant"].temperature is None
    assert written.parameters["resistance"].temperature is not None


def test_what_became_of_the_laws_is_said():
    record = measurement(MODEL.vector(), 7)
    for model, says in ((OBEYING, "are given at 25 degC"), (MODEL, "10 K above")):
        (quality,) = [one for one in plain(data_quality([Balances(record, model)], model)) if not isinstance(one, str)]
        assert [flag for flag in quality["flags"] if says in flag]


def test_a_healthy_unit_whose_friction_falls_as_stated_is_adequate():
    obeying = _with({"coulomb": GREASE, "stiction": GREASE}).with_laws_as_terms(45.0)
    findings = search(obeying, [Balances(measurement(obeying.vector(), 8), obeying)])
    assert findings.verdict == "adequate"
    written = extended_model(findings)
    assert not written.effects
    assert written.parameters["coulomb"].temperature == obeying.parameters["coulomb"].temperature


def test_a_law_that_no_term_obeys_is_obeyed_at_one_temperature_and_said():
    stated = _with({"viscous": TemperatureLaw(-0.01, 20.0), "coulomb": GREASE})
    obeying = stated.with_laws_as_terms(45.0)
    for name, law in (("viscous", TemperatureLaw(-0.01, 20.0)), ("coulomb", GREASE)):
        assert obeying.parameters[name].value == pytest.approx(stated.parameters[name].value * law.factor(45.0))
        assert obeying.parameters[name].temperature.factor(20.0) == pytest.approx(1.0 / law.factor(45.0))
    assert obeying.vector()[row("friction_temperature")] == 0.0
    record = measurement(MODEL.vector(), 7)
    says = " ".join(flag for one in plain(data_quality([Balances(record, obeying)], obeying)) for flag in one["flags"])
    assert "resistance, back_emf_constant, torque_constant follow the model file's temperature coefficients" in says
    assert "coulomb, viscous are constant at the model file's values for 45 degC" in says


def test_a_recorded_temperature_at_which_the_laws_state_no_throttle_is_refused():
    record = Recording("hot", ClockGrade.TABLE)
    time_ns = np.arange(3, dtype=np.int64) * 1_000_000
    columns = {"motor_voltage": np.zeros(3), "motor_angle": np.zeros(3), "temperature": np.full(3, 70.0)}
    record.append([SampleBlock("table", time_ns, time_ns, columns, np.zeros(3, np.int64))])
    with pytest.raises(InputError, match=r"at 70 degC the model file states no throttle: T_st is below T_c"):
        explain([record], _with({"stiction": TemperatureLaw(-0.015, 20.0)}))
