"""An effect is one file: no other product file names it, whatever is said of it is in its declaration."""

import ast
import re
from pathlib import Path

import pytest

import etb_hil
from etb_hil.plant.effects.catalogue import CATALOGUE

PACKAGE = Path(etb_hil.__file__).parent
FILES = [path for path in sorted(PACKAGE.rglob("*.py")) if PACKAGE / "plant" / "effects" not in path.parents]


def _named(text):
    """Return the effects that a module's code names, by line; what its docstrings say is no code."""
    tree = ast.parse(text)
    holders = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    documented = [node for node in ast.walk(tree) if isinstance(node, holders) and ast.get_docstring(node) is not None]
    docstrings = {node.body[0].value for node in documented}
    found = []
    for node in ast.walk(tree):
        if node in docstrings:
            continue
        names = [value for _, value in ast.iter_fields(node) if isinstance(value, str)]
        found += [(node.lineno, id_) for name in names for id_ in re.findall(r"\w+", name) if id_ in CATALOGUE]
    return found


@pytest.mark.parametrize(
    "line",
    [
        "x = 'brush_drop'",
        "x = 'brush_drop.drop'",
        "from a.brush_drop import EFFECT",
        "import a.brush_drop",
        "a.brush_drop",
        "brush_drop = 1",
        "def brush_drop(): pass",
        "f(brush_drop=1)",
    ],
)
def test_every_way_to_name_an_effect_is_seen(line):
    assert _named(line) == [(1, "brush_drop")]
    assert _named('"""Of brush_drop."""') == []


def test_no_product_file_names_an_effect():
    assert len(FILES) > 300
    found = [
        f"{path.relative_to(PACKAGE)}:{line}: {id_}" for path in FILES for line, id_ in _named(path.read_text("utf-8"))
    ]
    assert found == []


def test_no_effect_names_another_in_code():
    """Physics that couples two effects is in their declarations, by id."""
    for id_ in CATALOGUE:
        path = PACKAGE / "plant" / "effects" / f"{id_}.py"
        tree = ast.parse(path.read_text("utf-8"))
        imported = {one.module for one in ast.walk(tree) if isinstance(one, ast.ImportFrom)}
        assert not imported & {f"etb_hil.plant.effects.{other}" for other in CATALOGUE}, id_
