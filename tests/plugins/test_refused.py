"""A plug-in that cannot be loaded, clashes or breaks its contract: one error with file and reason, nothing taken in."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import etb_hil
from etb_hil import plugins
from etb_hil.base.errors import InputError
from etb_hil.canio.logs.reading import read_log
from etb_hil.controller.laws.registry import LAWS
from etb_hil.diagnosis.measurement_registry import measurement_kinds
from etb_hil.observer.registry import OBSERVERS
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.scenario.phases import phase_kinds

EFFECT = """
from etb_hil.plugins.effects import Balance, Effect, Parity, Port, strength

def torque(theta, moment):
    return moment * theta

EFFECT = Effect(
    id="leaning", equation="m theta", balance=Balance.TORQUE, parity=Parity.EVEN,
    parameters=(strength("moment", "N·m", -1.0, 1.0, (0.1,), "chosen"),),
    looks_like="a spring", check="look", separated_by="nothing", source="chosen", terms={Port.PLATE_TORQUE: torque},
)
"""
LAW = """
from etb_hil.plugins.laws import ControlLaw
LAW = ControlLaw("none", lambda nominal: [1.0], lambda gain, memory, error, rate: gain[0] * error)
"""
MEASUREMENT = """
from etb_hil.plugins.measurements import Estimate, MeasurementKind
MEASUREMENT = MeasurementKind(id="mine", name="mine", unit="A", compute=lambda run: Estimate(1.0), order=400)
"""
OBSERVER = """
from etb_hil.plugins.observers import ObserverKind
OBSERVER = ObserverKind("none", lambda model, throttle, noise: None)
"""
PHASE = """
from typing import Literal
from etb_hil.plugins.phases import PhaseModel, Released

class Rest(PhaseModel):
    kind: Literal["rest"]

    def trajectory(self, start, throttle):
        return Released(1.0)

