"""The files that a new bench starts from, with comments that say what is a guess and what has to be done."""

from __future__ import annotations

import os
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from etb_hil.base.roles import COMMANDED, ROLES
from etb_hil.base.stock import find
from etb_hil.canio.dbc.role_proposals import chosen

if TYPE_CHECKING:
    from cantools.database.can import Database

    from etb_hil.canio.dbc.role_proposals import Proposal

REQUIRED = ("command_mode", "command_position", "motor_current", "motor_angle", "throttle_angle")
_SHOWN = 3  # guesses a role
_WIDTH = 110

_BENCH = """\
# A bench for {dbc}, proposed by 'etb-hil new' from the names and units of its signals.
# Nothing here is certain. Hold every line against the controller's documents; what commands the controller stays a
# comment until you have done so. 'etb-hil check SCENARIO --bench THIS' says what is still missing.
schema: etb_hil/bench/1
name: {name}

# Your adapter: interface and channel as python-can names them. {rate_source}
bus: {{interface: socketcan, channel: can0, bitrate: {bitrate}{fd}}}
dbc: {path}
command_rate: 100 Hz # set-points a second; the controller's documents say what it takes
measure: {{signals: [current, encoder], rate: 1 kHz}} # what the controller is asked to send

# What the bench never commands and never lets happen. These are the stock throttle's: take those of your unit.
limits:
  current: 15 A
  voltage: 16 V
  angle: [-3 deg, 87 deg]
  velocity: 35 rad/s
  temperature: 110 degC
  duration: 10 min

# Which signal means what. A signal in another unit than the role's needs a scale; one that wraps needs 'wraps: true'.
roles:
{roles}"""

_MODEL = """\
# A model to start from, written by 'etb-hil new': every value is the STOCK throttle's and none is your unit's.
# Replace them by your data sheet and by measurements, and say in 'source' where each is from. Verdicts rest on them.
"""

_SCENARIO = """\
# A scenario to start from, written by 'etb-hil new': the stock friction check.
# Its angles and speeds are the stock throttle's: 'etb-hil check' holds them against your bench's limits.
"""


def starting_files(dbc: Path, folder: Path, database: Database, found: dict[str, list[Proposal]]) -> dict[str, str]:
    """Return the texts of the new files by name; `folder` is where they will stand, `found` what was guessed."""
    rate, source = _bit_rate(database)
    is_fd = any(message.is_fd for message in database.messages)
    roles = "".join(_roles(found))
    name = _plain(dbc.stem)
    bench = _BENCH.format(
        dbc=_plain(dbc.name),
        name=f'"{name}"',
        path=f'"{_plain(os.path.relpath(dbc.resolve(), folder.resolve()))}"',
        bitrate=rate,
        rate_source=source,
        fd=", data_bitrate: 2 Mbit/s, fd: true" if is_fd else "",
        roles=roles,
    )
    model = (
        find("model", "default")
        .read_text("utf-8")
        .replace("name: default throttle, healthy", f'name: "{name}, not measured yet"')
    )
    scenario = find("scenario", "friction_check").read_text("utf-8")
    return {"bench.yaml": bench, "model.yaml": _MODEL + model, "scenario.yaml": _SCENARIO + scenario}


def _bit_rate(database: Database) -> tuple[str, str]:
    attributes = database.dbc.attributes if database.dbc else {}
    if "Baudrate" in attributes and int(attributes["Baudrate"].value) > 0:
        rate = int(attributes["Baudrate"].value)
        return f"{rate} bit/s", "The bit rate is the DBC file's attribute Baudrate."
    return "500 kbit/s", "The bit rate is only the usual one: the DBC file names none."


def _roles(found: dict[str, list[Proposal]]) -> Iterator[str]:
    best = chosen(found)
    for role, meaning in ROLES.items():
        guesses = found.get(role, [])
        if not guesses and role not in REQUIRED:
            continue
        yield f"\n  # {role}: {meaning.meaning} ({meaning.unit})\n"
        if not guesses:
            yield "  # MISSING: no signal's name and unit speak for it, and the bench cannot do without it.\n"
            yield f"  # {role}: Message.Signal\n"
        for index, guess in enumerate(guesses[:_SHOWN]):
            is_active = role in best and index == 0
            doubt = _doubt(role, len(guesses))
            ground = f"guess: {guess.grounds}" + ("" if is_active else f"; {doubt}" if index == 0 else "")
            yield "".join(f"  # {line}\n" for line in textwrap.wrap(_plain(ground), _WIDTH))
            yield f"  {'' if is_active else '# '}{role}: {_plain(guess.entry)}\n"
        if len(guesses) > _SHOWN:
            yield f"  # and {len(guesses) - _SHOWN} more that fit less well\n"


def _doubt(role: str, count: int) -> str:
    """Return why a guess is left to whoever reads it."""
    if role in COMMANDED:
        return "it commands the controller: confirm it first"
    if role == "sample_counter":
        return "as a list where several messages have one, and with its tick, as 'tick: 1 ms'"
    return "one of several that fit" if count > 1 else "a weak guess"


def _plain(text: str) -> str:
    """Return a text that stays on its line and in its quotes, whatever a DBC file calls its signals."""
    return "".join(c if c.isprintable() and c not in '"\\' else "?" for c in text)
