"""Plug-ins: installed packages and Python files that add parts to a registry.

Each registry asks for its own kind.

An installed package names a part as an entry point of the group `etb_hil.KIND`. A file declares one as a constant.
Files are listed in the environment, so that every process of a run has the same ones.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import inspect
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from traceback import walk_tb
from types import ModuleType
from typing import TYPE_CHECKING, Any

from etb_hil.base.compiler_text import plain_text
from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.files import as_utf8
from etb_hil.base.nearest import did_you_mean

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

# kind of part, which is the end of its entry points' group -> the constant by which a file declares one
KINDS = {
    "effects": "EFFECT",
    "keys": "KEY",
    "laws": "LAW",
    "measurements": "MEASUREMENT",
    "observers": "OBSERVER",
    "phases": "PHASE",
    "readers": "READER",
}
FILES = "ETB_HIL_PLUGINS"  # paths of files, as in PATH
_CHANGE = "change the plug-in, or run without it"


@dataclass(frozen=True, slots=True)
class Plugin:
    """A plug-in as results record it: a package and its version, or a file's name.

    `sha256` is that of its code.

    `parts` are its parts as `kind: name`; `file` is the path of a file that was loaded by itself.
    """

    name: str
    version: str
    sha256: str
    parts: tuple[str, ...] = field(default=(), compare=False)
    file: str = field(default="", compare=False)


@dataclass(frozen=True, slots=True)
class Part:
    """A part of a plug-in: its name, what was declared, and where.

    The name is that of the entry point, or the file's.
    """

    kind: str
    name: str
    value: Any
    place: Place

    def require(self, expected: type) -> None:
        """Raise InputError where the part is of another type than its registry holds."""
        if not isinstance(self.value, expected):
            what = f"{KINDS[self.kind]} is of the type {type(self.value).__name__}"
            raise self.refused(what, f"set {KINDS[self.kind]} = {expected.__name__}(...)")

    def require_text(self, name: str, value: object) -> None:
        """Raise InputError where a field of the declaration is no text."""
        if not isinstance(value, str) or not value.strip():
            raise self.refused(f"`{name}` must be a text (it is {value!r})")

    def require_texts(self, *names: str) -> None:
        """Raise InputError where one of these fields is no text; it may be empty."""
        for name in names:
            if not isinstance(value := getattr(self.value, name), str):
                raise self.refused(f"`{name}` must be a text (it is {value!r})")

    def require_names(self, *names: str) -> None:
        """Raise InputError where one of these fields is no set, list or tuple of texts."""
        for name in names:
            value = getattr(self.value, name)
            is_several = isinstance(value, set | frozenset | list | tuple)
            if not is_several or not all(isinstance(one, str) for one in value):
                raise self.refused(f"`{name}` must be a set of texts (it is {value!r})")

    def require_function(self, name: str, value: object, *arguments: str) -> None:
        """Raise InputError where a field cannot be called with some arguments.

        The field is one of the declaration; arguments are given by position.
        """
        wanted = f"({', '.join(arguments)})"
        if not callable(value):
            raise self.refused(f"`{name}` must be a function of {wanted} (it is {value!r})")
        try:
            signature = inspect.signature(value)
        except (TypeError, ValueError):  # a function in C that does not tell what it takes
            return
        try:
            signature.bind(*arguments)
        except TypeError as error:
            raise self.refused(f"`{name}` must take {wanted}: {error}") from None

    def refused(self, what: str, remedy: str = _CHANGE) -> InputError:
        """Return the error of a part that breaks its contract."""
        return InputError(Problem(f"the plug-in's {self.kind[:-1]} {self.name!r}: {what}", self.place, remedy=remedy))

    @contextmanager
    def guarded(self, doing: str) -> Iterator[None]:
        """Turn what the part's code raises into an InputError that names the plug-in."""
        with foreign_code(lambda error: self.refused(f"{doing} failed: {first_line(error)}")):
            yield


# What is no fault of foreign code: a stop by the operator, a computer without memory, a generator that is closed.
_NOT_ITS_FAULT = (KeyboardInterrupt, MemoryError, GeneratorExit)


@contextmanager
def foreign_code(refused: Callable[[BaseException], InputError]) -> Iterator[None]:
    """Turn whatever foreign code raises into the InputError that `refused` makes.

    Foreign code may raise anything. `sys.exit()` in it would end the command without a result, and with exit code 0.
    """
    try:
        yield
    except (InputError, *_NOT_ITS_FAULT):
        raise
    except BaseException as error:
        raise refused(error) from error


_changed: list[Callable[[], object]] = []


def when_changed(forget: Callable[[], object]) -> None:
    """Have something called whenever a file is added or removed.

    InputError from it refuses the file.
    """
    _changed.append(forget)


