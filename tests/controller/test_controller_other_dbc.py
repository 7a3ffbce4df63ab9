"""Another DBC: Motorola byte order, degrees, no protection, commands in two messages, one for all samples."""

import math

import cantools
import numpy as np
import pytest
from controller_harness import MS, model
from pydantic import TypeAdapter

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.bench.bench_file import load_bench
from etb_hil.canio.dbc.dialect import Dialect
from etb_hil.canio.dbc.role_map import RoleMap
from etb_hil.canio.dbc.writer import MessageWriter
from etb_hil.canio.frames import concatenate_frames
from etb_hil.controller.virtual_controller import VirtualController

DBC = """
VERSION ""
NS_ :
BS_:
BU_: Tester Ecu

BO_ 2566844672 Mode: 2 Tester
 SG_ State : 7|4@0+ (1,0) [0|15] "" Ecu
 SG_ Power : 3|1@0+ (1,0) [0|1] "" Ecu

BO_ 2566844673 Target: 4 Tester
 SG_ Angle : 7|16@0- (0.01,0) [-300|300] "deg" Ecu
 SG_ Speed : 23|16@0- (0.1,0) [-3000|3000] "deg/s" Ecu

BO_ 257 Ask: 2 Tester
 SG_ What : 7|8@0+ (1,0) [0|255] "" Ecu
 SG_ Rate : 15|8@0+ (10,0) [0|2550] "Hz" Ecu

BO_ 258 Samples: 8 Ecu
 SG_ Count : 7|8@0+ (1,0) [0|255] "" Tester
 SG_ Current : 15|16@0- (1,0) [-32768|32767] "mA" Tester
 SG_ Encoder : 31|24@0- (0.01,0) [-80000|80000] "deg" Tester
 SG_ Plate : 55|16@0- (0.01,0) [-300|300] "deg" Tester

BO_ 259 Health: 3 Ecu
 SG_ On : 7|1@0+ (1,0) [0|1] "" Tester
 SG_ Heat : 15|16@0- (0.1,0) [-100|300] "degC" Tester
"""
DEG = math.pi / 180.0
ROLES = {
    "command_mode": "Mode.State",
    "command_enable": "Mode.Power",
    "command_position": {"signal": "Target.Angle", "scale": DEG},
    "command_velocity": {"signal": "Target.Speed", "scale": DEG},
    "request_signals": "Ask.What",
    "request_rate": "Ask.Rate",
    "sample_counter": {"signal": "Samples.Count", "tick": "50 us"},
    "motor_current": {"signal": "Samples.Current", "scale": 1e-3},
    "motor_angle": {"signal": "Samples.Encoder", "scale": DEG, "wraps": True},
    "throttle_angle": {"signal": "Samples.Plate", "scale": DEG},
    "enable": "Health.On",
    "temperature": "Health.Heat",
}


def read(folder, **roles):
    path = folder / "other.dbc"
    path.write_text(DBC)
    return Dialect.load(path, TypeAdapter(RoleMap).validate_python({**ROLES, **roles}))


@pytest.fixture
def dialect(tmp_path):
    return read(tmp_path)


def test_it_obeys_and_answers_in_its_own_words(dialect):
    stamps = np.arange(1, 300, 10) * MS
    mode = MessageWriter(dialect, "Mode").write({"command_mode": 1.0, "command_enable": 1.0}, stamps)
    values = {"command_position": 40.0 * DEG, "command_velocity": 0.0}
    target = MessageWriter(dialect, "Target").write(values, stamps - MS // 2)
    ask = MessageWriter(dialect, "Ask").write({"request_signals": 3.0, "request_rate": 500.0}, [0])
    inbox = concatenate_frames([ask, mode, target])
    inbox = inbox.select(np.argsort(inbox.stamp_ns, kind="stable"))
    node = VirtualController(model("default"), dialect, 1, start_angle=0.3)
    frames = node.run(300 * MS, inbox)
    database = cantools.database.load_string(DBC, "dbc")
    samples = [database.decode_message(258, frames.data[r, :8].tobytes()) for r in np.flatnonzero(frames.ident == 258)]
    assert [s["Count"] for s in samples] == [k * 40 % 256 for k in range(150)]
    assert samples[-1]["Plate"] == pytest.approx(40.0, abs=0.5)
    assert samples[-1]["Encoder"] / 18.0 + 0.3 / DEG == pytest.approx(40.0, abs=0.5)
    assert 300 < samples[-1]["Current"] < 3000
    assert node.driving
    health = [database.decode_message(259, frames.data[r, :3].tobytes()) for r in np.flatnonzero(frames.ident == 259)]
    assert health[-1] == {"On": 1, "Heat": pytest.approx(20.0, abs=0.2)}


@pytest.mark.parametrize(("tick", "counts"), [("1 ms", 2), ("0.5 ms", 4), ("10 us", 200)])
def test_its_samples_are_counted_in_the_benchs_tick(tick, counts, tmp_path):
    dialect = read(tmp_path, sample_counter={"signal": "Samples.Count", "tick": tick})
    ask = MessageWriter(dialect, "Ask").write({"request_signals": 3.0, "request_rate": 500.0}, [0])
    frames = VirtualController(model("default"), dialect, 1).run(100 * MS, ask)
    told = [int(frames.data[r, 0]) for r in np.flatnonzero(frames.ident == 258)]
    assert told == [k * counts % 256 for k in range(50)]


def test_bursts_with_a_tick_that_it_cannot_keep_are_refused():
    setup = load_bench(find("bench", "virtual_fd"))
    roles = dict(setup.bench.roles)
    roles["sample_counter"] = tuple(entry.model_copy(update={"tick": 1e-4}) for entry in roles["sample_counter"])
    dialect = Dialect.load(setup.dbc, roles)
    with pytest.raises(InputError, match=r"samples bursts at 20 kHz.*it is '100 us'.*50 us"):
        VirtualController(model("default"), dialect, 1)
