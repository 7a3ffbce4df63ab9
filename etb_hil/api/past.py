"""Statistics of many runs: units, production and benches."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from etb_hil.api.arguments import checked
from etb_hil.base.errors import InputError, Problem

if TYPE_CHECKING:
    import pandas as pd

    from etb_hil.histories.history import History


class Table:
    """Rows of plain values by column."""

    def __init__(self, rows: Sequence[dict[str, Any]]) -> None:
        self.rows = list(rows)
        self.columns = list(rows[0]) if rows else []

    def __len__(self) -> int:
        return len(self.rows)

    def to_pandas(self) -> pd.DataFrame:
        """Return a DataFrame; InputError where pandas is not installed."""
        from etb_hil.api.recordings import library

        pandas = library("pandas")
        frame: pd.DataFrame = pandas.DataFrame(self.rows, columns=self.columns)
        return frame

    def _repr_html_(self) -> str:
        from etb_hil.api.html import table

        return table(self.columns, [list(row.values()) for row in self.rows])


@dataclass(frozen=True, slots=True)
class Histories:
    """The histories of some runs, one for each part, revision and scenario.

    `notes` say what was left out.
    """

    parts: list[History]
    notes: list[str]

    @property
    def measurements(self) -> Table:
        """A row a run, with its verdict and what was measured, as `history.csv` has it."""
        from etb_hil.histories.tables import rows

        return Table(rows(self.parts))

    def __str__(self) -> str:
        """Return the text that the command line prints."""
        from etb_hil.report.history_text import history_text

        return "\n".join([*(history_text(part, 20) for part in self.parts), *(f"note: {note}" for note in self.notes)])

    def _repr_html_(self) -> str:
        from html import escape

        return f"<pre>{escape(str(self))}</pre>"


@checked
def history(
    sources: str | Path | Iterable[str | Path] = "sessions",
    *,
    part: str | None = None,
    serial: str | None = None,
    since: str | None = None,
    until: str | None = None,
    latest: int | None = None,
) -> Histories:
    """Return the histories of runs in folders, sessions, and stores of results.

    A store on a server is named by its URL. `part` (its number) and `serial` choose runs, and so do `since` and `until`
    (UTC, as 2026-11-24 or 2026-11-24T08:00) and the `latest` so many.
    Raises InputError where a source is none of these or holds no finished run, where `since`, `until` or `latest` is
    invalid, or scipy is not installed.
    """
    from etb_hil.api.recordings import library

    library("scipy", "pip install 'etb-hil[history]'")
    from etb_hil.base.collector import collector_paused
    from etb_hil.histories.history import FRICTION, histories
    from etb_hil.histories.runs import read_runs
    from etb_hil.store.address import sessions_among, store_address
    from etb_hil.store.run import TEMPERATURE
    from etb_hil.store.selection import Selection, moment

    if latest is not None and latest < 1:
        raise InputError(Problem("latest must be 1 or more", value=latest))
    named = [sources] if isinstance(sources, str | Path) else [*sources]
    places = [store_address(one) for one in sessions_among(named, or_store=True)]
    serials = None if serial is None else (serial,)
    selection = Selection(
        part,
        serials=serials,
        since=moment("since", since),
        until=moment("until", until),
        latest=latest,
        measured=(*FRICTION, TEMPERATURE),
        and_limited=True,
    )
    with collector_paused():
        runs, notes = read_runs(places, selection)
        given = {"part": part, "serial": serial, "since": since, "until": until}
        chosen = ", ".join(f"{name} {value!r}" for name, value in given.items() if value is not None)
        if not runs and chosen:
            remedy = "choose others, or leave the choice out"
            raise InputError(Problem(f"there is no finished run of {chosen} in the sources", remedy=remedy))
        return Histories(histories(runs), notes)
