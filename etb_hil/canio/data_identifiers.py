"""Data identifiers (DID) that stand for roles.

Where a controller sends no cyclic frame with a value, it is asked.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class DataIdentifier:
    """A value that the unit sends when it is asked.

    role value = raw number x `scale` + `offset`, in SI.

    `number` is its identifier, `length` its bytes, high byte first. Readings are `every_ns` apart. `rate` is that of
    service 0x2A (1 slow, 2 medium, 3 fast) where the unit sends it by itself, 0 where each reading is a request (0x22).
    """

    role: str
    number: int
    length: int
    signed: bool
    scale: float
    offset: float
    every_ns: int
    rate: int = 0

    @property
    def source(self) -> str:
        """The name of its samples' source."""
        return f"DID {self.number:#06x}"

    def value(self, data: bytes) -> float:
        """Return the role's value of `length` bytes."""
        return int.from_bytes(data, "big", signed=self.signed) * self.scale + self.offset

    def data(self, value: float) -> bytes:
        """Return the bytes of a role's value: the nearest that they can hold."""
        bits = 8 * self.length - self.signed
        low, high = -(1 << bits) if self.signed else 0, (1 << bits) - 1
        raw = min(max(round((value - self.offset) / self.scale), low), high)
        return raw.to_bytes(self.length, "big", signed=self.signed)


@dataclass(frozen=True, slots=True)
class RequestedValues:
    """The roles that are read by data identifier, and their frames' identifiers.

    `periodic` is the identifier of the frames that the unit sends by itself (0x2A, one value each, no ISO-TP).
    """

    request: int
    response: int
    periodic: int | None
    extended: bool
    identifiers: tuple[DataIdentifier, ...]

    def of(self, role: str) -> DataIdentifier | None:
        """Return what a role is read by, None where it is not."""
        return next((one for one in self.identifiers if one.role == role), None)