PHASE = Rest
"""
READER = """
from etb_hil.plugins.readers import Reader
READER = Reader("mine", (".mine",), open)
"""
SOUND = {
    "effect": EFFECT,
    "law": LAW,
    "measurement": MEASUREMENT,
    "observer": OBSERVER,
    "phase": PHASE,
    "reader": READER,
}


def _known():
    return [*CATALOGUE], LAWS.names(), [*measurement_kinds()], OBSERVERS.names(), [*phase_kinds()]


def _refused(path, text, says):
    path.write_text(text, "utf-8")
    before = _known()
    with pytest.raises(InputError) as refused:
        plugins.load(path)
    assert str(path) in str(refused.value)
    assert re.search(says, str(refused.value)), str(refused.value)
    assert _known() == before
    assert plugins.loaded() == ()


@pytest.mark.parametrize("text", SOUND.values(), ids=SOUND)
def test_a_sound_file_is_taken_in_and_taken_out_again(text, tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(text, "utf-8")
    before = _known()
    (kind,) = [part.partition(":")[0] for part in plugins.load(path).parts]
    assert kind == "readers" or _known() != before
    plugins.unload(path)
    assert _known() == before


@pytest.mark.parametrize(
    ("kind", "old", "new", "says"),
    [
        ("effect", '"leaning"', '"brush_drop"', "there is an effect of this id already"),
        ("effect", "moment * theta", "1.0 + moment * theta", "not zero where its strengths are zero"),
        ("effect", "moment * theta", "moment * thetaa", "cannot be compiled: .*name 'thetaa' is not defined"),
        ("effect", "moment * theta", "moment * 'a'", "compiled: line 5: `[*]` cannot be used with a number and a text"),
        ("effect", "moment * theta", "moment.foo", "compiled: line 5: a number has no attribute 'foo'"),
        ("effect", "moment * theta", "[moment][theta]", r"line 5: `\[\]` cannot be used with a list and a number"),
        ("effect", "moment * theta", "len(moment)", "line 5: `len` cannot be used with a number"),
        ("effect", "moment * theta", "moment if theta else 'x'", "a number in one branch and a text in another"),
        ("effect", "moment * theta", "{moment: theta}", r"the result must be a number \(it is a dictionary\)"),
        ("effect", "moment * theta", "moment * open('x')", "line 5: compiled code cannot use 'open'"),
        ("effect", "Port.PLATE_TORQUE:", "Port.PLATE_TORQ:", r"mine\.py:10: .*; did you mean 'PLATE_TORQUE'\?"),
        ("effect", "EFFECT = Effect(", "EFFECT = dict(", r"EFFECT is of the type dict; set EFFECT = Effect\(...\)"),
        ("law", "LAW = ControlLaw(", "LAW = tuple, (", "LAW is of the type tuple"),
        ("measurement", 'id="mine"', 'id="T_st"', "there is a measurement with the id T_st already"),
        ("measurement", 'id="mine"', 'id="my own"', "the id of a measurement is a name"),
        ("measurement", 'unit="A"', 'unit=""', "`unit` must be a text"),
        ("measurement", 'unit="A"', 'unit="Amp"', r"the unit must be an SI unit \(got 'Amp'\); did you mean 'A'?"),
        ("measurement", 'unit="A"', 'unit="mA"', r"the unit must be an SI unit \(got 'mA'\); did you mean 'A'?"),
        (
            "measurement",
            'unit="A"',
            'unit="foo"',
            r"the unit must be an SI unit \(got 'foo'\); write it with A, V, rad",
        ),
        ("measurement", "lambda run:", "lambda:", "`compute` must be a function of one argument"),
        ("measurement", "order=400", 'order=400, roles=frozenset({"light"})', "there is no role light"),
        ("measurement", "order=400", 'order=400, suffixes="("', "`suffixes` must be a regular expression"),
        ("measurement", "order=400", 'order=400, friction_of="T_x"', "there is no measurement T_x"),
        ("measurement", 'id="mine"', "id=None", "`id` must be a text"),
        ("observer", "ObserverKind(", "str(", "OBSERVER is of the type"),
        ("observer", '"none", ', "None, ", r"`summary` must be a text \(it is None\)"),
        (
            "observer",
            "lambda model, throttle, noise: None",
            "None",
            r"`make` must be a function of \(model, throttle, no",
        ),
        (
            "observer",
            "lambda model, throttle, noise",
            "lambda model",
            r"`make` must take \(model, throttle, noise\): too",
        ),
        ("law", "lambda nominal: [1.0]", "None", r"`gains` must be a function of \(nominal\)"),
        ("law", "gain, memory, error, rate:", "gain:", r"`torque` must take \(gain, memory, error, rate\): too many"),
        ("law", '"none"', '""', "`summary` must be a text"),
        ("phase", '"rest"', '"hold"', "there is a kind of phase hold already"),
        ("phase", '"rest"', '"group"', "there is a kind of phase group already"),
        ("phase", '"rest"', '"My rest"', "its field `kind` has no single name"),
        ("phase", "def trajectory", "def other", "it has no method `trajectory`"),
        ("phase", "PHASE = Rest", "PHASE = Rest(kind='rest', id='x')", "PHASE must be a subclass of PhaseModel"),
        ("reader", '".mine"', '".blf"', "there is a reader of .blf files already"),
        ("reader", "open)", "None)", r"`open` must be a function of \(path\)"),
        ("reader", '(".mine",)', '".mine"', "`suffixes` must be a tuple of texts"),
        ("reader", '".mine"', '"mine"', "a suffix is a dot and small letters"),
    ],
)
def test_what_breaks_a_contract_is_refused(kind, old, new, says, tmp_path):
    assert old in SOUND[kind]
    text = SOUND[kind].replace(old, new)
    if old == "ObserverKind(":
        text = 'OBSERVER = "mine"'
    _refused(tmp_path / "mine.py", text, says)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("x = 1\n", "the file declares no part; allowed: EFFECT, KEY, LAW, MEASUREMENT, OBSERVER, PHASE, READER"),
        ("EFFECT = 1 / 0\n", "cannot be loaded: ZeroDivisionError: division by zero"),
        ("EFFECT = (\n", "cannot be loaded: SyntaxError"),
        ("import no_such_module\n", "cannot be loaded: ModuleNotFoundError: No module named 'no_such_module'"),
        ("raise SystemExit(0)\n", "cannot be loaded: SystemExit"),
    ],
)
def test_a_file_that_is_no_plugin_is_refused(text, says, tmp_path):
    _refused(tmp_path / "mine.py", text, says)


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"mine\.py: no such Python file"):
        plugins.load(tmp_path / "mine.py")


def test_of_a_file_with_one_wrong_part_nothing_is_taken_in(tmp_path):
    text = EFFECT + PHASE + MEASUREMENT.replace('id="mine"', 'id="T_c"')
    _refused(tmp_path / "mine.py", text, "there is a measurement with the id T_c already")


def test_two_files_with_the_same_part_clash(tmp_path):
    one, other = tmp_path / "one.py", tmp_path / "other.py"
    for path in (one, other):
        path.write_text(MEASUREMENT, "utf-8")
    plugins.load(one)
    with pytest.raises(InputError, match=r"other\.py: .*there is a measurement with the id mine already"):
        plugins.load(other)
    assert "mine" in measurement_kinds()
    assert [loaded.name for loaded in plugins.loaded()] == ["one.py"]


@pytest.mark.parametrize("first", [EFFECT.replace("moment * theta", "moment * thetaa"), EFFECT])
def test_an_edited_file_is_read_again(first, tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(first, "utf-8")
    try:
        before = plugins.load(path).sha256
    except InputError:
        before = ""
    else:
        path.write_text("while it is loaded, its hash is that of the code that runs")
        assert plugins.load(path).sha256 == before
        plugins.unload(path)
    path.write_text(EFFECT.replace("moment * theta", "2.0 * moment * theta"), "utf-8")
    assert plugins.load(path).sha256 != before
    (torque,) = CATALOGUE["leaning"].terms.values()
    assert torque(0.5, 0.25) == 0.25


def test_a_file_is_taken_in_once(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(MEASUREMENT, "utf-8")
    assert plugins.load(path) == plugins.load(path)
    assert len(plugins.loaded()) == 1


def test_only_what_was_loaded_can_be_taken_out(tmp_path):
    with pytest.raises(InputError, match="this file must be a plug-in of this process"):
        plugins.unload(tmp_path / "mine.py")


def test_a_suffix_that_nothing_reads_is_refused_with_those_that_are_read(tmp_path, part):
    path = tmp_path / "a.frames"
    path.write_text("", "utf-8")
    with pytest.raises(
        InputError, match=r"must have a suffix of a log format.*allowed: \.asc, .*\.mf4, \.trc, each also with \.gz"
    ):
        read_log(path)
    plugins.load(part("frame_lines"))
    assert list(read_log(path)) == []


@pytest.fixture
def package(tmp_path):
    """Return what installs a package of one module with an entry point, and runs a command that asks for it."""

    def run(text, *, entry="mine:OBSERVER"):
        (tmp_path / "mine.py").write_text(text, "utf-8")
        about = tmp_path / "their_package-2.1.dist-info"
        about.mkdir()
        (about / "METADATA").write_text("Metadata-Version: 2.1\nName: their-package\nVersion: 2.1\n", "utf-8")
        (about / "entry_points.txt").write_text(f"[etb_hil.observers]\nmine = {entry}\n", "utf-8")
        path = os.pathsep.join([str(tmp_path), str(Path(etb_hil.__file__).parents[1])])
        command = [sys.executable, "-m", "etb_hil", "run", "friction_check", "--observer", "mine"]
        environment = {**os.environ, "PYTHONPATH": path}
        return subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path, env=environment)

    return run


@pytest.mark.parametrize(
    ("text", "entry", "says"),
    [
        ("1 / 0", "mine:OBSERVER", "the plug-in cannot be loaded: ZeroDivisionError"),
        ("", "mine:OBSERVER", "the plug-in cannot be loaded: AttributeError"),
        ("", "nowhere:OBSERVER", "the plug-in cannot be loaded: ModuleNotFoundError"),
        ("OBSERVER = 1", "mine:OBSERVER", "OBSERVER is of the type int; set OBSERVER = ObserverKind(...)"),
    ],
)
def test_a_broken_package_is_named_in_one_error(text, entry, says, package):
    done = package(text, entry=entry)
    assert done.returncode == 2
    assert "their-package 2.1: etb_hil.observers: mine" in done.stderr
    assert says in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    "declaration",
    [
        READER.replace('(".mine",)', "None"),
        READER.replace('(".mine",)', "(5,)").replace('"mine"', "5"),
        MEASUREMENT.replace("order=400", "order='late'"),
        MEASUREMENT.replace('id="mine"', "id=5"),
    ],
)
def test_a_declaration_of_other_values_is_refused_with_its_file(tmp_path, declaration):
    path = tmp_path / "odd.py"
    path.write_text(declaration)
    before = os.environ.get("ETB_HIL_PLUGINS", "")
    with pytest.raises(InputError, match=re.escape(str(path))):
        plugins.load(path)
    assert os.environ.get("ETB_HIL_PLUGINS", "") == before
    assert "mine" not in measurement_kinds()


@pytest.mark.parametrize("name", ["helper.py", "_fast.abi3.so", "table.csv", "sub/deep.py"])
@pytest.mark.parametrize("init", ["__init__.py", None])
def test_any_file_of_a_package_changes_its_checksum(name, init, tmp_path):
    """A namespace has no `__init__`; compiled code and data are code as well."""
    root = tmp_path / "site" / "theirs"
    (root / "sub").mkdir(parents=True)
    for one in filter(None, ("mine.py", init, name)):
        (root / one).write_text(OBSERVER if one == "mine.py" else "", "utf-8")
    about = tmp_path / "site" / "their_package-2.1.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: their-package\nVersion: 2.1\n", "utf-8")
    (about / "entry_points.txt").write_text("[etb_hil.observers]\nmine = theirs.mine:OBSERVER\n", "utf-8")
    path = os.pathsep.join([str(tmp_path / "site"), str(Path(etb_hil.__file__).parents[1])])
    code = "from etb_hil import plugins; print(*[one.sha256 for one in plugins.loaded()])"

    def checksum():
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": path},
        )  # fmt: skip
        return done.stdout.strip()

    before = checksum()
    assert len(before) == 64
    assert checksum() == before
    (root / name).write_text("# changed\n", "utf-8")
    assert checksum() != before
