"""Dialects: the project's own, another controller's without a line of code, a vehicle's, and all that is refused."""

import os
import subprocess
import sys
from pathlib import Path

import cantools
import dialects
import numpy as np
import pytest
from pydantic import Field, ValidationError

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.base.yamlfile import FileModel, load
from etb_hil.canio.dbc.codec import MessageCodec
from etb_hil.canio.dbc.commands import CommandEncoder
from etb_hil.canio.dbc.decoder import Decoder
from etb_hil.canio.dbc.dialect import Dialect
from etb_hil.canio.dbc.protection import Profile
from etb_hil.canio.dbc.role_map import ProtectionSettings, RoleMap
from etb_hil.canio.dbc.writer import MessageWriter
from etb_hil.canio.frames import FrameBlock, FrameFlag

DATA = Path(os.environ.get("ETB_HIL_REAL_DATA", Path(__file__).parents[3] / "shared" / "data"))
FOREIGN = Path(__file__).parent / "foreign.dbc"
DEGREE = np.pi / 180

FOREIGN_BENCH = f"""\
roles:
  command_mode: TqMotCtl.Betriebsart
  command_enable: TqMotCtl.Freigabe
  command_position: {{signal: TqMotCtl.Sollwinkel, scale: {DEGREE!r}}}
  motor_current: {{signal: TqMotIst.Strom, scale: 0.001}}
  motor_angle:
    signal: TqMotIst.Winkel
    scale: {DEGREE!r}
    wraps: true
  sample_counter: {{signal: TqMotIst.Zaehler, tick: 100 us}}
protection:
  TqMotIst: {{profile: 2, data_ids: [9, 8, 7, 6, 5, 4, 3, 2, 1, 0, 11, 12, 13, 14, 15, 16]}}
  TqMotCtl: {{profile: 2, data_ids: [1, 8, 7, 6, 5, 4, 3, 2, 1, 0, 11, 12, 13, 14, 15, 16]}}
"""


class Bench(FileModel):
    """As much of a bench file as a dialect needs."""

    roles: RoleMap
    protection: ProtectionSettings = Field(default_factory=dict)
    id_offset: int = 0


def from_file(tmp_path, text, dbc=FOREIGN):
    path = tmp_path / "bench.yaml"
    path.write_text(text, encoding="utf-8")
    document = load(path, Bench)
    bench = document.content
    return Dialect.load(dbc, bench.roles, bench.protection, id_offset=bench.id_offset, place=document.place)


@pytest.mark.parametrize("name", ["etb_controller", "etb_controller_fd"])
def test_the_dbc_files_keep_every_rule(name):
    database = cantools.database.load_file(find("dbc", name), strict=True)
    loaded = dialects.fd() if name.endswith("fd") else dialects.classic()
    assert {m.name for m in database.messages} == {m.name for m in loaded.messages}
    for message in database.messages:
        assert message.comment
        MessageCodec(message)
        for signal in message.signals:
            assert signal.comment, signal.name
            assert signal.minimum is not None
            assert signal.maximum is not None
    profile = Profile.PROFILE_5 if name.endswith("fd") else Profile.PROFILE_2
    assert {m.protection.profile for m in loaded.messages} == {profile}
    assert len({m.protection.data_ids for m in loaded.messages}) == len(loaded.messages)
    carried = {role for m in loaded.messages for role in m.roles}
    assert set(dialects.COMMANDS) | {"motor_current", "motor_voltage", "motor_angle", "throttle_angle_2"} <= carried
    assert {m.counter.tick_ns for m in loaded.messages if m.counter} == {50_000}


def test_physical_zero_is_a_whole_count_of_the_encoder():
    database = cantools.database.load_file(find("dbc", "etb_controller"))
    codec = MessageCodec(database.get_message_by_name("EtbEncoder"))
    step = 2 * np.pi / 16384
    counts = np.arange(-32768, 98304, 7)
    angle = codec.decode(codec.encode({"MotorAngle": counts * step}))["MotorAngle"]
    np.testing.assert_allclose(angle, counts * step, atol=1e-12)
    assert codec.decode(codec.encode({"MotorAngle": 0.0}))["MotorAngle"][0] == 0.0


