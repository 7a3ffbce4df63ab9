"""The entry of `etb-hil`: find the command, and turn errors into exit codes.

Only what the command needs is loaded.
"""

from __future__ import annotations

import argparse
import gc
import importlib
import os
import signal
import sys
import warnings
from types import FrameType
from typing import NoReturn

from etb_hil import __version__
from etb_hil.base.output import Output, use_safe_streams
from etb_hil.base.own_process import begin_own_process
from etb_hil.cli.compiling import announce_compiling
from etb_hil.cli.completion import ASKED, complete, words_so_far
from etb_hil.cli.parser import Parser

# command -> what it does; each has a module of its name in this folder with `add_arguments` and `run`
COMMANDS = {
    "run": "run a scenario on a bench and judge the unit",
    "page": "show the operator page of a bench in a browser: start, watch and repeat tests",
    "replay": "judge a recorded session or log again, with the same code",
    "baseline": "make a baseline from a session, for later runs to be compared to",
    "export": "write a session or log in another format, or its signals",
    "plot": "draw what a session, a log or a table holds, role by role over time",
    "controller": "be the virtual throttle controller on a bus",
    "explain": "explain a measurement: what the simulation gets wrong, why, and how much better it gets",
    "isolability": "list the effects that a planned scenario could isolate",
    "station": "say what a station tests, whether its bench is fit, and which sessions need not be kept",
    "history": "units over time, control charts, capability, gauge R&R and drift of many runs",
    "store": "say what a store of results holds; export, copy or delete runs of it",
    "new": "write a bench, a model and a scenario to start from, for a controller's DBC file",
    "check": "say what is missing for a run, on paper and on this machine, and how to correct it",
    "simulate": "run a scenario or a recorded voltage on a model, without a bus, into a table",
    "reproduce": "run the seed paper's simulations: its figures, and the numbers behind them",
    "schema": "print the JSON schemas of the files that people write",
    "completion": "print what a shell has to read so that Tab completes commands, options and names",
}

# commands whose exit code is their answer, whether or not anybody gets to read the text
_JUDGING = {"run", "replay", "explain", "check", "station"}

DESCRIPTION = "Hardware-in-the-loop bench for electronic throttle bodies over CAN."
EXIT_CODES = "exit codes: 0 pass or done, 2 bad input, 3 bench fault, 4 inconclusive, 5 aborted, 10 unit failed"


def main(arguments: list[str] | None = None) -> int:
    """Run one command and return its exit code.

    Without arguments it is the command of this process.
    """
    return _process() if arguments is None else _command(arguments)


def _process() -> int:
    """Run the command of this process, whose streams, warnings and signals are ours."""
    begin_own_process()
    _open_standard_streams()
    use_safe_streams()
    announce_compiling()
    warnings.showwarning = _caution  # type: ignore[assignment]
    for name in ("SIGTERM", "SIGHUP"):  # a closed terminal and a service manager end a command as Ctrl-C does
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _interrupt)
    words = sys.argv[1:]
    try:
        code = _command(words)
    except SystemExit as left:  # argparse's alone: what was asked for is a text, and nothing was judged
        code, words = left.code if isinstance(left.code, int) else 0, []
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):  # what comes while Python ends takes the place of no exit code
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    # A KeyboardInterrupt that passed through `exec` of a text, caught since or not, makes `python -m` end by SIGINT
    # (130) whatever is returned here. The next `exec` forgets it.
    exec("")  # noqa: S102
    gc.freeze()  # Python would look for cycles among all objects once more, a tenth of a second, before it ends
    return _lost_output(code, words)


def _interrupt(number: int, frame: FrameType | None) -> NoReturn:  # noqa: ARG001 (the signature of a handler)
    raise KeyboardInterrupt(signal.Signals(number).name)


def _lost_output(code: int, words: list[str]) -> int:
    """Say that output was lost; return the exit code.

    The code stays where it is the command's answer.
    """
    failure = sys.stdout.failure if isinstance(sys.stdout, Output) else None
    if failure is None:
        return code
    print(f"standard output: cannot be written: {failure.strerror}; make room, then repeat", file=sys.stderr)
    return code or (0 if _JUDGING & set(words[:1]) else 2)


def _command(words: list[str]) -> int:
    if ASKED in os.environ:
        words = words_so_far()
    command = next((word for word in words if not word.startswith("-")), None)
    parser = _parser(command if command in COMMANDS else None)
    if ASKED in os.environ:
        complete(parser)
    options = parser.parse_args(words)
    module = importlib.import_module(f"etb_hil.cli.{options.command}")
    return _guarded(module.run, options)


def _open_standard_streams() -> None:
    """Lead standard streams that were closed (`>&-`) nowhere.

    Else the next file that is opened, a raw log perhaps, takes their number.
    """
    for number, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        try:
            os.fstat(number)
        except OSError:
            os.dup2(os.open(os.devnull, os.O_RDWR), number)
            os.set_inheritable(number, True)
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, mode, closefd=False))  # noqa: SIM115 (as long as the process lives)


def _parser(command: str | None) -> argparse.ArgumentParser:
    """Build the parser; only the named command's options are loaded."""
    parser = Parser("etb-hil", description=DESCRIPTION, epilog=EXIT_CODES)
    parser.add_argument("--version", action="version", version=f"etb-hil {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, summary in COMMANDS.items():
        sub = commands.add_parser(
            name, help=summary, description=f"{summary[0].upper()}{summary[1:]}.", epilog=EXIT_CODES
        )
        if name == command:
            importlib.import_module(f"etb_hil.cli.{name}").add_arguments(sub)
            sub.add_argument(
                "--plugin",
                action="append",
                default=[],
                metavar="FILE.py",
                help="take in a plug-in from a Python file; may be given several times",
            )
    return parser


def _caution(message: Warning | str, *_: object) -> None:
    """Print what a warning says, without the line of code that gave it."""
    print(f"caution: {message}", file=sys.stderr)


def _guarded(run: object, options: argparse.Namespace) -> int:
    from etb_hil.base.errors import BenchFault, EtbHilError, InputError
    from etb_hil.base.outcome import ExitCode

    try:
        if options.plugin:
            from etb_hil.plugins import load

            for path in options.plugin:
                load(path)
        return int(run(options))  # type: ignore[operator]
    except InputError as error:
        print(error, file=sys.stderr)
        return ExitCode.BAD_INPUT
    except KeyboardInterrupt as error:
        print(f"aborted: {error}" if str(error) else "aborted", file=sys.stderr)
        return ExitCode.ABORTED
    except (BenchFault, EtbHilError) as error:
        print(f"bench fault: {error}", file=sys.stderr)
        return ExitCode.BENCH_FAULT
    except SystemExit as left:  # none of ours: code that was called, a plug-in's perhaps, and nothing was judged
        what = f"`etb-hil {options.command}` was ended by sys.exit({'' if left.code is None else repr(left.code)})"
        print(f"{what} in code that it called; it has no result: run it without plug-ins", file=sys.stderr)
        return ExitCode.BENCH_FAULT if options.command == "run" else ExitCode.BAD_INPUT


if __name__ == "__main__":
    sys.exit(main())
