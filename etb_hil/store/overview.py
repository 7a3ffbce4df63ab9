"""Overview of a store for a page, without statistics.

The latest runs, what they measured, and a value over time.
"""

from __future__ import annotations

from typing import Any

import sqlalchemy as sa

from etb_hil.store.address import StoreAddress
from etb_hil.store.reading import joined_runs, reading
from etb_hil.store.schema import measurements, runs
from etb_hil.store.selection import EVERYTHING, Selection

RUN_COLUMNS = (
    "run_id", "started", "serial", "part_number", "revision", "scenario", "bench", "bench_outcome", "verdict",
    "reason",
)  # fmt: skip
_VALUE_COLUMNS = ("value", "low", "high", "limit_low", "limit_high", "unit", "verdict")


def latest_runs(address: StoreAddress, selection: Selection = EVERYTHING) -> list[dict[str, Any]]:
    """Return the selected finished runs as rows of `RUN_COLUMNS`, the latest first.

    The store may be of either kind.

    Name their number by `Selection(latest=20)`. Raises InputError where the store is missing or does not answer.
    """
    chosen = joined_runs(selection)
    query = sa.select(*(runs.c[name] for name in RUN_COLUMNS)).join(chosen, chosen.c.id == runs.c.id)
    return _rows(address, query.order_by(runs.c.started.desc(), runs.c.run_id.desc()))


def measured_ids(address: StoreAddress, selection: Selection = EVERYTHING) -> list[dict[str, Any]]:
    """Return `id` and `unit` of what the selected runs measured.

    Those with a limit come first. Raises InputError where the store is missing or does not answer.
    """
    chosen = joined_runs(selection)
    has_limit = sa.or_(measurements.c.limit_low.is_not(None), measurements.c.limit_high.is_not(None))
    query = (
        sa.select(measurements.c.id, sa.func.min(measurements.c.unit).label("unit"))
        .join(chosen, chosen.c.id == measurements.c.run)
        .group_by(measurements.c.id)
        .order_by(sa.func.max(sa.case((has_limit, 1), else_=0)).desc(), measurements.c.id)
    )
    return _rows(address, query)


def values_over_time(
    address: StoreAddress, measurement: str, selection: Selection = EVERYTHING
) -> list[dict[str, Any]]:
    """Return a measurement over the selected runs in order of time, as rows.

    Raises InputError where the store is missing or does not answer.

    A row has `run_id`, `started` (ISO 8601, UTC), `serial`, `value` with its 95 % interval `low` and `high`,
    `limit_low`, `limit_high`, `unit` (SI) and `verdict`. Runs without a value are left out.
    """
    chosen = joined_runs(selection)
    query = (
        sa.select(
            chosen.c.run_id, chosen.c.started, chosen.c.serial, *(measurements.c[name] for name in _VALUE_COLUMNS)
        )
        .join(chosen, chosen.c.id == measurements.c.run)
        .where(measurements.c.id == measurement, measurements.c.value.is_not(None))
        .order_by(chosen.c.started, chosen.c.run_id)
    )
    return _rows(address, query)


def _rows(address: StoreAddress, query: sa.Select[Any]) -> list[dict[str, Any]]:
    with reading(address) as connection:
        return [dict(row) for row in connection.execute(query).mappings()]
