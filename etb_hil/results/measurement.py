"""A measured value with its limits, and the measurements of a run by id."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from etb_hil.base.outcome import UnitVerdict
from etb_hil.results import shown

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler
    from pydantic_core import CoreSchema


@dataclass(frozen=True, slots=True)
class Measurement:
    """A measured value in SI with its 95 % interval, its limits and its verdict.

    What is unknown is None. With `high` and no `value`, it is at most `high`.

    `low` and `high` bound the interval, `limit_low` and `limit_high` are what is allowed. `verdict` is None where no
    limit applies. `note` says under which conditions the value holds.
    """

    id: str
    name: str
    value: float | None
    unit: str
    low: float | None = None
    high: float | None = None
    limit_low: float | None = None
    limit_high: float | None = None
    verdict: UnitVerdict | None = None
    note: str = ""

    @property
    def interval(self) -> tuple[float, float] | None:
        """The 95 % interval in SI, or None where the value has none."""
        return None if self.low is None or self.high is None else (self.low, self.high)

    @property
    def is_bound(self) -> bool:
        """Whether the value is known to be at most `high`, and no more."""
        return self.value is None and self.high is not None

    @property
    def value_or_bound(self) -> float | None:
        """The value in SI, or what it is at most where the run bounds it."""
        return self.high if self.value is None else self.value

    @property
    def is_known(self) -> bool:
        """Whether the value was measured, or bounded."""
        return self.value is not None or self.is_bound

    @property
    def is_judged(self) -> bool:
        """Whether a limit applies to the value."""
        return self.verdict is not None


class Measurements(Mapping[str, Measurement]):
    """The measurements of a run by their ids, in the order in which people read them."""

    __slots__ = ("_by_id",)

    def __init__(self, measurements: Iterable[Measurement] = ()) -> None:
        """Take measurements; ValueError where two have the same id."""
        self._by_id: dict[str, Measurement] = {}
        for one in measurements:
            if one.id in self._by_id:
                raise ValueError(f"two measurements have the id '{one.id}'")
            self._by_id[one.id] = one

    def __getitem__(self, measurement_id: str) -> Measurement:
        return self._by_id[measurement_id]

    def __iter__(self) -> Iterator[str]:
        return iter(self._by_id)

    def __len__(self) -> int:
        return len(self._by_id)

    def __repr__(self) -> str:
        """Return a line for each: id, name, value, limit and verdict.

        Values with their intervals are in the units that people read.
        """
        named = [(one, one.name if shown.says_more(one.id, one.name) else "") for one in self.values()]
        rows = [(one.id, name, *shown.in_words(one)) for one, name in named]
        widths = [max((len(row[k]) for row in rows), default=0) for k in range(4)]
        lines = ["  ".join(text.ljust(width) for text, width in zip(row, (*widths, 0), strict=True)) for row in rows]
        return "\n".join([f"Measurements: {len(rows)}", *(f"  {line}".rstrip() for line in lines)])

    def value(self, measurement_id: str) -> float | None:
        """Return the value of a measurement in SI, or None where the run has none."""
        found = self._by_id.get(measurement_id)
        return None if found is None else found.value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Measurements) and self._by_id == other._by_id

    __hash__ = None  # type: ignore[assignment]

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:  # noqa: ANN401
        """Describe the measurements as a list, which is what `results.json` holds."""
        from pydantic_core import core_schema  # noqa: PLC0415 (only who reads or writes the file needs it)

        listed = handler.generate_schema(tuple[Measurement, ...])
        return core_schema.no_info_before_validator_function(
            lambda value: tuple(value.values()) if isinstance(value, cls) else value,
            core_schema.no_info_after_validator_function(cls, listed),
            serialization=core_schema.plain_serializer_function_ser_schema(
                lambda value: tuple(value.values()), return_schema=listed
            ),
        )
