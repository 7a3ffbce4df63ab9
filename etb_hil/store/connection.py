"""Connections to a store, by the driver alone.

A run adds its rows without the time that SQLAlchemy takes to load.
"""

from __future__ import annotations

import logging
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from typing import TYPE_CHECKING, Any

from etb_hil.base.errors import EtbHilError, InputError, Place, Problem
from etb_hil.base.userfile import require_file
from etb_hil.store.address import STORE

if TYPE_CHECKING:
    from etb_hil.store.address import StoreAddress

HEAD = "0001"  # the schema that this program writes: the latest in `migrations/versions`
PATIENCE_S = 30.0  # how long a writer waits for those that have a file locked
_CONNECT_S = 3  # until a server that does not answer counts as down
_STATEMENT_MS = 10_000
_CUT_MS = 5_000  # until a connection without any answer counts as cut


class StoreDown(EtbHilError, ConnectionError):
    """The store cannot be reached or written now; what waits for it is kept."""


@contextmanager
def connected(address: StoreAddress, *, patient: bool = False) -> Iterator[Any]:
    """Yield a connection of the database's driver; it is closed at the end.

    Its statements run in transactions.

    A `patient` one waits for slow statements. Raises StoreDown where the store cannot be reached, or fails on the way;
    InputError where the file is no database, or the driver is not installed.
    """
    failures = _driver(address).Error
    connection: Any = None
    try:
        connection = server(address, patient=patient) if address.is_server else embedded(address)
        yield connection
        connection.commit()
    except (failures, UnicodeDecodeError) as error:  # of a damaged file SQLite's message may not be text
        raise _refused(address, error) from None
    finally:
        if connection is not None:
            with suppress(failures):
                connection.close()


def require_store(address: StoreAddress) -> None:
    """Raise InputError where an embedded store's file is none that etb-hil made.

    The file stays as it is.
    """
    if address.is_server:
        return
    require_file(address.path)
    why = "it has no runs"
    try:
        with closing(sqlite3.connect(f"{address.path.resolve().as_uri()}?mode=ro", uri=True)) as file:
            if file.execute("SELECT 1 FROM sqlite_master WHERE name = 'runs'").fetchone():
                return
    except (sqlite3.Error, UnicodeDecodeError) as error:  # of a damaged file SQLite's message may not be text
        why = str(error)
    allowed = f"a {STORE} that runs have written"
    raise InputError(Problem(f"must be a store of results: {why}", Place(address.path), allowed=allowed))


def mark(address: StoreAddress) -> str:
    """Return what stands for a value in statements."""
    return "%s" if address.is_server else "?"


def begin(address: StoreAddress, connection: Any) -> None:  # noqa: ANN401 (of two drivers)
    """Begin a transaction that writes.

    The server's driver begins one with the first statement.
    """
    if not address.is_server:
        connection.execute("BEGIN IMMEDIATE")


def schema_version(address: StoreAddress, connection: Any) -> str:  # noqa: ANN401
    """Return the revision of a store's tables.

    The revision is empty where there are none, or those of the first version. InputError where its name is missing.
    """
    known = "to_regclass('alembic_version') IS NOT NULL"
    if not address.is_server:
        known = "EXISTS (SELECT 1 FROM sqlite_master WHERE name = 'alembic_version')"
    if not connection.execute(f"SELECT {known}").fetchone()[0]:
        return ""
    row = connection.execute("SELECT version_num FROM alembic_version").fetchone()
    if row and not row[0]:
        what = f"must be a store of results: the revision of its tables is {row[0]!r}"
        raise InputError(Problem(what, Place(str(address)), remedy="name another store"))
    return str(row[0]) if row else ""


def require_schema(address: StoreAddress) -> None:
    """Make the tables of a store, or bring them up to date.

    InputError where a later version wrote them.
    """
    with up_to_date(address):
        pass


@contextmanager
def up_to_date(address: StoreAddress) -> Iterator[Any]:
    """Yield a connection to a store that has this version's tables.

    The connection is what `connected` and `require_schema` give.

    One connection asks for the version and then serves: each further one costs a server some milliseconds.
    """
    with connected(address) as connection:
        version = schema_version(address, connection)
        if version == HEAD:
            yield connection
            return
    _upgrade(address, version)
    with connected(address) as connection:
        yield connection


def _upgrade(address: StoreAddress, version: str) -> None:
    allowed = f"up to {HEAD}"
    if version > HEAD:
        remedy = "update etb-hil, or name another store"
        what = "the store was written by a later version of etb-hil"
        raise InputError(Problem(what, Place(str(address)), version, allowed, remedy))
    from alembic.util import CommandError  # noqa: PLC0415 (Alembic is slow to load, and rarely needed)

    from etb_hil.store.migrations.upgrade import upgrade  # noqa: PLC0415

    try:
        upgrade(address)
    except CommandError as error:  # a revision that no release wrote
        what = f"must be a store of results: {error}"
        raise InputError(Problem(what, Place(str(address)), version, allowed, "name another store")) from None


def failure(address: StoreAddress, error: Exception) -> str:
    """Return in one line what went wrong with a store."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return f"{address}: {'; '.join(lines[:2])}"


def _driver(address: StoreAddress) -> Any:  # noqa: ANN401 (a module)
    if not address.is_server:
        return sqlite3
    try:
        import psycopg  # noqa: PLC0415 (an extra)
    except ImportError:
        raise InputError(
            Problem("the driver of PostgreSQL is not installed", remedy="pip install 'etb-hil[store]'")
        ) from None
    logging.getLogger("psycopg").setLevel(logging.CRITICAL)  # what it logs of a cut connection, it raises as well
    return psycopg


def embedded(address: StoreAddress) -> sqlite3.Connection:
    """Return a connection to an embedded store, made where it is missing.

    Its transactions begin by statement.
    """
    connection = sqlite3.connect(address.path, timeout=PATIENCE_S, isolation_level=None)
    connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("PRAGMA synchronous = FULL")  # a run leaves the queue once it is here
    connection.execute("PRAGMA foreign_keys = ON")
    return connection


def server(address: StoreAddress, *, patient: bool) -> Any:  # noqa: ANN401
    """Return a connection to a server.

    One that is not `patient` gives slow statements up.
    """
    limits = "" if patient else f"-c statement_timeout={_STATEMENT_MS} -c lock_timeout={_STATEMENT_MS}"
    return _driver(address).connect(
        address.url,
        connect_timeout=_CONNECT_S,
        application_name="etb-hil",
        options=limits,
        keepalives_idle=5,
        tcp_user_timeout=_CUT_MS,
    )


def _refused(address: StoreAddress, error: Exception) -> EtbHilError:
    is_damaged = isinstance(error, sqlite3.DatabaseError | UnicodeDecodeError)
    if is_damaged and not isinstance(error, sqlite3.OperationalError):
        remedy = "move the file away"
        return InputError(Problem(f"cannot serve as the store of results: {error}", Place(address.path), remedy=remedy))
    return StoreDown(failure(address, error))
