"""What a station expects of the unit that it is about to test."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ExpectedUnit:
    """What the station expects a unit to be (empty: anything).

    The expectation says whether codes are cleared before a run, too.
    """

    serial: str = ""
    part_number: str = ""
    software: str = ""
    clears_codes: bool = False

    def texts(self) -> dict[str, str]:
        """Return what is expected, by the names of the bench file's `identification`."""
        named = {"serial": self.serial, "part_number": self.part_number, "software": self.software}
        return {name: text for name, text in named.items() if text}