def parts(kind: str) -> tuple[Part, ...]:
    """Return the parts of a kind, those of installed packages first.

    InputError names one that cannot be loaded.
    """
    found = [_of_package(entry) for entry in _entry_points(kind)]
    for path in files():
        module = _module(path)
        if hasattr(module, KINDS[kind]):
            found.append(Part(kind, path.stem, getattr(module, KINDS[kind]), Place(path)))
    found += [one for one in _temporary if one.kind == kind]
    for one in found:
        if [other.name for other in found].count(one.name) > 1:
            places = " and ".join(str(other.place) for other in found if other.name == one.name)
            raise one.refused(f"two plug-ins have this name ({places})")
    return tuple(found)


_temporary: list[Part] = []


@contextmanager
def temporary_part(kind: str, name: str, value: object) -> Iterator[None]:
    """Have a part in this process alone for as long as a block runs.

    InputError where a registry refuses it.
    """
    part = Part(kind, name, value, Place("a test"))
    _temporary.append(part)
    try:
        _tell()
        yield
    finally:
        _temporary.remove(part)
        _tell()


def files() -> tuple[Path, ...]:
    """Return the paths of the files that are plug-ins."""
    return tuple(location(Path(one)) for one in os.environ.get(FILES, "").split(os.pathsep) if one)


def location(path: Path) -> Path:
    """Return the one path by which a file goes, however its folder is written.

    The file's own name stays, of a link too: the name of a part may be that of its file.
    """
    path = path.absolute()
    return path.parent.resolve() / path.name


def has_plugins() -> bool:
    """Return whether this process has any plug-in, without loading one."""
    return bool(files() or _temporary or any(map(_entry_points, KINDS)))


def add_file(path: Path) -> None:
    """Take in a file; where a registry refuses a part of it, none of it is taken in."""
    path = location(path)
    if path in files():
        return
    if os.pathsep in str(path):
        raise InputError(Problem(f"the path of a plug-in cannot have {os.pathsep!r} in it", Place(path)))
    if not declared(path):
        allowed = ", ".join(KINDS.values())
        raise InputError(Problem("the file declares no part", Place(path), allowed=allowed, remedy="declare one"))
    before = files()

    def refused(error: BaseException) -> InputError:  # a declaration with values that no registry can take
        what = f"the plug-in declares what cannot be taken in: {first_line(error)}"
        return InputError(Problem(what, Place(path), remedy=_CHANGE))

    try:
        with foreign_code(refused):
            _set_files((*before, path))
    except BaseException:
        _set_files(before)
        _forget_file(path)
        raise


def declared(path: Path) -> tuple[str, ...]:
    """Return the kinds of part that a file declares.

    InputError where it cannot be loaded.
    """
    module = _module(path)
    return tuple(kind for kind, constant in KINDS.items() if hasattr(module, constant))


def remove_file(path: Path) -> None:
    """Take out a file that was added; InputError where it was not."""
    path = location(path)
    if path not in files():
        raise InputError(Problem("this file must be a plug-in of this process", Place(path)))
    _set_files(tuple(one for one in files() if one != path))
    _forget_file(path)


def plugins() -> tuple[Plugin, ...]:
    """Return the plug-ins of this process."""
    found: dict[tuple[str, str], list[str]] = {}
    roots: dict[tuple[str, str], Path] = {}
    for kind in KINDS:
        for entry in _entry_points(kind):
            key = (entry.dist.name, entry.dist.version) if entry.dist else (entry.module, "")
            found.setdefault(key, []).append(f"{kind}: {entry.name}")
            with foreign_code(partial(_not_loaded, entry, _place_of(entry))):  # which runs the package's `__init__`
                roots.setdefault(key, _root(entry))
    packages = [Plugin(*key, _digest(roots[key]), tuple(names)) for key, names in found.items()]
    alone = [
        Plugin(
            as_utf8(path.name),
            _version(path),
            _loaded_digest(path),
            tuple(f"{k}: {as_utf8(path.stem)}" for k in declared(path)),
            str(path),
        )
        for path in files()
    ]
    return (*packages, *alone)


def first_line(error: BaseException) -> str:
    """Return the type of an error and the first line of what it says.

    Of a compiler's error, what it says of the source, and the line; of a missing attribute, the nearest one that
    exists.
    """
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    if type(error).__module__.startswith("numba."):
        lines = [line for line in lines if not line.startswith("Failed in nopython mode")]
        if said := plain_text(error):
            return said
    said = lines[0] if lines else ""
    if isinstance(error, AttributeError) and error.name:
        meant = did_you_mean(error.name, dir(error.obj))
        said += f"; {meant}" if meant else ""
    return f"{type(error).__name__}: {said}".strip(": ")


def _set_files(paths: tuple[Path, ...]) -> None:
    os.environ[FILES] = os.pathsep.join(map(str, paths))
    _tell()


def _tell() -> None:
    for forget in _changed:
        forget()


@cache
def _entry_points(kind: str) -> tuple[EntryPoint, ...]:
    return tuple(sorted(_installed().select(group=f"etb_hil.{kind}"), key=lambda entry: entry.name))


