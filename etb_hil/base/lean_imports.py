"""Keep libraries out of our commands that hardly one of them needs.

Other libraries import them wherever they are installed.

A process of ours hides them from those libraries alone; who needs one imports it then. A library that uses this
package hides nothing.

- python-can imports asammdf, and with it pandas: half a second.
- cantools imports its tester, and with it python-can: a twentieth of a second.
- numba imports scipy's linear algebra, for kernels that call BLAS: a tenth of a second and 15 MB. Ours call none; a
  plug-in's may, and numba imports scipy when it compiles them.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import ModuleType

_HIDDEN = "asammdf"
_USER, _LAST_OF_USER = "can.io.mf4", "MF4Reader"
_TESTER = "cantools.tester"
_ALGEBRA = "scipy.linalg"
_ALGEBRA_USER = "numba.np.arraymath"


def keep_imports_lean() -> None:
    """Keep python-can, cantools and numba from importing what hardly a command needs.

    This holds for this process.
    """
    global _is_lean  # noqa: PLW0603 (a property of the process)
    _is_lean = True
    if _USER not in sys.modules:
        sys.meta_path.insert(0, _Hiding())
    if "cantools" not in sys.modules:
        sys.modules[_TESTER] = _Tester(_TESTER)


_is_lean = False


class _Hiding:
    """Hides asammdf from python-can while that loads, and from nobody else."""

    def find_spec(self, fullname: str, _path: Sequence[str] | None, _target: ModuleType | None = None) -> None:
        user = sys.modules.get(_USER) if fullname == _HIDDEN else None
        if user is not None and not hasattr(user, _LAST_OF_USER):
            raise ModuleNotFoundError(f"{_HIDDEN} is imported where it is needed", name=_HIDDEN)


class _Tester(ModuleType):
    """The tester of cantools until somebody asks for something of it."""

    def __getattr__(self, name: str) -> object:
        if name.startswith("__"):
            raise AttributeError(name)
        if sys.modules.get(_TESTER) is self:
            del sys.modules[_TESTER]
        return getattr(importlib.import_module(_TESTER), name)


def bring_asammdf_back() -> None:
    """Undo what `keep_imports_lean` does to asammdf in python-can."""
    hiding = [finder for finder in sys.meta_path if isinstance(finder, _Hiding)]
    for finder in hiding:
        sys.meta_path.remove(finder)
    if hiding and _USER in sys.modules:
        importlib.reload(sys.modules[_USER])


@contextmanager
def lean_numba() -> Iterator[None]:
    """Hide `scipy.linalg` while numba loads, unless either is loaded already."""
    if not _is_lean or _ALGEBRA_USER in sys.modules or _ALGEBRA in sys.modules:
        yield
        return
    sys.modules[_ALGEBRA] = None  # type: ignore[assignment]
    try:
        yield
    finally:
        del sys.modules[_ALGEBRA]
