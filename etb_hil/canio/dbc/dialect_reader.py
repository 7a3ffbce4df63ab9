"""Read a DBC file and a bench file's roles into a dialect.

All that is wrong with them is found.
"""

from __future__ import annotations

import difflib
from dataclasses import replace
from typing import TYPE_CHECKING

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.quantity import dimension_of_unit, tidy_unit, to_si, unit_meant
from etb_hil.base.roles import ROLES
from etb_hil.canio.dbc.dbc_file import load_dbc
from etb_hil.canio.dbc.dialect_message import DialectMessage, RoleColumn, SampleCounter
from etb_hil.canio.dbc.protection import UNPROTECTED, Profile, Protection
from etb_hil.canio.dbc.signal_layout import SignalLayout

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from pathlib import Path

    from cantools.database.can import Database, Message, Signal

    from etb_hil.canio.dbc.role_map import ProtectionSettings, RoleMap, RoleSignal

    Where = Callable[..., Place]

SAMPLE_COUNTER = "sample_counter"


def read_dialect(
    path: Path, roles: RoleMap, protection: ProtectionSettings, id_offset: int, where: Where
) -> tuple[DialectMessage, ...]:
    """Return the messages that carry roles; InputError with every problem found."""
    reader = _Reader(load_dbc(path), path, where)
    messages = reader.messages(roles, protection, id_offset)
    if reader.problems:
        # The place is that of the bench file's key; what it does not fit is the DBC file, which may be the wrong one.
        raise InputError(
            *(p if path.name in str(p) else replace(p, what=f"{p.what} (DBC: {path.name})") for p in reader.problems)
        )
    return messages


