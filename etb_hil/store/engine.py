"""SQLAlchemy's engine of a store, over the connections that runs use as well."""

from __future__ import annotations

import sqlalchemy as sa
from sqlalchemy.pool import NullPool

from etb_hil.store.address import StoreAddress
from etb_hil.store.connection import embedded, server


def engine_of(address: StoreAddress, *, writes: bool = False) -> sa.Engine:
    """Return the engine of a store.

    One that does not write never waits for those that do.
    """
    if address.is_server:
        dialect = "postgresql+psycopg://"
        return sa.create_engine(dialect, creator=lambda: server(address, patient=True), poolclass=NullPool)
    engine = sa.create_engine("sqlite://", creator=lambda: embedded(address), poolclass=NullPool)

    @sa.event.listens_for(engine, "begin")
    def _begin(connection: sa.Connection) -> None:
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine
