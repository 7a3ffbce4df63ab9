"""The mutation tool puts faults into code, and says which of them the tests find."""

import ast
import textwrap
from pathlib import Path

import pytest
from mutation import known_survivors, source_of, with_keys
from mutation_modules import MODULES
from mutation_operators import mutants_of
from mutation_trial import killed, watched

CODE = '''
"""A limit."""


def _half_of(value):
    return value / 2


LIMIT = _half_of(10.0)


def is_above(value, margin=0):
    """Return whether a value is above the limit."""
    return value - margin > LIMIT


def never_called(flag):
    if flag:
        raise ValueError(f"{flag + 1}")
'''
TESTS = """
from decided.limit import is_above


def test_it():
    assert is_above(5.5)
    assert not is_above(4.5)
    assert not is_above(6.5, 2)
"""


CHECKOUT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("module", MODULES)
def test_a_module_that_decides_is_there_with_its_tests(module):
    """A file of tests that was moved would find nothing, and every mutant would survive."""
    files = {*MODULES[module].tests(compiled=False), *MODULES[module].tests(compiled=True)}
    assert [path for path in (f"etb_hil/{module}.py", *sorted(files)) if not (CHECKOUT / path).is_file()] == []


def test_each_survivor_with_a_reason_is_a_mutant_of_the_code_as_it_is():
    """A reason of a line that was changed or deleted says nothing any more."""
    keys = set()
    for module in MODULES:
        text = source_of(CHECKOUT, module).read_text("utf-8")
        keys |= {key for _, key in with_keys(module, text.splitlines(), mutants_of(ast.parse(text)))}
    assert sorted(known_survivors().keys() - keys) == []


def changes(code):
    return {(m.before, m.after) for m in mutants_of(ast.parse(code))}


def test_operators_change_comparisons_conditions_numbers_and_calls():
    assert changes("if a < 3 and not b: x.y = min(c, -d)") >= {
        ("a < 3", "a <= 3"), ("3", "4"), ("a < 3 and (not b)", "a < 3"), ("a < 3 and (not b)", "not b"), ("not b", "b"),
        ("a < 3 and (not b)", "not (a < 3 and (not b))"), ("min(c, -d)", "max(c, -d)"), ("-d", "d"),
        ("x.y = min(c, -d)", "pass"),
    }  # fmt: skip
    assert changes("x = [a for a in b if abs(a) > 0.5]") == {
        ("abs(a) > 0.5", "abs(a) >= 0.5"), ("abs(a) > 0.5", "True"), ("abs(a)", "a"), ("0.5", "1.0"), ("0.5", "0.25"),
    }  # fmt: skip


def test_messages_types_and_documents_are_left_alone():
    code = 'def f(x: int | None) -> "int | None":\n    "1 + 1"\n    raise ValueError(f"{x + 1}", 2)\n'
    assert changes(code) == {("raise ValueError(f'{x + 1}', 2)", "pass")}


def test_a_mutant_is_killed_by_tests_that_run_its_line(tmp_path):
    path = tmp_path / "decided" / "limit.py"
    path.parent.mkdir()
    path.write_text(CODE)
    (tmp_path / "test_limit.py").write_text(textwrap.dedent(TESTS))
    (tmp_path / "conftest.py").write_text("")
    syntax = ast.parse(CODE)
    watch = watched(tmp_path, path, ["test_limit.py"], compiled=True)
    survived = {(m.before, m.after) for m in mutants_of(syntax) if not killed(tmp_path, path, syntax, m, watch)}
    assert survived == {
        ("value - margin > LIMIT", "value - margin >= LIMIT"),
        ("flag", "not flag"),
        ("raise ValueError(f'{flag + 1}')", "pass"),
    }


def test_two_faults_that_look_alike_have_keys_of_their_own():
    source = "low = max(0, 0)\nhigh = max(0, 0)"
    keys = [key for _, key in with_keys("some", source.splitlines(), mutants_of(ast.parse(source)))]
    assert len(set(keys)) == len(keys) == 6
    assert sum(key.endswith("[0 -> 1] 2") for key in keys) == 2
