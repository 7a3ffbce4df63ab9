"""The position laws by name: ours, and those of plug-ins; nothing is compiled for the names."""

from __future__ import annotations

from functools import cache

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.plugins import Part, parts, when_changed
from etb_hil.controller.laws.interface import ControlLaw

DEFAULT = "pd"
OWN = (DEFAULT, "pid", "sliding-mode")


def law_names() -> tuple[str, ...]:
    """Return the names of all laws, ours first."""
    return (*OWN, *laws_of_plugins())


def require_law(name: str) -> None:
    """Raise InputError, with the names of all laws, where there is none of a name."""
    if name not in law_names():
        raise InputError(Problem("no such control law", value=name, allowed=", ".join(law_names())))


@cache
def laws_of_plugins() -> dict[str, Part]:
    """Return the laws of plug-ins by name; InputError where one breaks the contract."""
    found = {}
    for part in parts("laws"):
        part.require(ControlLaw)
        name = part.name.replace("_", "-")
        if name in OWN or name in found:
            raise part.refused(f"there is a law {name} already")
        found[name] = part
    return found


when_changed(laws_of_plugins.cache_clear)
when_changed(laws_of_plugins)
