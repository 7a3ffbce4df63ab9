"""A wrongly typed argument of a public function gives one error that names it, and nothing is done."""

import inspect

import numpy as np
import pytest

import etb_hil as etb
from etb_hil.cli.main import main

FUNCTIONS = {
    etb.read: "no.csv", etb.run: None, etb.connect: None, etb.simulate: None, etb.explain: "no.csv",
    etb.replay: "no.blf", etb.history: None, etb.Run.open: "no",
}  # fmt: skip
ARGUMENTS = [
    pytest.param(function, first, name, id=f"{function.__qualname__}-{name}")
    for function, first in FUNCTIONS.items()
    for name in inspect.signature(function).parameters
]


@pytest.mark.parametrize(("function", "first", "name"), ARGUMENTS)
def test_an_argument_of_another_type_is_named(function, first, name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    leading = next(iter(inspect.signature(function).parameters))
    arguments = {} if first is None else {leading: first}
    with pytest.raises(etb.InputError, match=rf"{name} has the wrong type \(it is .*; allowed: "):
        function(**{**arguments, name: 5j})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"seed": "x"}, "seed has the wrong type (it is 'x'); allowed: a whole number"),
        ({"seed": 1.5}, "seed has the wrong type (it is 1.5); allowed: a whole number"),
        ({"seed": True}, "seed has the wrong type (it is True); allowed: a whole number"),
        ({"serial": 12}, "serial has the wrong type (it is 12); allowed: a text"),
        ({"bench": None}, "bench has the wrong type (it is None); allowed: a text, a path"),
    ],
)
def test_the_error_says_what_is_allowed(wrong, says, tmp_path):
    with pytest.raises(etb.InputError) as refused:
        etb.run(folder=tmp_path, **wrong)
    assert str(refused.value) == says


def test_each_wrong_argument_is_in_the_one_error(tmp_path):
    with pytest.raises(etb.InputError, match=r"observer has the wrong type[\s\S]*seed has the wrong type"):
        etb.run(folder=tmp_path, seed="x", observer=3)


def test_wrong_items_of_several_are_refused():
    with pytest.raises(etb.InputError, match=r"sources has the wrong type .*several of these: a text or a path"):
        etb.replay(["a.blf", 3])
    with pytest.raises(etb.InputError, match=r"fit_on has the wrong type"):
        etb.explain("a.csv", fit_on="1000")
    with pytest.raises(etb.InputError, match=r"recording has the wrong type .*allowed: a Recording"):
        etb.diagnose("a.csv")


def test_numbers_of_numpy_and_whole_numbers_for_others_are_taken(tmp_path):
    found = etb.simulate(rate=np.float64(100.0), seed=np.int64(3), start_angle=None)
    assert etb.connect(folder=tmp_path, idle=np.float32(3.0), seed=np.int32(2)) is not None
    assert found.duration > 1.0


# What a user may get wrong, as the interface and as the command line are told it.
SAME = [
    (lambda: etb.run("nosuch"), ["run", "nosuch"]),
    (lambda: etb.run(bench="nosuch"), ["run", "friction_check", "--bench", "nosuch"]),
    (lambda: etb.run(unit="nosuch"), ["run", "friction_check", "--unit", "nosuch"]),
    (lambda: etb.run(limits="nosuch"), ["run", "friction_check", "--limits", "nosuch"]),
    (lambda: etb.run(observer="nosuch"), ["run", "friction_check", "--observer", "nosuch"]),
    (lambda: etb.read("."), ["plot", "."]),
    (lambda: etb.explain("."), ["explain", "."]),
    (lambda: etb.explain("table.csv"), ["explain", "table.csv"]),
    (lambda: list(etb.replay("a.csv", bench="nosuch")), ["replay", "a.csv", "--bench", "nosuch"]),
    (lambda: etb.explain("nosuch.csv"), ["explain", "nosuch.csv", "--model", "default"]),
    (lambda: etb.explain("nosuch.csv"), ["explain", "nosuch.csv"]),
    (lambda: etb.explain("text.xyz"), ["explain", "text.xyz", "--model", "default"]),
    (lambda: etb.explain("table.csv", "nosuch"), ["explain", "table.csv", "--model", "nosuch"]),
    (lambda: etb.simulate("nosuch"), ["simulate", "--unit", "nosuch"]),
    (lambda: etb.simulate(rate="5 m"), ["simulate", "--rate", "5 m"]),
    (lambda: etb.history("nosuch"), ["history", "nosuch"]),
    (lambda: etb.history("."), ["history", "."]),
]


@pytest.mark.parametrize(("call", "command"), SAME, ids=[" ".join(command) for _, command in SAME])
def test_an_error_has_the_words_of_the_command_line(call, command, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "text.xyz").write_text("x\n")
    (tmp_path / "table.csv").write_text("time_s,motor_voltage_V,throttle_angle_rad\n0,1,0\n0.001,2,0\n0.002,1,0\n")
    with pytest.raises(etb.EtbHilError) as refused:
        call()
    assert main(command) == 2
    assert str(refused.value) in capsys.readouterr().err
