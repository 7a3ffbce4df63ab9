"""The files that a new bench starts from.

Comments say what is a guess and what has to be done.
"""

from __future__ import annotations

import os
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from etb_hil.base.modes import Mode
from etb_hil.base.roles import COMMANDED, ROLES
from etb_hil.base.stock import stock_file
from etb_hil.canio.dbc.role_proposals import a_message_each, chosen

if TYPE_CHECKING:
    from cantools.database.can import Database

    from etb_hil.canio.dbc.role_proposals import Proposal

REQUIRED = ("command_mode", "command_position", "motor_current", "motor_angle", "throttle_angle", "sample_counter")
_SHOWN = 2  # other signals of a role
_MODE_NUMBERS = ", ".join(f"{int(mode)} {mode.name.lower().replace('_', '-')}" for mode in Mode)
_LONGEST_NAME = 80  # of a bench
_WIDTH = 110

_BENCH = """\
# A bench for {dbc}, proposed by 'etb-hil new' from the names, units and value tables of its signals.
# Compare every line with the controller's documents. A line that starts with '#' and no space is a proposal that is not
# sure: remove the '#' if it is right. 'etb-hil check SCENARIO --bench THIS' says what is still missing.
schema: etb_hil/bench/1
name: "{name}"

# The bus is simulated, with a simulated throttle and controller on it: nothing moves. For your adapter write instead,
# with interface and channel as python-can names them:
#   {{interface: socketcan, channel: can0, bitrate: {bitrate}{fd}}}
# {rate_source}
bus: {{interface: etb_virtual, channel: bench, bitrate: {bitrate}{fd}}}
dbc: "{path}"
command_rate: 100 Hz # set-points a second; the controller's documents say what it accepts
measure: {measure} # what the controller is asked to send

# Limits that stop a run. These are the stock throttle's: write those of your unit.
limits:
  current: 15 A
  voltage: 16 V
  angle: [-3 deg, 87 deg]
  velocity: 35 rad/s
  temperature: 110 degC
  duration: 10 min

# Which signal has which role. A signal in another unit than the role's needs a scale.
# An angle that wraps around needs 'wraps: true'.
{advice}roles:
{roles}"""

_NOTHING_FITS = """\
# No signal of this DBC file is about a throttle: neither names nor units say so. If a signal has a role all the same,
# write it below, indented, as in '  motor_current: Message.Signal'. The roles are:
"""
_NOTHING_SURE = """\
# No role is sure enough to be active. Remove the '#' of each proposal that is right; a bench needs at least one role.
"""

_MODEL = """\
# A model to start from, written by 'etb-hil new': every value is the STOCK throttle's and none is your unit's.
# Replace them by your data sheet and by measurements, and say in 'source' where each is from. Verdicts rest on them.
"""

_SCENARIO = """\
# A scenario to start from, written by 'etb-hil new': the stock friction check.
# Its angles and speeds are the stock throttle's: 'etb-hil check' holds them against your bench's limits.
"""


def starting_files(dbc: Path, folder: Path, database: Database, found: dict[str, list[Proposal]]) -> dict[str, str]:
    """Return the texts of the new files by name.

    `folder` is where they will stand, `found` what is proposed.
    """
    rate, source = _bit_rate(database)
    is_fd = any(message.is_fd for message in database.messages)
    name = _plain(dbc.stem)
    best = chosen(found)
    bench = _BENCH.format(
        dbc=_plain(dbc.name),
        name=name[:_LONGEST_NAME] or "new bench",
        path=_plain(os.path.relpath(dbc.resolve(), folder.resolve())),
        bitrate=rate,
        rate_source=source,
        fd=", data_bitrate: 2 Mbit/s, fd: true" if is_fd else "",
        measure=_measure(best),
        advice=_NOTHING_FITS + _list_of_roles() if not found else "" if best else _NOTHING_SURE,
        roles="".join(_roles(found, best)),
    )
    model = (
        stock_file("model", "default")
        .read_text("utf-8")
        .replace("name: default throttle", f'name: "{name[: _LONGEST_NAME - 20]}, not measured yet"')
    )
    scenario = stock_file("scenario", "friction_check").read_text("utf-8")
    return {"bench.yaml": bench, "model.yaml": _MODEL + model, "scenario.yaml": _SCENARIO + scenario}


def _bit_rate(database: Database) -> tuple[str, str]:
    attributes = database.dbc.attributes if database.dbc else {}
    if "Baudrate" in attributes and int(attributes["Baudrate"].value) > 0:
        rate = int(attributes["Baudrate"].value)
        return f"{rate} bit/s", "The bit rate is the DBC file's attribute Baudrate."
    return "500 kbit/s", "The bit rate is the usual one: the DBC file states none."


def _measure(best: dict[str, list[Proposal]]) -> str:
    """Return the usual request: bursts if there are any, else a sample a ms."""
    is_burst = "request_burst" in best and any(".." in guess.signal for guess in best.get("motor_current", []))
    return f"{{signals: [current, encoder], rate: {'20 kHz, burst: true' if is_burst else '1 kHz'}}}"


def _roles(found: dict[str, list[Proposal]], best: dict[str, list[Proposal]]) -> Iterator[str]:
    for role, meaning in ROLES.items():
        guesses, active = found.get(role, []), best.get(role, [])
        if not guesses and role not in REQUIRED:
            continue
        yield f"\n  # {role}: {meaning.meaning}{'' if meaning.unit == '1' else f' ({meaning.unit})'}\n"
        if not guesses:
            yield "  # No signal is proposed, and a run needs this role.\n"
            signal = "{signal: Message.Signal, tick: 1 ms}" if role == "sample_counter" else "Message.Signal"
            yield f"  #{role}: {signal}\n"
            continue
        shown = active or (a_message_each(guesses) if role == "sample_counter" else guesses[:1])
        yield from _comment(_sentence(shown[0].grounds) + ("" if active else f" {_why_unsure(shown[0], len(guesses))}"))
        entries = [_plain(guess.entry) for guess in shown]
        entry = entries[0] if len(entries) == 1 else f"[{', '.join(entries)}]"
        yield f"  {'' if active else '#'}{role}: {entry}\n"
        others = [guess for guess in guesses if guess not in shown]
        for guess in others[:_SHOWN]:
            yield from _comment(f"or {guess.entry}: {guess.grounds}")
        if len(others) > _SHOWN:
            yield f"  # {len(others) - _SHOWN} further signals fit less well.\n"


def _list_of_roles() -> str:
    return "".join(f"#   {line}\n" for line in textwrap.wrap(", ".join(ROLES), _WIDTH))


def _comment(text: str) -> Iterator[str]:
    yield from (f"  # {line}\n" for line in textwrap.wrap(_plain(text), _WIDTH))


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def _why_unsure(proposal: Proposal, count: int) -> str:
    """Return why the first of some proposals is not active."""
    role = proposal.role
    if proposal.numbers:
        return f"Its numbers are {proposal.numbers}; the role's are {_MODE_NUMBERS}. A run needs the role's numbers."
    if role in COMMANDED:
        return "It commands the controller: confirm it first."
    if role == "sample_counter":
        return "Confirm that it counts samples, and its tick: the time from count to count."
    if role == "mode":
        return f"Confirm that its numbers are {_MODE_NUMBERS}."
    return "Several signals fit: choose one." if count > 1 else "Confirm it first."


def _plain(text: str) -> str:
    """Return a text that stays on its line and in its quotes.

    A DBC file may call its signals anything.
    """
    return "".join(c if c.isprintable() and c not in '"\\' else "?" for c in text)
