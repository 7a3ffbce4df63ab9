"""Which runs of a store are read."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime

from etb_hil.base.errors import InputError, Problem
from etb_hil.store.run import Run


@dataclass(frozen=True, slots=True)
class Selection:
    """Which runs are read; what is None selects nothing.

    `since` and `until` are ISO 8601 in UTC, or a beginning of it.

    `latest` limits the number of runs. `measured` are the measurements that are read with them; with `and_limited`
    those of a store to which a limit applied in any selected run, too.
    """

    part_number: str | None = None
    revision: str | None = None
    scenario: str | None = None
    serials: tuple[str, ...] | None = None
    bench: str | None = None
    since: str | None = None
    until: str | None = None
    latest: int | None = None
    measured: tuple[str, ...] | None = None
    and_limited: bool = False

    def takes(self, run: Run) -> bool:
        """Return whether a run is selected; `latest` aside."""
        wanted = (self.part_number, self.revision, self.scenario, self.bench)
        has = (run.part_number, run.revision, run.scenario, run.bench)
        if any(one is not None and one != other for one, other in zip(wanted, has, strict=True)):
            return False
        if self.serials is not None and run.serial not in self.serials:
            return False
        return (self.since or "") <= run.started and (self.until is None or run.started < self.until)


EVERYTHING = Selection()


def moment(name: str, text: str | None) -> str | None:
    """Return a time that somebody named, as the starts of runs are written.

    `name` is that of the option. InputError where the text cannot be read as a time: runs are compared with it as text,
    and are deleted by it.
    """
    if text is None:
        return None
    try:
        at = datetime.fromisoformat(text.strip())
        at = at if at.tzinfo is None else at.astimezone(UTC).replace(tzinfo=None)
    except (ValueError, OverflowError):
        allowed = "2026-11-24 or 2026-11-24T08:00, UTC where no offset follows"
        raise InputError(Problem(f"{name} must be a time", value=text, allowed=allowed)) from None
    whole, _, fraction = at.isoformat().partition(".")
    # Zeros behind a fraction would make it another text than that of a run with fewer digits.
    return f"{whole}.{fraction.rstrip('0')}" if fraction else whole
