"""What a machine lacks for a bench's bus, and how to correct it.

Nothing is opened for longer than a look.
"""

from __future__ import annotations

import importlib.util
import os
import socket
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from etb_hil.canio.bus.bus_settings import SOCKETCAN, VIRTUAL
from etb_hil.canio.bus.interface_details import interface_details, interface_rates, rates_as_options

if TYPE_CHECKING:
    from etb_hil.canio.bus.bus_settings import BusSettings

NETWORK = Path("/sys/class/net")
_CAN_DEVICE = "280"  # ARPHRD_CAN of linux/if_arp.h
_UP = 0x1
_FD_MTU = 72
_SERIAL = {"slcan", "serial", "robotell", "seeedstudio"}  # interfaces of python-can whose channel is a serial port


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at.

    `ok` is None where nobody could tell, `remedy` says what to do where it is False.
    """

    ok: bool | None
    what: str
    remedy: str = ""


def look_at(bus: BusSettings, network: Path = NETWORK) -> list[Finding]:
    """Return what was found of the bus's interface.

    `network` is where the kernel lists the machine's interfaces.
    """
    if bus.interface == VIRTUAL:
        return [Finding(True, "the virtual bus needs nothing of this machine")]
    if bus.interface == SOCKETCAN:
        return list(_socketcan(bus, network))
    return list(_python_can(bus))


def _socketcan(bus: BusSettings, network: Path) -> Iterator[Finding]:
    kernel = _kernel_speaks_can()
    yield kernel
    name, folder = bus.channel, network / bus.channel
    is_virtual = name.startswith(("vcan", "vxcan"))
    if not folder.is_dir():
        there = [path.name for path in sorted(network.glob("*")) if _text(path / "type") == _CAN_DEVICE]
        create = (
            f"sudo modprobe vcan && sudo ip link add dev {name} type vcan && sudo ip link set {name} up"
            if is_virtual
            else "plug the adapter in and load its driver ('dmesg' says what came of it), or name another channel"
        )
        known = f"; this machine has: {', '.join(there)}" if there else "; this machine has none"
        yield Finding(False, f"there is no interface {name}{known}", create)
        return
    if _text(folder / "type") != _CAN_DEVICE:
        yield Finding(False, f"{name} must be a CAN interface", "name a CAN interface as the bus's channel")
        return
    bring_up = f"sudo ip link set {name} up" + ("" if is_virtual else f" {rates_as_options(bus)}")
    is_up = bool(int(_text(folder / "flags") or "0", 16) & _UP)
    yield Finding(is_up, f"{name} is {'up' if is_up else 'down'}", "" if is_up else bring_up)
    if bus.fd:
        takes_fd = int(_text(folder / "mtu") or 0) >= _FD_MTU
        widen = f"sudo ip link set {name} down && sudo ip link set {name} mtu {_FD_MTU} && {bring_up}"
        yield Finding(takes_fd, f"{name} takes {'' if takes_fd else 'no '}FD frames", "" if takes_fd else widen)
    if not is_virtual:
        yield from _bit_rates(bus, bring_up)


def _kernel_speaks_can() -> Finding:
    if not hasattr(socket, "AF_CAN"):
        return Finding(
            False, "this system has no SocketCAN", "use Linux, or an interface of python-can for this system"
        )
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except PermissionError:
        return Finding(False, "CAN sockets are forbidden here", "let the container or sandbox open AF_CAN sockets")
    except OSError:
        return Finding(
            False, "this kernel has no SocketCAN", "sudo modprobe can_raw (a container uses its host's kernel)"
        )
    return Finding(True, "the kernel speaks CAN")


def _bit_rates(bus: BusSettings, bring_up: str) -> Iterator[Finding]:
    """Compare what `ip` says of a CAN controller with what the bench file says."""
    name = bus.channel
    told = interface_details(name)
    if told is None:
        yield Finding(None, f"nobody can tell the bit rate of {name}", "install iproute2 for its command 'ip'")
        return
    again = f"sudo ip link set {name} down && {bring_up}"
    for rate in interface_rates(bus, told):
        what, found, wanted = rate.name, rate.found, rate.wanted
        if found is None:
            yield Finding(None, f"the driver of {name} does not tell its {what}; the bench file says {wanted} bit/s")
        else:
            same = found == wanted
            text = f"{name} has a {what} of {found} bit/s" + ("" if same else f", the bench file says {wanted}")
            yield Finding(same, text, "" if same else again)
    if (state := told.get("state")) is not None:
        healthy = state in {"ERROR-ACTIVE", "STOPPED"}
        remedy = f"check wiring and termination, then: {again}"
        yield Finding(healthy, f"the controller of {name} is {state.lower()}", "" if healthy else remedy)


def _python_can(bus: BusSettings) -> Iterator[Finding]:
    from can.interfaces import BACKENDS  # noqa: PLC0415 (importing can is slow)

    if bus.interface not in BACKENDS:
        yield Finding(False, f"python-can knows no interface '{bus.interface}'", f"name one of: {', '.join(BACKENDS)}")
        return
    if bus.interface in _SERIAL:
        has_serial = importlib.util.find_spec("serial") is not None
        remedy = "" if has_serial else "pip install 'python-can[serial]'"
        yield Finding(has_serial, f"pyserial is {'' if has_serial else 'not '}installed", remedy)
        yield _serial_port(bus.channel)
        return
    yield Finding(None, f"whether '{bus.channel}' of {bus.interface} is there shows when a run opens it")


def _serial_port(channel: str) -> Finding:
    """Look at a serial port, which may be a path or a URL.

    Python-can puts the serial speed behind an @.
    """
    path = Path(channel.partition("@")[0])
    if "://" in channel:
        return Finding(None, f"whether {channel} answers shows when a run opens it")
    if not path.exists():
        return Finding(False, f"there is no port {path}", "plug the adapter in, and see 'ls /dev/ttyACM* /dev/ttyUSB*'")
    if not os.access(path, os.R_OK | os.W_OK):
        import grp  # noqa: PLC0415 (not on every platform)

        group = grp.getgrgid(path.stat().st_gid).gr_name
        return Finding(False, f"{path} may not be opened by you", f"sudo usermod -aG {group} $USER, then log in again")
    return Finding(True, f"{path} is there and may be opened")


def _text(path: Path) -> str:
    try:
        return path.read_text("ascii").strip()
    except OSError:
        return ""
