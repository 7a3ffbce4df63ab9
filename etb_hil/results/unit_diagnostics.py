"""What the unit's own diagnostics (UDS) report.

They are the identity, trouble codes before and after the scenario, and routines.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntFlag
from typing import Any

from etb_hil.base.stated_types import of_stated_types


class CodeStatus(IntFlag):
    """Status bits of a trouble code (ISO 14229-1, annex D)."""

    TEST_FAILED = 0x01
    FAILED_THIS_CYCLE = 0x02
    PENDING = 0x04
    CONFIRMED = 0x08
    NOT_TESTED_SINCE_CLEAR = 0x10
    FAILED_SINCE_CLEAR = 0x20
    NOT_TESTED_THIS_CYCLE = 0x40
    WARNING_INDICATOR = 0x80


@dataclass(frozen=True, slots=True)
class Identity:
    """A text by which the unit says what it is, and what the station expects.

    An empty expectation allows anything.
    """

    name: str
    identifier: int
    value: str
    expected: str = ""


@dataclass(frozen=True, slots=True)
class TroubleCode:
    """A trouble code: its name (SAE J2012), failure type, status and meaning.

    `status` holds the bits of `CodeStatus`.
    """

    code: str
    failure_type: int
    status: int
    text: str = ""

    @property
    def is_failing(self) -> bool:
        """Whether its test failed when it was last run."""
        return bool(self.status & CodeStatus.TEST_FAILED)


@dataclass(frozen=True, slots=True)
class RoutineRun:
    """A routine that the bench ran `before` or `after` the scenario.

    The result says what came of it.
    """

    name: str
    when: str
    outcome: str
    start_s: float
    end_s: float


@dataclass(frozen=True, slots=True)
class UnitDiagnostics:
    """All that was read of the unit; codes are None where they were not read.

    `codes_left` are those that the unit reports right after they were `cleared`: what causes them is there.
    """

    identity: tuple[Identity, ...] = ()
    codes_before: tuple[TroubleCode, ...] | None = None
    codes_after: tuple[TroubleCode, ...] | None = None
    cleared: bool = False
    routines: tuple[RoutineRun, ...] = ()
    codes_left: tuple[TroubleCode, ...] | None = None


def diagnostics_from(plain: Mapping[str, Any]) -> UnitDiagnostics:
    """Return what `dataclasses.asdict` made plain.

    KeyError, TypeError or ValueError where it is damaged.
    """
    before, after, left = (
        None if plain.get(key) is None else tuple(of_stated_types(TroubleCode(**code)) for code in plain[key])
        for key in ("codes_before", "codes_after", "codes_left")
    )
    return UnitDiagnostics(
        tuple(of_stated_types(Identity(**one)) for one in plain["identity"]),
        before,
        after,
        bool(plain["cleared"]),
        tuple(of_stated_types(RoutineRun(**one)) for one in plain["routines"]),
        left,
    )
