"""Address of a store of results.

A file beside the sessions, or a PostgreSQL server that a lab shares.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, TypeVar

from pydantic import AfterValidator, Field

from etb_hil.base.errors import InputError, Problem

STORE = "results.db"  # the embedded store's name in a folder of sessions
QUEUE = "waiting_for_store"  # the folder beside it of runs that wait for the store
_OPEN = (f"{STORE}-wal", f"{STORE}-shm")  # what SQLite keeps beside a store that is open
SERVER = ("postgresql://", "postgres://")
Source = TypeVar("Source", str, Path, str | Path)
_PASSWORD = re.compile(r"password=|://[^/@]*:[^@]*@", re.IGNORECASE)
_REMEDY = "leave the password out; set PGPASSWORD, or name a password file in PGPASSFILE (~/.pgpass by default)"


@dataclass(frozen=True, slots=True)
class StoreAddress:
    """The address of a store.

    The address is the `path` of an SQLite file, or the `url` of a PostgreSQL database.

    The URL never holds a password: the PostgreSQL client reads it from the environment or from a password file.
    """

    path: Path = Path(STORE)
    url: str = ""

    @property
    def is_server(self) -> bool:
        """Whether a server keeps the store."""
        return bool(self.url)

    def __str__(self) -> str:
        return self.url or str(self.path)


def sessions_among(paths: Sequence[Source], *, or_store: bool = False) -> list[Source]:
    """Leave out what a store keeps beside the sessions, which `sessions/*` names, too.

    All stay where nothing else is named. `or_store`: the store itself stays as well.
    """
    others = {QUEUE, *_OPEN} if or_store else {QUEUE, *_OPEN, STORE}
    return [path for path in paths if Path(path).name not in others] or list(paths)


def _without_password(text: str) -> str:
    """Return the text that names a store.

    ValueError where it holds a password, which the message does not show.
    """
    if _PASSWORD.search(text):
        raise ValueError(f"the store's password is in its address; {_REMEDY}")
    return text


StoreText = Annotated[
    str,
    AfterValidator(_without_password),
    Field(
        min_length=1, description="store of results: a file, also beside this one, or postgresql://USER@HOST/DATABASE"
    ),
]


def store_address(text: str | Path, beside: Path | None = None) -> StoreAddress:
    """Return the address that a text names.

    A relative path starts at the folder of the file `beside`.

    Raises InputError where the URL holds a password, or is of another kind of database.
    """
    if isinstance(text, Path):
        return StoreAddress(text)
    if text.startswith(SERVER):
        try:
            _without_password(text)
        except ValueError as error:
            raise InputError(Problem(str(error))) from None
        return StoreAddress(url=text)
    if "://" in text:
        allowed = "a file, or postgresql://USER@HOST/DATABASE"
        raise InputError(Problem("no such kind of store", value=text.partition("://")[0], allowed=allowed))
    return StoreAddress((beside.parent if beside else Path()) / Path(text).expanduser())