@cache
def _installed() -> Any:  # noqa: ANN401 (`EntryPoints`; in Python 3.11 a class that is deprecated, with the same method)
    """Return the entry points of all packages.

    The search reads a file of each, so a process does it once.
    """
    from importlib.metadata import entry_points  # noqa: PLC0415 (50 ms, for the commands that use a registry)

    return entry_points()


@cache
def _of_package(entry: EntryPoint) -> Part:
    place = _place_of(entry)
    with foreign_code(partial(_not_loaded, entry, place)):
        value = entry.load()
    return Part(entry.group.removeprefix("etb_hil."), entry.name, value, place)


def _place_of(entry: EntryPoint) -> Place:
    return Place(_package(entry), key=f"{entry.group}: {entry.name}")


def _not_loaded(entry: EntryPoint, place: Place, error: BaseException) -> InputError:
    what = f"the plug-in cannot be loaded: {first_line(error)}"
    remedy = f"update or uninstall {entry.dist.name if entry.dist else entry.module}"
    return InputError(Problem(what, place, entry.value, remedy=remedy))


def _package(entry: EntryPoint) -> str:
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist else entry.module


def _root(entry: EntryPoint) -> Path:
    """Return the folder or file that holds the code of an entry point's package.

    Of a namespace (a folder without `__init__`) it is the package in it, or, of a module, the whole folder.
    """
    names = entry.module.split(".")
    for end in range(1, len(names) + 1):
        spec = importlib.util.find_spec(".".join(names[:end]))
        if spec is None:
            break
        if spec.origin is not None:
            origin = Path(spec.origin)
            return origin.parent if spec.submodule_search_locations or end > 1 else origin
    return Path(entry.module)


def _digest(root: Path) -> str:
    """Return the SHA-256 of a file, or of a folder's files and their names.

    Files are Python, compiled code and data.
    """
    if root.is_file():
        return hashlib.sha256(root.read_bytes()).hexdigest()
    found = hashlib.sha256()
    for path in sorted(root.rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts:  # which hold what Python makes of the others
            found.update(os.fsencode(path.relative_to(root)) + b"\0" + path.read_bytes())
    return found.hexdigest()


_modules: dict[Path, ModuleType] = {}
_digests: dict[Path, str] = {}  # of the code of each module when it was run
_begun: set[Path] = set()


def _module(path: Path) -> ModuleType:
    """Return the module that a file is; it is run once while it is loaded."""
    if path in _modules:
        return _modules[path]
    if path in _begun:
        remedy = "import from `etb_hil.plugins` alone"
        raise InputError(Problem("the plug-in imports what needs the plug-in itself", Place(path), remedy=remedy))
    spec = importlib.util.spec_from_file_location(f"etb_hil_plugin_{path.stem}", path)
    if spec is None or spec.loader is None or not path.is_file():
        raise InputError(Problem("no such Python file", Place(path), allowed="a file NAME.py", remedy="check the path"))
    module = importlib.util.module_from_spec(spec)
    _begun.add(path)
    source = path.read_bytes()
    _digests[path] = hashlib.sha256(source).hexdigest()

    def refused(error: BaseException) -> InputError:
        what = f"the plug-in cannot be loaded: {first_line(error)}"
        return InputError(Problem(what, Place(path, _line_of(path, error)), remedy=_CHANGE))

    try:
        with foreign_code(refused):
            # The bytes of the digest: Python keeps the code of a file by its second and its size.
            exec(compile(source, path, "exec", dont_inherit=True), module.__dict__)  # noqa: S102
    finally:
        _begun.remove(path)
    _modules[path] = module
    return module


def _loaded_digest(path: Path) -> str:
    """Return the SHA-256 of the code that runs, whatever the file holds by now."""
    _module(path)
    return _digests[path]


def _forget_file(path: Path) -> None:
    """Have a file run again when it is next loaded: it may be edited until then."""
    _modules.pop(path, None)


def _line_of(path: Path, error: BaseException) -> int | None:
    """Return the line of a file that an error comes from, or None."""
    if isinstance(error, SyntaxError):
        return error.lineno
    lines = [line for frame, line in walk_tb(error.__traceback__) if frame.f_code.co_filename == str(path)]
    return lines[-1] if lines else None


def _version(path: Path) -> str:
    return str(getattr(_module(path), "__version__", ""))


def missing(recorded: tuple[Plugin, ...]) -> tuple[str, ...]:
    """Return, in sentences, which plug-ins of a record are missing or differ."""
    here: Mapping[str, Plugin] = {one.name: one for one in plugins()}
    said = []
    for one in recorded:
        name = f"{one.name} {one.version}".strip()
        if one.name not in here:
            said.append(f"the plug-in {name} took part in the run and is not here ({', '.join(one.parts)})")
        elif here[one.name] != one:
            said.append(f"the plug-in {name} was changed since the run")
    return tuple(said)