def test_another_controller_serves_without_a_line_of_code(tmp_path):
    dialect = from_file(tmp_path, FOREIGN_BENCH)
    writer = MessageWriter(dialect, "TqMotIst")
    ticks = np.arange(400) * 10 + 65_000
    angle = np.linspace(0, 3 * 6553.6 * DEGREE, 400)
    frames = writer.write(
        {"motor_current": -1.5, "motor_angle": angle, "sample_counter": ticks}, ticks * 100_000 + 5_000_000
    )
    assert (frames.flags == FrameFlag.EXTENDED).all()
    assert (frames.ident == 0x18FEF1FF).all()
    decoder = Decoder(dialect)
    (block,) = decoder.push(frames.select(np.arange(400) != 200))
    kept = np.delete(np.arange(400), 200)
    np.testing.assert_array_equal(np.diff(block.time_ns), np.diff(ticks[kept]) * 100_000)
    np.testing.assert_allclose(block.columns["motor_current"], -1.5)
    np.testing.assert_allclose(block.columns["motor_angle"], angle[kept], atol=0.06 * DEGREE)
    assert decoder.statistics()["TqMotIst"].lost == 1

    command = CommandEncoder(dialect).encode({"command_mode": 1, "command_enable": 1, "command_position": 0.5}, 7)
    (block,) = Decoder(dialect).push(command)
    assert block.columns["command_position"][0] == pytest.approx(0.5, abs=0.005 * DEGREE)
    payload = command.data[0].tobytes()
    expected = cantools.database.load_file(FOREIGN).get_message_by_name("TqMotCtl").decode(payload)
    assert expected["Sollwinkel"] == pytest.approx(0.5 / DEGREE, abs=0.005)


def test_an_offset_parts_several_controllers_on_one_bus():
    first, second = dialects.classic(), dialects.classic(id_offset=0x40)
    assert second.message("EtbCurrent").ident == first.message("EtbCurrent").ident + 0x40
    frames = MessageWriter(second, "EtbStatus").write({"mode": 1}, [1, 2])
    assert Decoder(first).push(frames) == []
    assert len(Decoder(second).push(frames)[0]) == 2


@pytest.mark.skipif(not (DATA / "can_passat").is_dir(), reason="the vehicle's trace is not beside the checkout")
def test_a_vehicle_file_serves_with_stamps():
    dialect = dialects.load(
        DATA / "can_passat" / "vw_pq.dbc",
        {
            "pedal_position": {"signal": "Motor_3.MO3_Pedalwert", "scale": 0.01},
            "throttle_opening": {"signal": "Motor_3.MO3_DKW", "scale": 0.01},
            "engine_speed": {"signal": "Motor_1.Motordrehzahl", "scale": 2 * np.pi / 60},
        },
    )
    assert dialect.source_of("pedal_position") == "Motor_3"
    message = cantools.database.load_file(dialect.path, strict=False).get_message_by_name("Motor_3")
    data = np.random.default_rng(3).integers(0, 256, (50, 8), dtype=np.uint8)
    frames = FrameBlock(
        np.arange(50) * 10_000_000,
        np.full(50, message.frame_id, np.uint32),
        np.zeros(50, np.uint8),
        np.full(50, 8, np.uint8),
        data,
        np.zeros(50, np.uint8),
    )
    decoder = Decoder(dialect)
    (block,) = decoder.push(frames)
    np.testing.assert_array_equal(block.time_ns, frames.stamp_ns)
    for row in range(50):
        decoded = message.decode(data[row].tobytes(), decode_choices=False)
        assert block.columns["pedal_position"][row] == decoded["MO3_Pedalwert"] * 0.01
        throttle = decoded.get("MO3_DKW")
        assert np.isnan(block.columns["throttle_opening"][row]) if throttle is None else True
        assert throttle is None or block.columns["throttle_opening"][row] == throttle * 0.01


