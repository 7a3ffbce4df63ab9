"""`etb-hil page`: the operator page of a bench, in a browser."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

PORT = 8642


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("--bench", help="bench file (default: the station's, else virtual_classic)")
    parser.add_argument("--station", type=Path, metavar="FILE", help="station file: it decides on scenario and limits")
    parser.add_argument("--model", help="what the bench knows of the unit (default: default)")
    parser.add_argument("--limits", help="limits of the part (default: default)")
    parser.add_argument("--observer", help="observer of the friction torque (default: the bench file's)")
    parser.add_argument("--out", type=Path, default=Path("sessions"), help="folder of sessions (default: %(default)s)")
    parser.add_argument(
        "--replays", type=Path, default=Path("replays"), metavar="DIR",
        help="results of 'replay LOGS', whose progress is shown (default: %(default)s)",
    )  # fmt: skip
    parser.add_argument("--port", type=int, default=PORT, help="port; 0 takes a free one (default: %(default)s)")
    parser.add_argument("--host", help="address to be seen at from other machines; needs --password-file")
    parser.add_argument("--password-file", type=Path, metavar="FILE", help="file with the hash of the password")
    parser.add_argument("--set-password", type=Path, metavar="FILE", help="ask for a password, write its hash, and end")


def run(options: argparse.Namespace) -> int:
    """Serve the page until it is interrupted."""
    from etb_hil.base.errors import InputError, Problem

    if sys.platform == "win32":
        raise InputError(Problem("the page needs a POSIX system", remedy="run it on Linux"))
    from etb_hil.page.password import Password, set_password

    if options.set_password is not None:
        set_password(options.set_password, _asked())
        return 0
    if options.host is not None and options.password_file is None:
        raise InputError(
            Problem(
                "others could start this bench: --host needs a password",
                value=options.host,
                remedy="make one with --set-password FILE, then give it as --password-file FILE",
            )
        )
    if options.station is not None and (options.model or options.limits):
        raise InputError(Problem("the station file decides on model and limits", remedy="leave them out"))
    if options.station is not None and options.bench is not None:
        raise InputError(Problem("the station file decides on the bench", value=options.bench, remedy="leave it out"))
    try:
        from etb_hil.page.server import Settings, serve
    except ModuleNotFoundError as error:
        raise InputError(Problem(f"{error.name} is not installed", remedy="pip install 'etb-hil[page]'")) from None
    base = ["--out", str(options.out)]
    for name in ("bench", "station", "model", "limits", "observer"):
        if (given := getattr(options, name)) is not None:
            base += [f"--{name}", str(given)]
    for plugin in options.plugin:
        base += ["--plugin", plugin]
    password = None if options.password_file is None else Password(options.password_file)
    folders = options.out, options.replays
    serve(Settings(options.bench, options.station, *folders, base, options.host, options.port, password))
    return 0


def _asked() -> str:
    """Return the password that is typed unseen, twice, or piped in."""
    import getpass

    from etb_hil.base.errors import InputError, Problem

    if not sys.stdin.isatty():
        return sys.stdin.readline().rstrip("\n")
    first = getpass.getpass("New password of the page: ")
    if getpass.getpass("Again: ") != first:
        raise InputError(Problem("the two passwords differ", remedy="repeat"))
    return first
