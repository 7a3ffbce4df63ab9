"""The virtual throttle controller: a node on a bus, frames in and frames out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from etb_hil import __version__
from etb_hil.base.modes import Mode
from etb_hil.base.rewinding import Rewindable
from etb_hil.canio.frames import FrameBlock
from etb_hil.controller.frame_reader import FrameReader
from etb_hil.controller.frame_writer import FrameWriter
from etb_hil.controller.machine import AMBIENT_C, Machine
from etb_hil.controller.state import CONTROL_NS, CONTROL_TICKS, LATCHED, TICK_NS, Fault

if TYPE_CHECKING:
    import numpy as np

    from etb_hil.canio.dbc.dialect import Dialect
    from etb_hil.controller.uds.faults import UdsFault
    from etb_hil.controller.uds.server import UdsServer
    from etb_hil.plant.parameters import Model
    from etb_hil.plant.physics import Vector
    from etb_hil.uds.settings import UdsSettings


@dataclass(frozen=True, slots=True)
class DriveSwitch:
    """The bridge went on or off: when, and why.

    The instant is by the bus's clock and by the controller's (s).
    """

    on: bool
    stamp_ns: int
    controller_time: float
    last_command_ns: int
    reason: str


class VirtualController(Rewindable):
    """A throttle unit with its controller on a bus (`Node`).

    The unit has 1 kHz control and 20 kHz sampling of a simulated plant.

    `unit` is what the throttle is; `nominal` is what the controller takes it for (the unit itself where none is
    given); `law` names its position law. It is switched on at `start_ns` of the bus's clock, with its plate at
    `start_angle` (rad) or where springs and friction may have left it, in a housing at `ambient` (degC). All noise
    follows from `seed`. `on_switch` is told each time the bridge goes on or off. With `uds` it answers UDS, as what
    `identity` says by name, with `uds_faults`; `track_2_offset` (rad) is a fault of its second plate track.
    """

    LIVES = ("_reader", "_writer", "_machine", "driving")

    def __init__(
        self,
        unit: Model,
        dialect: Dialect,
        seed: int,
        *,
        nominal: Model | None = None,
        law: str = "pd",
        start_ns: int = 0,
        start_angle: float | None = None,
        ambient: float = AMBIENT_C,
        on_switch: Callable[[DriveSwitch], None] | None = None,
        uds: UdsSettings | None = None,
        identity: Mapping[str, str] | None = None,
        uds_faults: tuple[UdsFault, ...] = (),
        track_2_offset: float = 0.0,
    ) -> None:
        self._reader = FrameReader(dialect)
        self._writer = FrameWriter(dialect, start_ns)
        self._machine = Machine(
            unit,
            nominal or unit,
            seed,
            start_ns=start_ns,
            start_angle=start_angle,
            law=law,
            ambient=ambient,
            has_single=self._writer.has_single,
            has_burst=self._writer.has_burst,
            track_2_offset=track_2_offset,
        )
        self._uds: UdsServer | None = None
        if uds is not None:
            from etb_hil.controller.uds.server import UdsServer  # noqa: PLC0415 (few benches need it)

            known = {"serial": "VIRTUAL", "part_number": unit.name, "software": __version__} | dict(identity or {})
            self._uds = UdsServer(uds, self._machine, (nominal or unit).values, known, uds_faults)
        self._on_switch = on_switch
        self.driving = False
        self.start_ns = start_ns
        self._acted_ns = start_ns - CONTROL_NS

    @property
    def sends(self) -> list[tuple[int, bool]]:
        """The identifiers of its frames, and whether they are extended."""
        return [*self._writer.idents, *([] if self._uds is None else self._uds.sends)]

    @property
    def can_rewind(self) -> bool:
        """Whether nobody outside is told of what happens, and no UDS server has a state."""
        return self._uds is None and self._on_switch is None

    @property
    def time(self) -> float:
        """The controller's own time in s since power-on."""
        return self._machine.tick * TICK_NS * 1e-9

    @property
    def plant_state(self) -> Vector:
        """The plant's true state (a copy), for tests and benchmarks.

        Its indices are in `etb_hil.plant.integrator`.
        """
        return self._machine.plant_state

    def run(self, until_ns: int, inbox: FrameBlock | None = None) -> FrameBlock:
        """Live until `until_ns`.

        Return the frames handed to the transmitter before it, stamped with when.

        `inbox` holds frames that ended on the bus until now, or will by `until_ns`; one takes effect at the first
        control tick at or after its stamp. How time is cut into calls changes nothing.
        """
        if inbox is not None and len(inbox):
            self._reader.push(inbox)
        if self._uds is None:
            return self._writer.joined(self._lived(until_ns))
        return self._writer.joined(self._lived_with(self._uds, until_ns, inbox))

    def _lived_with(self, uds: UdsServer, until_ns: int, inbox: FrameBlock | None) -> list[FrameBlock]:
        """Live until `until_ns`, with stops where the UDS server has work.

        They are at control ticks.
        """
        if inbox is not None and len(inbox):
            uds.take(inbox)
        blocks: list[FrameBlock] = []
        while True:
            done = self.start_ns + -(-self._machine.tick // CONTROL_TICKS) * CONTROL_NS
            tick_ns = uds.next_ns(max(done, self._acted_ns + CONTROL_NS))
            if tick_ns is None or tick_ns >= until_ns:
                return blocks + self._lived(until_ns)
            blocks += self._lived(tick_ns)
            answers, command = uds.act(tick_ns)
            self._acted_ns = tick_ns
            if command is not None:
                self._reader.insert(tick_ns, command)
            for ident, data in answers:
                blocks.append(self._writer.plain(tick_ns, ident, uds.is_extended, data))

    def _lived(self, until_ns: int) -> list[FrameBlock]:
        used, outputs = self._machine.run(until_ns, self._reader.stamp_ns, self._reader.events)
        self._reader.drop(used)
        blocks = []
        for output in outputs:
            blocks.append(self._writer.frames(output.samples, output.statuses))
            for switch in output.switches:
                self._note(switch)
        return blocks

    def _note(self, switch: np.void) -> None:
        self.driving = bool(switch["on"])
        if self._on_switch is None:
            return
        faults = Fault(int(switch["faults"]) & LATCHED)
        reason = faults.name or "" if faults else "limp-home" if switch["mode"] == Mode.LIMP_HOME else "command"
        tick = int(switch["tick"])
        stamp_ns = self.start_ns + tick * TICK_NS
        time_s = tick * TICK_NS * 1e-9
        self._on_switch(
            DriveSwitch(self.driving, stamp_ns, time_s, int(switch["command_ns"]), reason.lower().replace("_", "-"))
        )
