"""`etb-hil controller`: be the virtual throttle controller on a bus."""

from __future__ import annotations

import argparse
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TextIO

from etb_hil.cli.quantity_option import quantity_option
from etb_hil.controller.uds.faults import UdsFault, UdsFaultKind


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument(
        "--unit", default="default", metavar="MODEL", help="what the throttle is: a model file or stock name"
    )
    parser.add_argument(
        "--nominal", metavar="MODEL", help="what the controller takes it for (default: the stock default)"
    )
    parser.add_argument(
        "--bench", metavar="FILE", help="bench file with bus, DBC and roles (default: the stock vcan_classic)"
    )
    parser.add_argument("--interface", help="python-can's name of the interface, in place of the bench file's")
    parser.add_argument("--channel", help="channel of the interface, in place of the bench file's")
    parser.add_argument("--fd", action="store_true", help="CAN FD: the stock vcan_fd where no bench file is given")
    parser.add_argument("--law", default="pd", help="position law: pd, pid, sliding-mode or a plug-in's (default: pd)")
    parser.add_argument("--seed", type=int, default=1, help="of all noise (default: 1)")
    parser.add_argument("--start-angle", metavar="ANGLE", help="where the plate stands at power-on, as '8 deg'")
    parser.add_argument("--ambient", metavar="TEMPERATURE", default="20 degC", help="as '20 degC' (the default)")
    parser.add_argument("--serial", default="VIRTUAL", help="serial number that it reports by UDS (default: VIRTUAL)")
    parser.add_argument("--part-number", help="part number that it reports by UDS (default: the unit's name)")
    faults = parser.add_argument_group("faults of its UDS, to try a bench with")
    faults.add_argument("--uds-fault", choices=list(UdsFaultKind), metavar="KIND", help=", ".join(UdsFaultKind))
    faults.add_argument(
        "--uds-fault-service",
        type=lambda text: int(text, 0),
        metavar="SERVICE",
        help="of the answers to this service alone, as 0x22",
    )
    faults.add_argument("--uds-fault-after", default="0 s", metavar="TIME", help="from power-on on (default: 0 s)")
    parser.add_argument("--log", type=Path, metavar="FILE", help="JSON lines: drive on and off with controller time")


def run(args: argparse.Namespace) -> int:
    """Serve until Ctrl-C or SIGTERM; print how late the host was."""
    from etb_hil.base.clock import WallClock
    from etb_hil.base.errors import InputError, Problem
    from etb_hil.base.files import must_not_replace
    from etb_hil.base.outcome import ExitCode
    from etb_hil.base.steady import DEVICE, steady
    from etb_hil.base.stock import find
    from etb_hil.bench.bench_file import load_bench, load_plugins
    from etb_hil.bench.controller_lock import sender_lock
    from etb_hil.bench.stop_signals import StopSignals
    from etb_hil.canio.bus.bus_settings import VIRTUAL
    from etb_hil.canio.bus.link import open_link
    from etb_hil.controller.process import EventLog, compile_kernels, serve
    from etb_hil.controller.virtual_controller import VirtualController
    from etb_hil.plant.parameters import load_model

    file = find("bench", args.bench or ("vcan_fd" if args.fd else "vcan_classic"))
    load_plugins(file)
    setup = load_bench(file)
    chosen = {key: value for key in ("interface", "channel") if (value := getattr(args, key)) is not None}
    settings = setup.bench.bus.model_copy(update=chosen)
    if settings.interface == VIRTUAL:
        what = "the deterministic bus lives inside one process and cannot be reached from another"
        raise InputError(Problem(what, value=settings.interface, remedy="give --interface and --channel of a real bus"))
    if args.fd and not settings.fd:
        raise InputError(
            Problem("this bench file's bus has no CAN FD", setup.document.place("bus"), remedy="leave --fd out")
        )
    if args.uds_fault is not None and setup.bench.uds is None:
        what = "this bench has no diagnostics, so that they cannot have a fault"
        raise InputError(Problem(what, setup.document.place(), remedy="give a bench file with a section 'uds'"))
    unit = load_model(find("model", args.unit))
    nominal = load_model(find("model", args.nominal or "default"))
    start_angle = None if args.start_angle is None else quantity_option("--start-angle", args.start_angle, "angle")
    ambient = quantity_option("--ambient", args.ambient, "temperature")
    if args.log is not None:
        inputs = [file, setup.dbc, find("model", args.unit), find("model", args.nominal or "default")]
        must_not_replace([(args.log, "give --log another file")], inputs)
    clock = WallClock()
    with ExitStack() as stack:
        stop = stack.enter_context(StopSignals())
        log = EventLog(None if args.log is None else stack.enter_context(_created(args.log)))
        power_on = partial(
            VirtualController,
            unit,
            setup.dialect,
            args.seed,
            nominal=nominal,
            law=args.law,
            start_angle=start_angle,
            ambient=ambient,
            on_switch=log.switch,
            uds=setup.bench.uds,
            uds_faults=_faults(args),
            identity={"serial": args.serial, "part_number": args.part_number or unit.name},
        )
        rehearsing = power_on()
        stack.enter_context(sender_lock(settings, rehearsing.sends, f"controller of '{unit.name}'"))
        compile_kernels(rehearsing)
        stack.enter_context(steady(DEVICE))
        link = open_link(settings, clock)
        stack.callback(link.close)
        controller = power_on(start_ns=clock.now_ns())
        print(f"controller of '{unit.name}' on {settings.interface}:{settings.channel}, stop with Ctrl-C", flush=True)
        lateness = serve(controller, link, clock, log, lambda: stop.received is not None)
    print(f"stopped by {stop.received}; {lateness}", flush=True)
    return ExitCode.DONE


def _faults(args: argparse.Namespace) -> tuple[UdsFault, ...]:
    if args.uds_fault is None:
        return ()
    after_s = quantity_option("--uds-fault-after", args.uds_fault_after, "time")
    return (UdsFault(UdsFaultKind(args.uds_fault), args.uds_fault_service, after_ns=round(after_s * 1e9)),)


def _created(path: Path) -> TextIO:
    from etb_hil.base.errors import InputError, Place, Problem

    try:
        return path.open("w", encoding="utf-8")
    except OSError as error:
        raise InputError(
            Problem(f"cannot be written: {error.strerror}", Place(path), remedy="choose another file")
        ) from None
