"""Runs out of a store: those of a part, a unit or a time, the latest first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import sqlalchemy as sa
from sqlalchemy.exc import DBAPIError, SQLAlchemyError

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.store.address import STORE, StoreAddress
from etb_hil.store.connection import failure, require_schema, require_store
from etb_hil.store.engine import engine_of
from etb_hil.store.run import OF_RUN, VALUES, Run, Values, run_of
from etb_hil.store.schema import measurements, runs
from etb_hil.store.selection import EVERYTHING, Selection


def read_store(address: StoreAddress, selection: Selection = EVERYTHING) -> list[Run]:
    """Return the finished runs of a store in order of time.

    Raises InputError where it is no store, cannot be reached, or holds an outcome that no run writes. An embedded store
    of an earlier version is brought up to date first.
    """
    chosen = chosen_runs(selection)
    numbers: dict[int, dict[str, Values]] = {}
    with reading(address) as connection:
        try:
            entries = connection.execute(chosen).fetchall()
            for run, name, *values in _measured(connection, joined_runs(selection), selection):
                numbers.setdefault(run, {})[name] = (*values,)
            return [_run(entry, numbers.get(entry[0], {})) for entry in reversed(entries)]
        except TypeError as error:
            raise _no_store(address, str(error)) from None
        except InputError as error:
            file = str(address)
            named = (replace(one, place=replace(one.place or Place(), file=file)) for one in error.problems)
            raise InputError(*named) from None


def known_runs(address: StoreAddress) -> set[str]:
    """Return the ids of all finished runs of a store; InputError as `read_store`."""
    with reading(address) as connection:
        return set(connection.scalars(sa.select(runs.c.run_id).where(runs.c.bench_outcome.is_not(None))))


@contextmanager
def reading(address: StoreAddress) -> Iterator[sa.Connection]:
    """Yield a connection that reads.

    InputError where the store cannot be reached, or is none.
    """
    with opened(address) as engine, engine.connect() as connection:
        yield connection


@contextmanager
def opened(address: StoreAddress, *, writes: bool = False) -> Iterator[sa.Engine]:
    """Yield the engine of a store that exists.

    InputError where it cannot be reached, or is none.
    """
    require_store(address)
    engine = engine_of(address, writes=writes)
    try:
        require_schema(address)
        yield engine
    except ConnectionError as error:  # StoreDown
        raise _no_store(address, str(error)) from None
    except DBAPIError as error:
        raise _no_store(address, failure(address, error.orig or error)) from None
    except (SQLAlchemyError, UnicodeDecodeError) as error:
        raise _no_store(address, str(error)) from None
    finally:
        engine.dispose()


def _run(entry: Any, numbers: dict[str, Values]) -> Run:  # noqa: ANN401 (a row)
    return run_of(entry[1:5], entry[5:8], (*entry[8:10], entry[10] or ""), numbers)


def _measured(connection: sa.Connection, ids: sa.Subquery, selection: Selection) -> Iterator[Sequence[Any]]:
    """Yield run, id and `VALUES` of what some runs measured, as far as it is selected.

    What has a limit is found on the way: to ask for the ids that have one first reads every measurement twice.
    """
    of, limits = measurements.c, (measurements.c.limit_low, measurements.c.limit_high)
    found = sa.select(of.run, of.id, *(of[name] for name in VALUES)).join(ids, ids.c.id == of.run)
    if selection.measured is None:
        yield from connection.execute(found).fetchall()
        return
    is_wanted, limited = of.id.in_(selection.measured), set()
    has_limit = sa.or_(*(limit.is_not(None) for limit in limits)) if selection.and_limited else sa.false()
    for row in connection.execute(found.where(sa.or_(is_wanted, has_limit))).fetchall():
        limited.add(row[1])
        yield row
    if others := sorted(limited - {*selection.measured}):  # in other runs these may have no limit
        without = sa.and_(of.id.in_(others), *(limit.is_(None) for limit in limits))
        yield from connection.execute(found.where(without)).fetchall()


def chosen_runs(selection: Selection) -> sa.Select[Any]:
    """Return the query for id and columns of the selected runs, the latest first."""
    query = sa.select(runs.c.id, *(runs.c[name] for name in OF_RUN)).where(runs.c.bench_outcome.is_not(None))
    for name in ("part_number", "revision", "scenario", "bench"):
        if (wanted := getattr(selection, name)) is not None:
            query = query.where(runs.c[name] == wanted)
    if selection.serials is not None:
        query = query.where(runs.c.serial.in_(selection.serials))
    if selection.since is not None:
        query = query.where(runs.c.started >= selection.since)
    if selection.until is not None:
        query = query.where(runs.c.started < selection.until)
    query = query.order_by(runs.c.started.desc(), runs.c.run_id.desc())
    return query if selection.latest is None else query.limit(selection.latest)


def joined_runs(selection: Selection) -> sa.Subquery:
    """Return the selected runs as `chosen_runs`, to be joined with what is theirs.

    In no order unless the latest are chosen by it: PostgreSQL sorts first, and then reads all of the other table.
    """
    query = chosen_runs(selection)
    return (query.order_by(None) if selection.latest is None else query).subquery()


def _no_store(address: StoreAddress, error: str) -> InputError:
    allowed = "a store that answers" if address.is_server else f"a {STORE} that runs have written"
    return InputError(Problem(f"must be a store of results: {error}", Place(str(address)), allowed=allowed))
