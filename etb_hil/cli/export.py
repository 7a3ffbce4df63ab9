"""`etb-hil export`: a session or log in another format, or its signals."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cantools.database.can import Message


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("source", type=Path, help="folder of a session, or a log of any format")
    parser.add_argument(
        "out",
        type=Path,
        help="file to write: .blf, .asc, .log, .trc, .db, .mf4 or, signals alone, .parquet; .csv has the signals of a "
        "session by role, as `plot` and `explain` read them, and the frames of a log",
    )
    parser.add_argument("--dbc", help="DBC file of the signals (default: the session's own)")


def run(options: argparse.Namespace) -> int:
    """Write the file, and say what it could not hold."""
    from etb_hil.base.errors import InputError
    from etb_hil.base.files import must_not_replace
    from etb_hil.base.stock import find
    from etb_hil.canio.logs.reading import read_log
    from etb_hil.replays.export import export

    is_session = (options.source / "session.json").exists()
    if is_session and options.out.suffix.lower() == ".csv":
        return _table(options)
    raw = options.source / "raw.blf" if is_session else options.source
    dbc = [] if options.dbc is None else [find("dbc", options.dbc)]
    must_not_replace([(options.out, "give another name")], [raw, *dbc])
    log = read_log(raw)
    try:
        done = export(log, options.out, *_signals(options))
    except InputError as error:
        raise InputError(*error.problems, *log.notes) from None
    print(done)
    for note in log.notes:
        print(f"note: {note}")
    return 0


def _table(options: argparse.Namespace) -> int:
    """Write the signals of a session as a table in SI units, a column a role."""
    from etb_hil.api.recordings import read
    from etb_hil.base.errors import InputError, Problem

    if options.dbc:
        what = "--dbc does not go with .csv: the session's own files say which signal is which role"
        raise InputError(Problem(what, value=options.dbc, remedy="leave --dbc out, or export to .parquet"))
    recording = read(options.source)
    recording.write(options.out)
    print(f"signals of {recording.duration:.3f} s by role, in SI units: {', '.join(recording.roles)}")
    for note in recording.notes:
        print(f"note: {note}")
    return 0


def _signals(options: argparse.Namespace) -> tuple[list[Message], int]:
    """Return the messages to decode and what is added to their identifiers."""
    from etb_hil.base.stock import find
    from etb_hil.bench.bench_file import load_bench
    from etb_hil.canio.dbc.dbc_file import load_dbc, require_distinct
    from etb_hil.session.session import open_session

    id_offset = 0
    if (options.source / "session.json").exists():
        session = open_session(options.source)
        dbc = find("dbc", options.dbc) if options.dbc else session.input_path("dbc")
        id_offset = load_bench(session.input_path("bench"), session.input_path("dbc")).bench.id_offset
    elif options.dbc:
        dbc = find("dbc", options.dbc)
    else:
        return [], 0
    messages = list(load_dbc(dbc).messages)
    require_distinct(messages, dbc)
    return messages, id_offset
