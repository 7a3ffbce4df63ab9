"""Load plug-ins from files.

The modules of this package hold what each kind of part is declared with.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

from etb_hil.base.arguments import checked
from etb_hil.base.plugins import Plugin, add_file, declared, location, plugins, remove_file

__all__ = ["Plugin", "load", "loaded", "unload"]

# kind of part -> the module that holds its registry
_REGISTRIES = {
    "effects": "etb_hil.plant.effects.catalogue",
    "keys": "etb_hil.uds.keys",
    "laws": "etb_hil.controller.laws.registry",
    "measurements": "etb_hil.diagnosis.measurement_registry",
    "observers": "etb_hil.observer.registry",
    "phases": "etb_hil.scenario.phases",
    "readers": "etb_hil.canio.logs.reading",
}


@checked
def load(path: str | Path) -> Plugin:
    """Take in the parts that a Python file declares.

    They are its constants `EFFECT`, `KEY`, `LAW`, `MEASUREMENT`, `OBSERVER`, `PHASE` and `READER`.

    This process has them from then on, and those that it starts. Raises InputError, naming file and reason, where one
    cannot be loaded, has the name of another one or breaks its contract; nothing of the file is taken in then.
    """
    file = location(Path(path))
    for kind in declared(file):
        import_module(_REGISTRIES[kind])
    add_file(file)
    return next(one for one in loaded() if one.file == str(file))


@checked
def unload(path: str | Path) -> None:
    """Take out the parts of a file that was loaded; InputError where it was not."""
    remove_file(Path(path))


def loaded() -> tuple[Plugin, ...]:
    """Return the plug-ins that there are: installed packages, then files."""
    return plugins()
