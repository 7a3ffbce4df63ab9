"""Without any extra the package imports, but for what an extra is there for."""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

PROJECT = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8"))["project"]
BEHIND_AN_EXTRA = ("etb_hil.histories.", "etb_hil.report.history_", "etb_hil.page.", "etb_hil.pytest_plugin")
IMPORTS = """
import importlib, json, pkgutil, sys
for library in json.loads(sys.argv[1]):
    sys.modules[library] = None
import etb_hil
missing = {}
for module in pkgutil.walk_packages(etb_hil.__path__, "etb_hil."):
    if ".migrations." in module.name or module.name.endswith("__main__"):
        continue  # these run when imported
    try:
        importlib.import_module(module.name)
    except ModuleNotFoundError as error:
        missing[module.name] = str(error)
print(json.dumps(missing))
"""


def named(requirements):
    """Return the modules that requirements bring, where they have their package's name."""
    return {re.match(r"[\w-]+", one)[0].replace("-", "_") for one in requirements} - {"etb_hil", "python_can"}


def test_only_what_an_extra_is_for_needs_its_libraries():
    extras = set().union(*map(named, PROJECT["optional-dependencies"].values())) - named(PROJECT["dependencies"])
    assert {"scipy", "pyarrow", "pandas", "starlette"} <= extras
    done = subprocess.run(
        [sys.executable, "-c", IMPORTS, json.dumps(sorted(extras))], capture_output=True, text=True, check=True
    )
    missing = json.loads(done.stdout)
    assert any(name.startswith("etb_hil.histories.") for name in missing)
    assert {name: why for name, why in missing.items() if not name.startswith(BEHIND_AN_EXTRA)} == {}
