"""The how-to of an own effect, followed word for word: from a file outside to the effect named in hidden data."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic import MODEL, measurement

from etb_hil import plugins
from etb_hil.base.errors import InputError
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.search.extended_model import extended_model
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.effects import ports
from etb_hil.plant.effects.catalogue import CATALOGUE, register, unregister
from etb_hil.plant.effects.effect import Balance, Effect, Parity, State, strength
from etb_hil.plant.effects.port import Port
from etb_hil.plant.model_file import EffectEntry
from etb_hil.plant.table_one import KINDS
from etb_hil.plant.voltage_run import run_voltage

PAGE = Path(__file__).resolve().parents[2] / "docs" / "howto" / "own_effect.md"
SHOWN = dict(re.findall(r"```\{code-block\} \w+\n:caption: (\S+)\n\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL))
TIME_NS = np.arange(2000) * 500_000
VOLTAGE = 6.0 * np.sin(9e-9 * TIME_NS)


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "gravity_torque.py"
    path.write_text(SHOWN["gravity_torque.py"], "utf-8")
    return path


@pytest.fixture
def gravity(file):
    yield plugins.load(file)
    plugins.unload(file)


def _unit(moment=0.08, phase=0.3):
    entry = EffectEntry(id="gravity_torque", strengths={"moment": f"{moment} N·m", "phase": f"{phase} rad"})
    return replace(MODEL, effects=(entry,))


def _run(model):
    return run_voltage(model, TIME_NS, VOLTAGE, 0.4, 25.0)


OTHERS = {"spring_nonlinear", "cogging_torque"}  # torques over the plate's and the motor's angle


@pytest.mark.usefixtures("gravity")
@pytest.mark.parametrize(
    "all_others", [False, pytest.param(True, marks=pytest.mark.study)], ids=["beside two others", "beside all others"]
)
def test_the_how_to_from_the_file_to_its_name_in_hidden_data(all_others):
    left_out = {*CATALOGUE, *(f"parameter:{name}" for name in KINDS)} - OTHERS - {"gravity_torque"}
    without = () if all_others else sorted(left_out)
    findings = search(MODEL, [Balances(measurement(_unit().vector(), seed=3), MODEL)], without)
    (cause,) = findings.accepted
    assert cause.winner.id == "gravity_torque"
    extended = extended_model(findings)
    (entry,) = extended.effects
    assert float(str(entry.strengths["moment"]).split()[0]) == pytest.approx(0.08, rel=0.1)
    assert float(str(entry.strengths["phase"]).split()[0]) == pytest.approx(0.3, abs=0.05)


@pytest.mark.study
@pytest.mark.usefixtures("file")
def test_the_script_of_the_how_to_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("effects.yaml").write_text(SHOWN["effects.yaml"], "utf-8")
    try:
        exec(compile(SHOWN["hide_and_find.py"], "hide_and_find.py", "exec"), {})  # noqa: S102 (our own page)
    finally:
        plugins.unload("gravity_torque.py")
    assert "gravity_torque" in capsys.readouterr().out.splitlines()[-1]


def test_the_plant_feels_it_and_feels_it_no_more_without_it(file):
    plain = _run(MODEL)
    plugins.load(file)
    with_it, at_zero = _run(_unit()), _run(_unit(moment=0.0))
    plugins.unload(file)
    assert np.abs(with_it.angle - plain.angle).max() > 0.01
    np.testing.assert_allclose(at_zero.angle, plain.angle, atol=1e-6)
    np.testing.assert_array_equal(_run(MODEL).angle, plain.angle)
    assert "gravity_torque" not in CATALOGUE


@pytest.mark.usefixtures("gravity")
def test_its_torque_is_the_one_that_its_equation_says():
    p, plain = _unit().vector(), MODEL.vector()
    for theta in (0.2, 0.7, 1.3):
        more = ports.elastic_torque(theta, 0.0, p) - ports.elastic_torque(theta, 0.0, plain)
        assert more == pytest.approx(0.08 * np.sin(theta + 0.3), rel=1e-9)


def _worn(share, wear):
    return share * wear


def _wears(wear, travel):
    return wear + abs(travel)


WEAR = Effect(
    id="wear",
    equation="g (1 + a w), w the way that was covered",
    balance=Balance.TORQUE,
    parity=Parity.ODD,
    parameters=(strength("share", "1", -1.0, 1.0, (0.1,), "chosen"),),
    looks_like="friction that grows with use",
    check="run it",
    separated_by="a longer run",
    source="chosen",
    terms={Port.FRICTION_SHARE: _worn},
    states=(State("wear", _wears),),
)


def test_an_effect_from_outside_remembers():
    register(WEAR)
    try:
        unit = replace(MODEL, effects=(EffectEntry(id="wear", strengths={"share": 0.5}),))
        p, slow = unit.vector(), ports.slow_start(25.0, unit.vector())
        levels = []
        for _ in range(3):
            levels.append(ports.friction_level(0.5, 1.0, 0.0, 25.0, 0.0, slow, p))
            ports.pass_friction_time(slow, 1.0, -0.2, 25.0, 1e-3, p)
    finally:
        unregister("wear")
    np.testing.assert_allclose(np.array(levels) / levels[0], [1.0, 1.1, 1.2])
    assert ports.friction_level(0.5, 1.0, 0.0, 25.0, 0.0, slow, p) == pytest.approx(levels[0])


def _unsteady(theta, share):
    return share + 0.01 * theta


def _endless(theta, share):
    return share / (theta - theta)


def _odd(theta, share, velocity):
    return share * theta * velocity


def _not_numba(theta, share):
    return share * float(f"{theta}")


@pytest.fixture(scope="module")
def room():
    """After all that was refused, an effect finds its room still free."""
    yield
    register(WEAR)
    unregister("wear")
    assert "wear" not in CATALOGUE


@pytest.mark.usefixtures("room")
@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"id": "brush_drop"}, "there is an effect of this id already"),
        ({"id": "Wear 2"}, "the id of an effect is a name in lower case"),
        ({"source": " "}, "`source` is empty"),
        ({"look_alikes": ("cogging",)}, "look-alikes must be effects, or parameter:NAME (got cogging)"),
        ({"terms": {}}, "it has no term"),
        ({"terms": {Port.SPRINGS: _worn}}, "the port SPRINGS is closed to effects from outside"),
        ({"terms": {Port.PLATE_TORQUE: _odd}}, "PLATE_TORQUE a function asks for velocity; known there: theta"),
        ({"terms": {Port.PLATE_TORQUE: _worn}}, "at PLATE_TORQUE a function asks for wear"),
        ({"terms": {Port.PLATE_TORQUE: _unsteady}}, "PLATE_TORQUE is not zero where its strengths are zero"),
        ({"terms": {Port.PLATE_TORQUE: _endless}}, "its term at PLATE_TORQUE is not"),
        ({"terms": {Port.PLATE_TORQUE: _not_numba}}, "its functions cannot be compiled"),
        ({"parameters": (strength("omega", "1", -1.0, 1.0, (0.1,), "chosen"),)}, "a parameter cannot be named omega"),
        ({"parameters": (strength("share", "1", 1.0, -1.0, (0.1,), "chosen"),)}, "share has no range"),
        ({"parameters": (strength("share", "1", -1.0, 1.0, (), "chosen"),)}, "no strength has steps"),
        ({"parameters": tuple(strength(f"s{k}", "1", -1.0, 1.0, (0.1,), "chosen") for k in range(200))}, "no room"),
    ],
)  # fmt: skip
def test_what_breaks_the_contract_is_refused_and_nothing_is_taken_in(changes, says):
    before, plain = dict(CATALOGUE), _run(MODEL).angle
    wrong = replace(WEAR, **changes)
    if "id" not in changes and "room" in says:
        wrong = replace(wrong, terms={Port.PLATE_TORQUE: lambda s0: s0}, states=())
    with pytest.raises(InputError, match=re.escape(says)):
        register(wrong)
    assert dict(CATALOGUE) == before
    np.testing.assert_array_equal(_run(MODEL).angle, plain)


def test_only_what_came_from_outside_can_be_taken_out():
    with pytest.raises(InputError, match="no effect from outside has this id"):
        unregister("brush_drop")
    assert "brush_drop" in CATALOGUE
