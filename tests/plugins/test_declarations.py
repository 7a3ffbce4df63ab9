"""Every field of a declaration is checked, by the registries and by the contract tests alike."""

import re
from dataclasses import replace
from typing import Literal

import pytest

from etb_hil import plugins, testing
from etb_hil.base.errors import InputError
from etb_hil.plugins.effects import Balance, Effect, Parity, Port, strength
from etb_hil.plugins.keys import SecurityKey
from etb_hil.plugins.laws import ControlLaw
from etb_hil.plugins.measurements import Estimate, MeasurementKind
from etb_hil.plugins.observers import ObserverKind
from etb_hil.plugins.phases import Held, PhaseModel
from etb_hil.plugins.readers import Reader

MEASUREMENT = """
from etb_hil.plugins.measurements import Estimate, MeasurementKind
MEASUREMENT = MeasurementKind(id="mine", name="mine", unit="A", compute=lambda run: Estimate(1.0), {})
"""


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ("order='x'", "`order` must be a whole number (it is 'x')"),
        ("order=True", "`order` must be a whole number (it is True)"),
        ("order=1, phases='dash'", "`phases` must be a set of texts (it is 'dash')"),
        ("order=1, phases=5", "`phases` must be a set of texts (it is 5)"),
        ("order=1, roles='current'", "`roles` must be a set of texts (it is 'current')"),
        ("order=1, roles={5}", "`roles` must be a set of texts (it is {5})"),
        ("order=1, source=None", "`source` must be a text (it is None)"),
        ("order=1, too_high=5", "`too_high` must be a text (it is 5)"),
        ("order=1, suffixes=None", "`suffixes` must be a text (it is None)"),
        ("order=1, is_friction='no'", "`is_friction` must be True or False (it is 'no')"),
        ("order=1, least_limit='1 A'", "`least_limit` must be a number, or None (it is '1 A')"),
    ],
)
def test_a_field_of_another_type_is_named(fields, says, tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(MEASUREMENT.format(fields), "utf-8")
    with pytest.raises(InputError, match=re.escape(str(path)) + ".*" + re.escape(says)):
        plugins.load(path)
    assert plugins.loaded() == ()


@pytest.mark.parametrize("phases", ["{'dash'}", "['dash']", "('dash',)", "frozenset({'dash'})"])
def test_phases_may_be_any_set_of_texts(phases, tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(MEASUREMENT.format(f"order=1, phases={phases}"), "utf-8")
    assert plugins.load(path).parts == ("measurements: mine",)


def test_one_file_is_one_plugin_however_its_folder_is_written(tmp_path, monkeypatch):
    path = tmp_path / "folder" / "mine.py"
    path.parent.mkdir()
    path.write_text(MEASUREMENT.format("order=1"), "utf-8")
    (tmp_path / "link").symlink_to(path.parent, target_is_directory=True)
    first = plugins.load(path)
    monkeypatch.chdir(path.parent)
    for other in (tmp_path / "folder" / ".." / "folder" / "mine.py", tmp_path / "link" / "mine.py", "mine.py"):
        assert plugins.load(other) == first
    assert len(plugins.loaded()) == 1
    plugins.unload(tmp_path / "link" / "mine.py")
    assert plugins.loaded() == ()


EFFECT = Effect(
    id="leaning", equation="m theta", balance=Balance.TORQUE, parity=Parity.EVEN,
    parameters=(strength("moment", "N·m", -1.0, 1.0, (0.1,), "chosen"),), looks_like="a spring", check="look",
    separated_by="nothing", source="chosen", terms={Port.PLATE_TORQUE: lambda theta, moment: moment * theta},
)  # fmt: skip
KIND = MeasurementKind(id="mine", name="mine", unit="A", compute=lambda _run: Estimate(1.0), order=400)


class NoName(PhaseModel):
    kind: str = "mine"

    def trajectory(self, _start, _throttle):
        return Held(0.5, 0.5)


class NoTrajectory(PhaseModel):
    kind: Literal["mine"] = "mine"


@pytest.mark.parametrize(
    ("check", "arguments", "says"),
    [
        (testing.check_effect, [None], "EFFECT is of the type NoneType"),
        (testing.check_effect, [replace(EFFECT, id=5)], "`id` must be a text"),
        (testing.check_effect, [replace(EFFECT, parameters=None)], "`parameters` must be of the type tuple"),
        (testing.check_effect, [replace(EFFECT, look_alikes="brush_drop")], "`look_alikes` must be a set of texts"),
        (testing.check_key, [None], "KEY is of the type NoneType"),
        (testing.check_key, [SecurityKey(None)], "`compute` must be a function"),
        (testing.check_law, [None], "LAW is of the type NoneType"),
        (testing.check_law, [ControlLaw("mine", None, None)], "`gains` must be a function"),
        (testing.check_measurement, [None], "MEASUREMENT is of the type NoneType"),
        (testing.check_measurement, [replace(KIND, phases="dash")], "`phases` must be a set of texts"),
        (testing.check_measurement, [replace(KIND, order="x")], "`order` must be a whole number"),
        (testing.check_observer, [None], "OBSERVER is of the type NoneType"),
        (testing.check_observer, [ObserverKind(None, None)], "`summary` must be a text"),
        (testing.check_phase, [None, {}], "PHASE must be a subclass of PhaseModel"),
        (testing.check_phase, [PhaseModel, {}], "its field `kind` has no single name"),
        (testing.check_phase, [NoName, {}], "its field `kind` has no single name"),
        (testing.check_phase, [NoTrajectory, {}], "it has no method `trajectory`"),
        (testing.check_reader, [None, "a.mine"], "READER is of the type NoneType"),
        (testing.check_reader, [Reader("mine", "x", open), "a.mine"], "`suffixes` must be a tuple"),
        (testing.check_reader, [Reader("mine", (".mine",), open), None], "the path must be a text or a path"),
    ],
)
def test_a_contract_test_begins_with_the_declaration(check, arguments, says):
    with pytest.raises(AssertionError, match=re.escape(says)):
        check(*arguments)
    assert plugins.loaded() == ()
