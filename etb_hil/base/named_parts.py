"""A registry of parts by name: our own modules, and those of plug-ins.

One of ours goes by the name of its file.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping
from importlib import import_module
from types import ModuleType
from typing import Generic, TypeVar

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.nearest import did_you_mean
from etb_hil.base.plugins import KINDS, Part, parts, when_changed

Declared = TypeVar("Declared")


class NamedParts(Generic[Declared]):
    """The parts of a kind.

    A name is that of a module of the package `ours`, of a file, or of an entry point.

    `called` is what messages call a part, `declared` its type; `check` raises InputError of a part whose declaration
    breaks the contract.
    """

    def __init__(
        self, kind: str, ours: ModuleType, called: str, declared: type[Declared], check: Callable[[Part], None]
    ) -> None:
        self._kind, self._ours, self._called, self._declared, self._check = kind, ours, called, declared, check
        self._of_plugins: dict[str, Part] | None = None
        when_changed(self._read_again)

    def names(self) -> tuple[str, ...]:
        """Return all names in order of the alphabet; imports none of ours."""
        return tuple(sorted({*self._modules(), *self.of_plugins()}))

    def require(self, name: str) -> None:
        """Raise InputError, with all names, where there is no part of a name."""
        if name not in self.names():
            what = f"there is no such {self._called}"
            otherwise = "if a plug-in has it, load its file (--plugin, or etb_hil.plugins.load)"
            remedy = did_you_mean(name, self.names(), otherwise)
            raise InputError(Problem(what, value=name, allowed=", ".join(self.names()), remedy=remedy))

    def own(self, name: str) -> Declared | None:
        """Return our part of a name; None where it is a plug-in's, or there is none."""
        module = self._modules().get(name)
        if module is None:
            return None
        found: Declared = getattr(import_module(f"{self._ours.__name__}.{module}"), KINDS[self._kind])
        return found

    def all_own(self) -> dict[str, Declared]:
        """Return our parts by name."""
        return {name: part for name in sorted(self._modules()) if (part := self.own(name)) is not None}

    def of_plugins(self) -> Mapping[str, Part]:
        """Return the parts of plug-ins by name; InputError where one breaks the contract."""
        if self._of_plugins is None:
            found: dict[str, Part] = {}
            for part in parts(self._kind):
                self.check(part)
                name = _name(part.name)
                if name in found or name in self._modules():
                    raise part.refused(f"the name {name} is taken by another {self._called}")
                found[name] = part
            self._of_plugins = found
        return self._of_plugins

    def check(self, part: Part) -> None:
        """Raise InputError where the declaration of a part breaks the contract."""
        part.require(self._declared)
        self._check(part)

    def _modules(self) -> dict[str, str]:
        return {_name(module.name): module.name for module in pkgutil.iter_modules(self._ours.__path__)}

    def _read_again(self) -> None:
        self._of_plugins = None
        self.of_plugins()


def _name(file: str) -> str:
    return file.replace("_", "-")
