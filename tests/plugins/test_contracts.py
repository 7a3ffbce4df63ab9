"""The contract tests of `etb_hil.testing`: the project's own parts keep them, and parts that do not are seen."""

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

from etb_hil import plugins, testing
from etb_hil.controller.laws.registry import LAWS
from etb_hil.diagnosis.measurement_registry import measurement_kinds
from etb_hil.observer.registry import OBSERVERS, observer_kind
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plugins.keys import SecurityKey
from etb_hil.plugins.laws import ControlLaw
from etb_hil.plugins.measurements import Estimate
from etb_hil.plugins.observers import FrictionEstimate, ObserverKind
from etb_hil.plugins.phases import Held
from etb_hil.plugins.readers import Reader
from etb_hil.scenario.phases import phase_kinds

SETTINGS = {
    "off": {"duration": "0.2 s"},
    "hold": {"position": "30 deg", "duration": "0.2 s"},
    "ramp": {"between": ["10 deg", "30 deg"], "speed": "1 rad/s"},
    "step": {"positions": ["20 deg", "25 deg"], "hold": "0.2 s"},
}


@pytest.mark.parametrize("effect", CATALOGUE.values(), ids=CATALOGUE)
def test_own_effects(effect):
    testing.check_effect(effect)


def test_own_key_function():
    testing.check_key(SecurityKey(lambda seed, level: bytes(byte ^ level for byte in seed)))


@pytest.mark.parametrize(
    ("key", "told"),
    [
        (lambda _seed, _level: "text", "must be bytes"),
        (lambda _seed, _level: b"", "is empty"),
        (lambda seed, _level, count=[0]: count.append(0) or seed + bytes([len(count)]), "differ"),
    ],
)
def test_key_functions_that_break_the_contract(key, told):
    with pytest.raises(AssertionError, match=told):
        testing.check_key(SecurityKey(key))


@pytest.mark.parametrize("law", LAWS.all_own().values(), ids=LAWS.all_own())
def test_own_laws(law):
    testing.check_law(law)


@pytest.mark.parametrize("name", ["T_c", "T_st", "resistance", "fastest", "return_margin"])
def test_own_measurements(name):
    testing.check_measurement(measurement_kinds()[name])


@pytest.mark.parametrize("name", OBSERVERS.names())
def test_own_observers(name):
    testing.check_observer(observer_kind(name))


@pytest.mark.parametrize("name", SETTINGS)
def test_own_phases(name):
    testing.check_phase(phase_kinds()[name], SETTINGS[name])


@pytest.fixture
def sound(part, monkeypatch):
    """Return what imports a module of the example package."""
    monkeypatch.syspath_prepend(str(part("nudges").parents[0]))
    return lambda name: import_module(part(name).stem)


def _fails(check, *arguments, says):
    with pytest.raises(AssertionError, match=says):
        check(*arguments)
    assert plugins.loaded() == ()


def test_an_effect_that_is_there_at_zero_strength_is_seen(sound):
    effect = sound("gravity_torque").EFFECT
    testing.check_effect(effect)
    assert effect.id not in CATALOGUE
    (port,) = effect.terms
    _fails(
        testing.check_effect,
        replace(effect, terms={port: lambda theta, moment, phase: 0.1 + moment * theta + phase}),
        says="not zero where its strengths are zero",
    )


def test_a_law_that_drives_into_a_fault_is_seen(sound):
    sound_law = sound("soft_pd").LAW
    testing.check_law(sound_law)
    away = ControlLaw("away from the set-point", lambda _nominal: np.array([5.0]), lambda g, _m, e, _r: -g[0] * e)
    _fails(testing.check_law, away, says="a dry run on the bench's model stops")


def test_a_measurement_whose_value_lies_outside_its_interval_is_seen(sound):
    without_its_phase = sound("nudge_current").MEASUREMENT
    _fails(testing.check_measurement, without_its_phase, says=r"names no kind of phase \(it is 'nudges'\); correct it")
    absent = replace(without_its_phase, phases=frozenset({"step"}))
    _fails(testing.check_measurement, absent, says="friction_check did not give nudge_current")
    kind = replace(without_its_phase, phases=frozenset())
    wrong = replace(kind, compute=lambda _run: Estimate(1.0, 2.0, 3.0))
    _fails(testing.check_measurement, wrong, says=r"nudge_current = 1\.0 lies outside its interval, 2\.0 to 3\.0")
    failing = replace(kind, compute=lambda _run: 1 / 0)
    _fails(testing.check_measurement, failing, says="ZeroDivisionError")
    calls = iter(range(100))
    moody = replace(kind, compute=lambda _run: Estimate(float(next(calls))))
    _fails(testing.check_measurement, moody, says="a replay gives another nudge_current")


class Mean:
    def push(self, time_ns, current, _angle):
        mean = np.full(len(time_ns), np.mean(current) if len(current) else 0.0)
        return FrictionEstimate(time_ns, mean, mean, np.zeros(len(time_ns), np.int64))


def test_an_observer_that_depends_on_how_its_stream_is_cut_is_seen():
    kind = ObserverKind("mean", lambda _model, _throttle, _noise: Mean())
    _fails(testing.check_observer, kind, says="depends on how the stream is cut")


def test_a_phase_whose_set_points_differ_from_call_to_call_is_seen(sound):
    phase = sound("nudges").PHASE
    settings = {"between": ["20 deg", "40 deg"], "size": "5 deg", "hold": "0.2 s"}
    testing.check_phase(phase, settings)
    _fails(testing.check_phase, phase, {**settings, "size": "-1 deg"}, says="at least 0.001 rad")
    places = iter(np.linspace(0.2, 1.0, 100))

    class Moody(phase):
        def trajectory(self, _start, _throttle):
            return Held(float(next(places)), 0.5)

    _fails(testing.check_phase, Moody, settings, says="its set-points differ from call to call")


def test_a_reader_that_loses_frames_is_seen(sound, tmp_path):
    module, path = sound("frame_lines"), tmp_path / "a.frames"
    path.write_text("".join(f'{{"t": {k}e-3, "id": {k}, "data": "00"}}\n' for k in range(50)), "utf-8")
    testing.check_reader(module.READER, path)
    turns = iter(range(100))

    def moody(path):
        class Moody(module.FrameLines):
            def __iter__(self):
                return (block.select(slice(next(turns), None)) for block in super().__iter__())

        return Moody(path)

    _fails(testing.check_reader, Reader("moody", (".frames",), moody), path, says="reading it again gives other frames")