@pytest.mark.parametrize(
    ("line", "becomes", "said"),
    [
        (
            "TqMotIst.Strom",
            "TqMotIst.Strmo",
            r"bench.yaml:5: roles.motor_current.* no signal .*did you mean TqMotIst.Strom",
        ),
        ("TqMotIst.Strom", "TqMotlst.Strom", r"bench.yaml:5: roles.motor_current.* no message .*did you mean TqMotIst"),
        ("scale: 0.001", "offset: 0", r"bench.yaml:5: .*in A, the signal in another unit .*'mA'.*write 'scale: 0.001'"),
        (
            "  motor_current",
            "  motor_curent",
            r"bench.yaml:5: roles.motor_curent: no such role; did you mean 'motor_current'\? allowed: motor_voltage",
        ),
        ("scale: 0.001", "scale: 0", r"bench.yaml:5: roles.motor_current.*scale of 0"),
        ("scale: 0.001", "scael: 0.001", r"bench.yaml:5: .*unknown key.*did you mean 'scale'"),
        (", tick: 100 us", "", r"bench.yaml:10: roles.sample_counter.* time from count to count .*tick: 50 us"),
        ("  TqMotIst: {profile: 2", "  TqMotIs: {profile: 2", r"bench.yaml:12: protection.TqMotIs: .*no message"),
        ("data_ids: [9, 8", "data_ids: [9", r"bench.yaml:12: protection.TqMotIst.*16 data ids"),
        ("profile: 2, data_ids: [9", "profile: 3, data_ids: [9", r"bench.yaml:12: protection.TqMotIst.profile"),
        ("protection:", "id_offset: 0x8000000\nprotection:", r"bench.yaml:11: id_offset: .*0x18fef1fe \+ 0x8000000"),
        ("TqMotIst.Strom", "TqMotIst", r"bench.yaml:5: .*no signal; allowed: 'Message.Signal'"),
        ("TqMotIst.Strom", "TqMotIst.Strom0..9", r"bench.yaml:5: roles.motor_current.* no signal of this name"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(tmp_path, line, becomes, said):
    assert line in FOREIGN_BENCH
    with pytest.raises(InputError, match=said):
        from_file(tmp_path, FOREIGN_BENCH.replace(line, becomes))


def test_every_problem_is_said_at_once(tmp_path):
    text = FOREIGN_BENCH.replace("TqMotIst.Strom", "TqMotIst.Strmo").replace(", tick: 100 us", "")
    with pytest.raises(InputError) as caught:
        from_file(tmp_path, text)
    assert len(caught.value.problems) == 2


def test_bursts_need_a_sample_counter():
    roles = {k: v for k, v in dialects.FD.items() if k != "sample_counter"}
    with pytest.raises(InputError, match="no sample counter says when"):
        dialects.load(find("dbc", "etb_controller_fd"), roles)


def test_files_that_are_no_dbc_are_refused(tmp_path):
    for name, content in (("empty.dbc", b""), ("text.dbc", b"roles: {}\n"), ("bytes.dbc", bytes(range(256)))):
        path = tmp_path / name
        path.write_bytes(content)
        with pytest.raises(InputError, match=name):
            dialects.load(path, {"mode": "EtbStatus.Mode"})
    with pytest.raises(InputError, match="cannot be read"):
        dialects.load(tmp_path / "missing.dbc", {"mode": "EtbStatus.Mode"})


def test_protection_attributes_that_make_no_sense_are_refused(tmp_path):
    text = find("dbc", "etb_controller").read_text(encoding="utf-8")
    path = tmp_path / "spoilt.dbc"
    path.write_text(text.replace('BA_ "E2EDataIds" BO_ 304 "', 'BA_ "E2EDataIds" BO_ 304 "0x1FF,'), encoding="utf-8")
    with pytest.raises(InputError, match=r"EtbStatus: its end-to-end protection cannot be read: .*16 data ids"):
        dialects.load(path, {"mode": "EtbStatus.Mode"})


def test_roles_and_messages_that_are_missing_are_named():
    dialect = dialects.classic()
    assert not dialect.has("drive_force")
    with pytest.raises(InputError, match=r"no signal has the role 'drive_force'.*motor_current"):
        dialect.source_of("drive_force")
    with pytest.raises(InputError, match=r"no message 'EtbBurst'.*EtbCurrent"):
        dialect.message("EtbBurst")


def test_role_entries_are_checked_when_they_are_read():
    with pytest.raises(ValidationError, match="no signal"):
        dialects.load(FOREIGN, {"mode": "nothing"})


def test_a_dbc_file_that_repeats_a_message_is_read_without_a_line_for_each(tmp_path):
    text = find("dbc", "etb_controller").read_text("utf-8")
    begin = text.index("BO_ 288 ")
    message = text[begin : text.index("\nBO_ ", begin) + 1]
    path = tmp_path / "repeated.dbc"
    path.write_text(text[:begin] + 300 * message + text[begin:], "utf-8")
    code = "import sys, pathlib; from etb_hil.canio.dbc.dbc_file import load_dbc; load_dbc(pathlib.Path(sys.argv[1]))"
    done = subprocess.run([sys.executable, "-c", code, path], capture_output=True, text=True, check=True)
    assert done.stderr == ""
