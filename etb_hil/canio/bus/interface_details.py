"""What the command `ip` says of a CAN interface, and its bit rates."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from etb_hil.canio.bus.bus_settings import BusSettings

_FOLDERS = "/usr/sbin:/usr/bin:/sbin:/bin"  # where it is for those whose PATH has no folders of the administrator
_LONGEST = 10.0  # s


@dataclass(frozen=True, slots=True)
class InterfaceRate:
    """A bit rate of an interface in bit/s.

    `key` is its name in the settings, `found` is None where the driver does not tell it.
    """

    key: str
    name: str
    wanted: int
    found: int | None


def interface_details(name: str) -> dict[str, Any] | None:
    """Return what the driver tells of an interface.

    None where `ip` does not end, fails, or says no JSON.
    """
    command = shutil.which("ip") or shutil.which("ip", path=_FOLDERS)
    if command is None:
        return None
    try:
        done = subprocess.run(  # noqa: S603 (no shell; the name is an argument)
            [command, "-json", "-details", "link", "show", "dev", name],
            capture_output=True, text=True, check=True, timeout=_LONGEST,
        )  # fmt: skip
        (told,) = json.loads(done.stdout)
        details = told.get("linkinfo", {}).get("info_data", {})
    except (OSError, subprocess.SubprocessError, ValueError, TypeError, AttributeError):
        return None
    return details if isinstance(details, dict) else None


def interface_rates(bus: BusSettings, details: Mapping[str, Any]) -> list[InterfaceRate]:
    """Return the bit rates that a bus needs, with those of the interface.

    The data bit rate is one of them with FD alone.
    """
    wanted = [("bittiming", "bitrate", "bit rate", bus.bitrate)]
    if bus.fd:
        wanted.append(("data_bittiming", "data_bitrate", "data bit rate", bus.data_bitrate))
    return [
        InterfaceRate(key, name, int(rate), details.get(timing, {}).get("bitrate"))
        for timing, key, name, rate in wanted
    ]


def rates_as_options(bus: BusSettings) -> str:
    """Return the bit rates of a bus as `ip link set` takes them."""
    return f"type can bitrate {bus.bitrate:.0f}" + (f" dbitrate {bus.data_bitrate:.0f} fd on" if bus.fd else "")
