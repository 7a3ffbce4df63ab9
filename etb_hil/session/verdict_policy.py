"""When a verdict is withheld.

On data that the bench did not get, or that cannot be true, nothing is said of a unit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from etb_hil.base.outcome import UnitVerdict
from etb_hil.canio.dbc.protection import Profile
from etb_hil.diagnosis.result import DiagnosisResult, Reason

if TYPE_CHECKING:
    from etb_hil.canio.dbc.decoder import MessageStatistics
    from etb_hil.canio.dbc.dialect import Dialect

UNSEEN = 0.1  # wrong frames that may have passed their CRC, in expectation: a run in ten (docs/reference/faults.md)
_CRC_BITS = {Profile.PROFILE_2: 8, Profile.PROFILE_5: 16}


def corruption_doubts(statistics: Mapping[str, MessageStatistics], dialect: Dialect) -> list[Reason]:
    """Return the messages of which a corrupted frame may have passed its CRC.

    They are those of which so many other frames failed it.
    """
    found = []
    for message in dialect.messages:
        counted = statistics[message.name]
        if message.commanded or not counted.crc_failures:
            continue
        bits = _CRC_BITS[message.protection.profile]
        unseen = counted.crc_failures / 2.0**bits
        if unseen > UNSEEN:
            text = (
                f"{counted.crc_failures} frames of {message.name} failed their CRC of {bits} bits; "
                f"{unseen:.1f} wrong ones may have passed it"
            )
            found.append(Reason("frames_corrupted", text))
    return found


def withheld(result: DiagnosisResult, doubts: Sequence[Reason]) -> DiagnosisResult:
    """Return the result, inconclusive where there are doubts.

    They then stand before its own reasons.
    """
    if not doubts:
        return result
    return replace(result, verdict=UnitVerdict.INCONCLUSIVE, reasons=(*doubts, *result.reasons))
