"""Where the project's own files are: in a checkout, and in a wheel."""

from __future__ import annotations

from pathlib import Path

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.nearest import did_you_mean

_PACKAGE = Path(__file__).resolve().parent.parent
_STOCK = _PACKAGE / "stock"
_CHECKOUT = _PACKAGE.parent

# dbc/ and scenarios/ stand at the top of a checkout and inside the package of a wheel.
_FOLDERS = {
    "model": (_STOCK / "models", ".yaml"),
    "bench": (_STOCK / "benches", ".yaml"),
    "limits": (_STOCK / "limits", ".yaml"),
    "scenario": (_STOCK / "scenarios" if (_STOCK / "scenarios").is_dir() else _CHECKOUT / "scenarios", ".yaml"),
    "dbc": (_STOCK / "dbc" if (_STOCK / "dbc").is_dir() else _CHECKOUT / "dbc", ".dbc"),
}


def own_folders() -> set[Path]:
    """Return the folders that hold the package's code and its stock files."""
    return {_PACKAGE, *(folder for folder, _ in _FOLDERS.values())}


def stock_names(kind: str) -> list[str]:
    """Return the names of a kind's stock files.

    The kind is model, bench, limits, scenario or dbc.
    """
    return [*stock_files(kind)]


def stock_files(kind: str) -> dict[str, Path]:
    """Return the paths of a kind's stock files by name, sorted.

    Unlike `find`, whatever lies in the current folder.
    """
    folder, suffix = _FOLDERS[kind]
    return {path.stem: path for path in sorted(folder.glob(f"*{suffix}"))}


def stock_file(kind: str, name: str) -> Path:
    """Return the path of a stock file, whatever lies in the current folder."""
    return stock_files(kind)[name]


def find(kind: str, name: str, beside: Path | None = None) -> Path:
    """Return the path of a file given by path or by the name of a stock file.

    A path may also start beside another file. A stock file that names another one means a stock file.

    Raises InputError that lists the stock names where there is no such file.
    """
    given = Path(name)
    folder, suffix = _FOLDERS[kind]
    stock = folder / f"{given.name.removesuffix(suffix)}{suffix}"
    is_stock = given.name == str(given) and _is_file(stock)
    if is_stock and beside is not None and beside.resolve().parent in own_folders():
        return stock
    if _is_file(given):
        return given
    if beside is not None and _is_file(beside.parent / given):
        return beside.parent / given
    if is_stock:
        return stock
    if _is_folder(given):
        inside = next((path for path in sorted(given.glob(f"*{suffix}")) if kind in path.name), None)
        remedy = f"did you mean '{inside}'?" if inside else f"name the {kind} file in it"
        raise InputError(Problem(f"is a folder, no {kind} file", Place(given), remedy=remedy))
    raise InputError(
        Problem(
            f"no {kind} file '{name if len(name) <= 200 else name[:200] + '...'}'",
            allowed=f"a path, or one of: {', '.join(stock_names(kind))}",
            remedy=did_you_mean(given.stem, stock_names(kind), "check the spelling and the folder you are in"),
        )
    )


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:
        return False


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a name that is too long, or a folder that is closed to us
        return False
