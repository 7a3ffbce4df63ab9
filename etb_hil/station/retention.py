"""Which sessions have been kept for as long as they have to be."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from etb_hil.base.clock import stored_time
from etb_hil.base.errors import InputError
from etb_hil.base.outcome import UnitVerdict
from etb_hil.session.session import MANIFEST, open_session
from etb_hil.station.station_file import Retention


@dataclass(frozen=True, slots=True)
class Expired:
    """A session that need not be kept, its age in s, and how many bytes it holds."""

    folder: Path
    age: float
    size: int


def expired(folder: Path, rules: Retention, in_store: Iterable[str], now: datetime) -> list[Expired]:
    """Return the sessions in a folder that are older than they must become.

    `in_store` are the ids of the runs whose numbers the store of results holds: no other session is named, and neither
    is a link, nor what is no session. A session that is stamped after now is kept.
    """
    kept = set(in_store)
    found = []
    for path in sorted(entry.parent for entry in folder.glob(f"*/{MANIFEST}")):
        if path.is_symlink():
            continue
        try:
            session = open_session(path)
            passed = session.has_results and session.read_results().unit.verdict is UnitVerdict.PASS
            age = (now - stored_time(session.started)).total_seconds()
            if session.run_id in kept and age > (rules.passed if passed else rules.other):
                size = sum(file.stat().st_size for file in path.rglob("*") if file.is_file())
                found.append(Expired(path, age, size))
        except (InputError, OSError, KeyError, TypeError, ValueError):
            continue  # damaged: for people to look at; or deleted by somebody else just now
    return found
