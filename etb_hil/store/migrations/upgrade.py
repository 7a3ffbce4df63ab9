"""Make the tables of a store, or bring them up to date, by Alembic."""

from __future__ import annotations

import sqlite3
from pathlib import Path

from alembic import command
from alembic.config import Config
from sqlalchemy.exc import DBAPIError, SQLAlchemyError

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.store.address import StoreAddress
from etb_hil.store.connection import StoreDown, failure
from etb_hil.store.engine import engine_of

_LOCK = 0x657462  # "etb": the advisory lock under which one bench at a time changes a server's tables


def upgrade(address: StoreAddress) -> None:
    """Bring the tables of a store to the latest version; all of it happens or nothing.

    Raises StoreDown where the store is not reached, InputError where its tables are none that etb-hil made.
    """
    config = Config()
    config.set_main_option("script_location", str(Path(__file__).parent))
    config.set_main_option("path_separator", "os")
    engine = engine_of(address, writes=True)
    try:
        with engine.begin() as connection:
            if address.is_server:
                connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({_LOCK})")
            config.attributes["connection"] = connection
            command.upgrade(config, "head")
    except DBAPIError as error:
        if isinstance(error.orig, sqlite3.OperationalError) and "locked" not in str(error.orig):
            raise _foreign(address, str(error.orig)) from None
        raise StoreDown(failure(address, error.orig or error)) from None
    except SQLAlchemyError as error:
        raise _foreign(address, str(error)) from None
    finally:
        engine.dispose()


def _foreign(address: StoreAddress, error: str) -> InputError:
    what = f"cannot serve as the store of results: {error}"
    return InputError(Problem(what, Place(str(address)), remedy="name another store, or move the file away"))