class _Reader:
    def __init__(self, database: Database, path: Path, where: Where) -> None:
        self._database = database
        self._path = path
        self._where = where
        self.problems: list[Problem] = []

    def messages(self, roles: RoleMap, protection: ProtectionSettings, id_offset: int) -> tuple[DialectMessage, ...]:
        chosen: dict[str, list[tuple[str, RoleSignal, Place]]] = {}
        for role, signals in roles.items():
            for index, entry in enumerate(signals):
                place = self._where("roles", role) if len(signals) == 1 else self._where("roles", role, index)
                if self._exists(entry, place):
                    chosen.setdefault(entry.message, []).append((role, entry, place))
        found = [
            self._message(message, chosen[message.name], protection, id_offset)
            for message in self._database.messages
            if message.name in chosen and self._is_plain(message, chosen[message.name][0][2])
        ]
        self._check_names(protection)
        self._check_clock(found)
        return tuple(found)

    def _is_plain(self, message: Message, place: Place) -> bool:
        """Return whether the message and its signals are there once.

        Else nobody knows which of them is meant.
        """
        for kind, names, twice in (
            ("message", [other.name for other in self._database.messages], message.name),
            *(("signal", [s.name for s in message.signals], signal.name) for signal in message.signals),
        ):
            if names.count(twice) > 1:
                what = f"{self._path.name} has more than one {kind} of this name"
                name = twice if kind == "message" else f"{message.name}.{twice}"
                problem = Problem(what, place, name, remedy="take the wrong one out of the DBC file")
                self.problems += [] if problem in self.problems else [problem]
                return False
        return True

    def _exists(self, entry: RoleSignal, place: Place) -> bool:
        names = {message.name: message for message in self._database.messages}
        if entry.message not in names:
            self._unknown("message", entry.message, names, place)
            return False
        signals = {signal.name for signal in names[entry.message].signals}
        wanted = [*entry.names, *([entry.turns.rsplit(".", 1)[-1]] if entry.turns else [])]
        missing = [name for name in wanted if name not in signals]
        for name in missing:
            self._unknown("signal", f"{entry.message}.{name}", {f"{entry.message}.{s}" for s in signals}, place)
        return not missing

    def _unknown(self, kind: str, name: str, names: Iterable[str], place: Place) -> None:
        near = difflib.get_close_matches(name, names, n=3)
        remedy = f"did you mean {' or '.join(near)}?" if near else "look the name up in the DBC file"
        self.problems.append(Problem(f"{self._path.name} has no {kind} of this name", place, name, remedy=remedy))

    def _message(
        self,
        message: Message,
        entries: list[tuple[str, RoleSignal, Place]],
        protection: ProtectionSettings,
        id_offset: int,
    ) -> DialectMessage:
        place = entries[0][2]
        limit = (1 << (29 if message.is_extended_frame else 11)) - 1
        used = {name for _, entry, _ in entries for name in entry.names}
        try:
            SignalLayout(message, sorted(used))
        except InputError as error:
            self.problems += error.problems
        if not 0 <= message.frame_id + id_offset <= limit:
            self.problems.append(
                Problem(
                    f"the offset moves {message.name} out of the arbitration ids",
                    self._where("id_offset"),
                    f"{message.frame_id:#x} + {id_offset:#x}",
                    f"0 to {limit:#x}",
                    "choose another offset",
                )
            )
        samples = max(len(entry.names) for _, entry, _ in entries)
        columns = []
        for role, entry, at in entries:
            if role == SAMPLE_COUNTER:
                continue
            if len(entry.names) not in (1, samples):
                allowed = f"1 or {samples} signals, as the message's other roles have"
                self.problems.append(Problem("bursts of one message differ in length", at, len(entry.names), allowed))
            columns.append(self._column(role, entry, message, at))
        counters = [(entry, at) for role, entry, at in entries if role == SAMPLE_COUNTER]
        counter = self._counter(*counters[0], message) if counters else None
        if samples > 1 and counter is None:
            self.problems.append(
                Problem(
                    f"{message.name} holds {samples} samples and no sample counter says when they were taken",
                    place,
                    remedy="give one of its signals the role sample_counter",
                )
            )
        return DialectMessage(
            message.name,
            message,
            message.frame_id + id_offset,
            bool(message.is_extended_frame),
            bool(message.is_fd),
            bool(message.is_fd) and _attribute(message, "CANFD_BRS") == "1",
            message.length,
            self._protection(message, protection),
            tuple(columns),
            counter,
            samples,
            round(float(message.cycle_time or 0) * 1e6),
        )

    def _column(self, role: str, entry: RoleSignal, message: Message, place: Place) -> RoleColumn:
        signals = [message.get_signal_by_name(name) for name in entry.names]
        if entry.scale is None:
            self._check_unit(role, signals[0], place)
        turns = entry.turns.rsplit(".", 1)[-1] if entry.turns else None
        scale = 1.0 if entry.scale is None else entry.scale
        return RoleColumn(role, entry.names, scale, entry.offset, entry.wraps or turns is not None, turns)

    def _check_unit(self, role: str, signal: Signal, place: Place) -> None:
        wanted, unit = ROLES[role].unit, unit_meant(signal.unit or "")
        dimension = dimension_of_unit(unit)
        if not unit or unit == tidy_unit(wanted):
            return
        if dimension is not None and dimension_of_unit(wanted) == dimension:
            factor, zero = to_si(1.0, unit, dimension) - to_si(0.0, unit, dimension), to_si(0.0, unit, dimension)
            remedy = f"write 'scale: {factor:.12g}'" + (f" and 'offset: {zero:.12g}'" if zero else "")
        else:
            remedy = f"write the scale that makes it {wanted}, or choose another signal"
        self.problems.append(
            Problem(f"the role '{role}' is in {wanted}, the signal in another unit", place, signal.unit, wanted, remedy)
        )

    def _counter(self, entry: RoleSignal, place: Place, message: Message) -> SampleCounter | None:
        signal = message.get_signal_by_name(entry.names[0])
        attribute = signal.dbc.attributes.get("SampleTickNs") if signal.dbc else None
        tick_ns = round(entry.tick * 1e9) if entry.tick is not None else int(attribute.value) if attribute else 0
        if tick_ns <= 0:
            remedy = "write it beside the signal, such as 'tick: 50 us', or give it the attribute SampleTickNs"
            self.problems.append(
                Problem("the time from count to count of the sample counter is missing", place, remedy=remedy)
            )
            return None
        if not 4 <= signal.length <= 32 or signal.is_float or signal.is_signed:
            allowed = "an unsigned integer of 4 to 32 bits"
            self.problems.append(
                Problem("a sample counter must be an integer", place, entry.signal, allowed, "choose another signal")
            )
        return SampleCounter(signal.name, signal.length, tick_ns)

    def _protection(self, message: Message, settings: ProtectionSettings) -> Protection:
        if message.name in settings:
            chosen = settings[message.name].protection()
        else:
            text, profile = (
                str(_attribute(message, "E2EDataIds") or ""),
                str(_attribute(message, "E2EProfile") or "none"),
            )
            try:
                ids = tuple(int(part, 0) for part in text.split(",") if part.strip())
                chosen = Protection(Profile(int(profile)), ids) if profile != "none" else UNPROTECTED
            except ValueError as error:
                place = Place(self._path, key=message.name)
                remedy = "correct the attributes E2EProfile and E2EDataIds, or say it in the bench file"
                self.problems.append(
                    Problem(f"its end-to-end protection cannot be read: {error}", place, remedy=remedy)
                )
                chosen = UNPROTECTED
        if message.length < chosen.header:
            place = self._where("protection", message.name)
            self.problems.append(
                Problem(
                    "the message is too short for its protection",
                    place,
                    message.length,
                    f"{chosen.header} bytes or more",
                )
            )
        return chosen

    def _check_names(self, protection: ProtectionSettings) -> None:
        names = {message.name for message in self._database.messages}
        for name in protection:
            if name not in names:
                self._unknown("message", name, names, self._where("protection", name))

    def _check_clock(self, messages: list[DialectMessage]) -> None:
        ticks = {m.counter.tick_ns for m in messages if m.counter is not None}
        if len(ticks) > 1:
            self.problems.append(
                Problem(
                    "the sample counters do not count the same clock",
                    self._where("roles", SAMPLE_COUNTER),
                    ", ".join(f"{tick} ns" for tick in sorted(ticks)),
                    "one tick for all messages",
                    "map the counters of one clock only",
                )
            )


def _attribute(message: Message, name: str) -> object:
    """Return a message's attribute, enumerations as their text.

    None where the file does not define it.
    """
    attributes = message.dbc.attributes if message.dbc else {}
    if name not in attributes:
        return None
    value = attributes[name].value
    choices = attributes[name].definition.choices
    return choices[value] if choices and isinstance(value, int) else value
