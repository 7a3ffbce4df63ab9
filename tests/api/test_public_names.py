"""What `import etb_hil` offers, and what it costs."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import etb_hil

PROMISED = {
    "read", "run", "simulate", "diagnose", "explain", "replay", "history", "Model", "Recording", "RunResult",
    "Measurement", "InputError", "BenchFault",
}  # fmt: skip


def test_the_promised_names_are_there_and_have_words():
    assert set(etb_hil.__all__) >= PROMISED
    for name in etb_hil.__all__:
        assert getattr(etb_hil, name).__doc__


def test_each_public_function_and_class_is_defined_once():
    stub = ast.parse((Path(etb_hil.__file__).with_suffix(".pyi")).read_text())
    names = [alias.name for one in stub.body if isinstance(one, ast.ImportFrom) for alias in one.names]
    assert sorted(names) == sorted(etb_hil.__all__)
    assert len(names) == len(set(names))


def test_what_is_not_public_is_said_as_python_says_it():
    with pytest.raises(AttributeError, match="nonsense"):
        _ = etb_hil.nonsense


def test_the_package_alone_loads_nothing_heavy():
    heavy = ["numpy", "numba", "pydantic", "matplotlib", "cantools", "can", "yaml", "scipy", "pyarrow"]
    code = f"import etb_hil, sys; print(sorted(set({heavy}) & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_interface_is_marked_as_typed():
    assert Path(etb_hil.__file__).with_name("py.typed").is_file()


def test_no_deprecated_name_outlives_its_version():
    package = Path(etb_hil.__file__).parent
    sources = [path.read_text("utf-8") for path in package.rglob("*.py")]
    found = [version for text in sources for version in re.findall(r'goes_in="([\d.]+)"', text)]
    now = [int(part) for part in etb_hil.__version__.split(".")]
    assert found
    assert all([int(part) for part in one.split(".")] > now for one in found)
