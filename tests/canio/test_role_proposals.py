"""Roles that `etb-hil new` proposes for DBC files: ours, a stranger's controller, and vehicles."""

import os
import re
import shutil
from functools import cache
from pathlib import Path

import cantools
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.base.errors import InputError
from etb_hil.base.roles import ROLES
from etb_hil.base.stock import find
from etb_hil.bench.bench_file import load_bench
from etb_hil.canio.dbc.dbc_file import load_dbc
from etb_hil.canio.dbc.message_subject import words_of
from etb_hil.canio.dbc.role_proposals import chosen, proposals
from etb_hil.cli.main import main
from etb_hil.cli.starting_files import starting_files

REAL = Path(os.environ.get("ETB_HIL_REAL_DATA") or Path(__file__).resolve().parents[3] / "shared" / "data")
VEHICLES = REAL / "can_passat"
PEERS = sorted((REAL / "peers" / "cantools_dbc").glob("*.dbc"))


@pytest.mark.parametrize(("bench", "dbc"), [("virtual_classic", "etb_controller"), ("virtual_fd", "etb_controller_fd")])
def test_the_stock_controllers_roles_are_the_first_guesses(bench, dbc):
    mapped = load_bench(find("bench", bench)).bench.roles
    found = proposals(load_dbc(find("dbc", dbc)))
    for role, signals in mapped.items():
        guessed = {guess.signal for guess in found[role][: len(signals)]}
        assert guessed == {entry.signal for entry in signals}, role
    assert mapped.keys() == chosen(found).keys()


@cache
def _of_a_vehicle(file):
    return proposals(load_dbc(VEHICLES / file))


@pytest.mark.skipif(not VEHICLES.is_dir(), reason="needs the measured data beside the checkout")
@pytest.mark.parametrize(
    ("file", "role", "signal"),
    [
        ("vw_pq.dbc", "pedal_position", "Motor_3.MO3_Pedalwert"),
        ("vw_pq.dbc", "throttle_opening", "Motor_3.MO3_DKW"),
        ("vw_pq.dbc", "engine_speed", "Motor_1.Motordrehzahl"),
        ("vw_pq.dbc", "supply_voltage", "BSG_Last.Batteriespannung_Bordnetzbatter"),
        ("vw_mqb_2010.dbc", "pedal_position", "OBD_01.OBD_Abs_Pedal_Pos"),
        ("vw_mqb_2010.dbc", "throttle_opening", "OBD_01.OBD_Abs_Throttle_Pos"),
        ("vw_mqb_2010.dbc", "engine_speed", "Motor_12.MO_Drehzahl_01"),
    ],
)
def test_what_a_vehicles_file_has_is_among_the_guesses(file, role, signal):
    found = _of_a_vehicle(file)
    assert signal in [guess.signal for guess in found[role][:3]]
    assert not {"motor_angle", "throttle_angle", "command_mode"} & chosen(found).keys()  # a vehicle's bus has none


@pytest.mark.parametrize("dbc", ["etb_controller", "etb_controller_fd"])
def test_a_new_bench_of_our_own_controller_passes_check_unedited(dbc, tmp_path, capsys):
    assert main(["new", str(find("dbc", dbc)), "--out", str(tmp_path)]) == 0
    scenario, bench, model = (str(tmp_path / name) for name in ("scenario.yaml", "bench.yaml", "model.yaml"))
    assert main(["check", scenario, "--bench", bench, "--model", model]) == 0, capsys.readouterr().out


@pytest.mark.skipif(not VEHICLES.is_dir(), reason="needs the measured data beside the checkout")
@pytest.mark.parametrize(
    "path",
    [
        *(pytest.param(path, marks=pytest.mark.study) for path in sorted(VEHICLES.glob("*.dbc"))[1:]),
        *(*sorted(VEHICLES.glob("*.dbc"))[:1], *PEERS),
    ],
    ids=lambda path: path.stem,
)
def test_the_new_files_are_read_for_any_dbc_file(path, tmp_path, capsys):
    copy = Path(shutil.copy(path, tmp_path))
    try:
        database = load_dbc(copy)
    except InputError:
        assert main(["new", str(copy), "--out", str(tmp_path / "new")]) == 2
        return
    assert main(["new", str(copy), "--out", str(tmp_path / "new")]) == 0
    best = chosen(proposals(database))
    try:
        dialect = load_bench(tmp_path / "new" / "bench.yaml").dialect
    except InputError as error:
        refused = str(error)  # nothing is guessed, or our codec takes it of no bench file, whoever wrote it
        assert "twice" in refused or "name" in refused or ("no role is mapped" in refused and not best), refused
    else:
        assert {role for message in dialect.messages for role in message.roles} == set(best)
    assert len(best) <= sum(len(message.signals) for message in database.messages)
    said = capsys.readouterr().out
    assert path.parent != VEHICLES or "etb-hil plot LOG --bench" in said
    assert ("Proposals rest on" if proposals(database) else "No signal of this DBC file is about a throttle") in said
    assert_uncommented_lines_are_yaml((tmp_path / "new" / "bench.yaml").read_text())


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("MO3_DKW", ["mo", "3", "dkw"]),
        ("throttlePos2", ["throttle", "pos", "2"]),
        ("Motor_1", ["motor", "1"]),
        ("ECUTime", ["ecu", "time"]),
    ],
)
def test_names_are_cut_into_words(name, words):
    assert words_of(name) == words


def assert_uncommented_lines_are_yaml(text):
    """Take the # from each proposed line, then from all of them: each time the roles are a mapping."""
    lines = text.split("\n")
    proposed = [index for index, line in enumerate(lines) if line.startswith("  #") and not line.startswith("  # ")]
    for chosen_lines in [[], *([index] for index in proposed), proposed]:
        edited = [line.replace("#", "", 1) if i in chosen_lines else line for i, line in enumerate(lines)]
        roles = yaml.safe_load("\n".join(edited))["roles"] or {}
        assert len(roles) >= len(chosen_lines)
        assert roles.keys() <= ROLES.keys()


def database_of(*signals, message="Etc", bits=16):
    lines = "".join(
        f' SG_ {name} : {bits * i}|{bits}@1+ (1,0) [0|0] "{unit}" X\n' for i, (name, unit) in enumerate(signals)
    )
    return cantools.database.load_string(f'VERSION ""\nBU_: X\nBO_ 1 {message}: 8 X\n{lines}', "dbc")


@pytest.mark.parametrize(
    ("name", "unit", "role", "scale"),
    [
        ("ThrottlePosition", "deg", "throttle_angle", 0.017453292519943295),
        ("ThrottlePosition", "%", "throttle_opening", 0.01),
        ("TPS_Volt", "mV", "throttle_position", 1e-3),
        ("MotStrom", "mA", "motor_current", 1e-3),
        ("EngineSpeed", "1/min", "engine_speed", 0.10471975511965977),
    ],
)
def test_the_unit_tells_the_role_and_the_scale(name, unit, role, scale):
    found = proposals(database_of((name, unit)))
    assert list(found) == [role]
    assert found[role][0].scale == pytest.approx(scale)
    assert f"unit {found[role][0].unit}" in found[role][0].grounds


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("ThrottlePosition", ""),
        ("ThrottleError", "deg"),
        ("MotorCurrent", "V"),
        ("SteeringAngle", "deg"),
        ("DK", "km/h"),
        ("ThrottlePedalPos", "deg"),
        ("EGR_ValvePosition", "deg"),
    ],
)
def test_what_speaks_against_a_role_is_no_guess(name, unit):
    assert not proposals(database_of((name, unit)))


@pytest.mark.parametrize(
    ("name", "unit", "bits"),
    [
        ("AC_Compressor_Enable", "", 1),
        ("CatalystHeaterCurrent", "A", 16),
        ("ParkAngleRequest", "deg", 16),
        ("SteeringAngleCmd", "deg", 16),
        ("CruiseEnabled", "", 1),
        ("DriveMode", "", 4),
        ("FanDuty", "%", 16),
        ("HvBatteryVoltage", "V", 16),
        ("WheelEncoderAngle", "deg", 16),
        ("BrakePedalPosition", "%", 16),
        ("CoolantTemperature", "degC", 16),
        ("AbsErrors", "", 8),
        ("SampleCounter", "", 8),
    ],
)
@pytest.mark.parametrize("message", ["Engine_1", "EngineThrottle_2"])
def test_a_vehicles_other_units_are_not_proposed(name, unit, bits, message):
    lone = database_of((name, unit), message=message, bits=bits)
    assert not proposals(lone)
    beside = database_of(("ThrottlePosition", "%"), (name, unit), message=message, bits=max(bits, 7))
    assert set(proposals(beside)) <= {"throttle_opening"}


def test_a_strangers_controller_is_proposed_and_its_commands_are_not_active():
    text = """VERSION ""
BU_: ETC Bench
BO_ 16 Set: 8 Bench
 SG_ ModeCmd : 0|4@1+ (1,0) [0|3] "" ETC
 SG_ AngleCmd : 8|16@1- (0.01,0) [0|90] "deg" ETC
BO_ 32 Feedback: 8 ETC
 SG_ ThrottlePos : 0|16@1- (0.01,0) [0|90] "deg" Bench
 SG_ MotCurr : 16|16@1- (1,0) [0|9000] "mA" Bench
 SG_ RotorAngle : 32|12@1+ (0.087890625,0) [0|360] "deg" Bench
 SG_ BridgeActive : 48|1@1+ (1,0) [0|1] "" Bench
 SG_ ControlMode : 52|4@1+ (1,0) [0|3] "" Bench
"""
    found = proposals(cantools.database.load_string(text, "dbc"))
    best = chosen(found)
    assert set(best) == {"throttle_angle", "motor_current", "motor_angle", "enable"}
    assert best["motor_angle"][0].wraps  # 4096 counts are a turn
    assert found.keys() - best.keys() == {"mode", "command_mode", "command_position"}


SHORT_NAMES = """VERSION ""
BU_: ECU TST
BO_ 256 Cmd: 8 TST
 SG_ ModeReq : 0|8@1+ (1,0) [0|4] "" ECU
 SG_ AngSetp : 8|16@1- (0.01,0) [-10|100] "deg" ECU
BO_ 512 Fb1: 8 ECU
 SG_ SmpCnt : 0|16@1+ (1,0) [0|65535] "" TST
 SG_ MotCur : 16|16@1- (0.001,0) [-30|30] "A" TST
BO_ 513 Fb2: 8 ECU
 SG_ SmpCnt : 0|16@1+ (1,0) [0|65535] "" TST
 SG_ MotAng : 16|16@1+ (0.02197265625,0) [0|1440] "deg" TST
 SG_ PlateAng : 32|16@1- (0.01,0) [-10|100] "deg" TST
"""


def test_short_names_are_known_and_the_bench_passes_check_once_they_are_confirmed(tmp_path, capsys):
    dbc, folder = tmp_path / "short.dbc", tmp_path / "new"
    dbc.write_text(SHORT_NAMES)
    assert main(["new", str(dbc), "--out", str(folder)]) == 0
    said = capsys.readouterr().out
    assert "active    throttle_angle: Fb2.PlateAng" in said
    assert "confirm   sample_counter: Fb1.SmpCnt, Fb2.SmpCnt" in said
    assert "MISSING" not in said
    bench = folder / "bench.yaml"
    bench.write_text(re.sub(r"^  #(?! )", "  ", bench.read_text(), flags=re.MULTILINE))
    files = [str(folder / "scenario.yaml"), "--bench", str(bench), "--model", str(folder / "model.yaml")]
    assert main(["check", *files]) == 0, capsys.readouterr().out


def test_what_a_throttles_own_file_lacks_is_named(tmp_path, capsys):
    dbc = tmp_path / "short.dbc"
    dbc.write_text(re.sub(r".*(SmpCnt|MotAng|ModeReq).*\n", "", SHORT_NAMES))
    assert main(["new", str(dbc), "--out", str(tmp_path / "new")]) == 0
    said = capsys.readouterr().out
    assert all(f"MISSING   {role}" in said for role in ("sample_counter", "motor_angle", "command_mode"))
    assert "give a signal to each role that is MISSING" in said
    assert "vehicle" not in said


@given(st.lists(st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,20}", fullmatch=True), max_size=3, unique=True))
def test_whatever_the_names_the_bench_is_yaml(names):
    database = database_of(*((name, "") for name in ["Throttle", *names]))
    found = proposals(database)
    text = starting_files(Path("any.dbc"), Path("new"), database, found)["bench.yaml"]
    assert_uncommented_lines_are_yaml(text)


WITH_OTHERS = """VERSION ""
BU_: TC Rig Engine Body
BO_ 256 TC_Command: 8 Rig
 SG_ TC_Mode : 0|4@1+ (1,0) [0|3] "" TC
 SG_ TC_ThrottleSetpoint : 8|16@1- (0.01,0) [-10|100] "deg" TC
BO_ 512 TC_Feedback: 8 TC
 SG_ TC_SampleCounter : 0|16@1+ (1,0) [0|65535] "" Rig
 SG_ TC_MotorCurrent : 16|16@1- (0.001,0) [-30|30] "A" Rig
 SG_ ThrottleUmot : 32|16@1- (0.001,0) [-16|16] "V" Rig
BO_ 513 TC_Angles: 8 TC
 SG_ TC_SampleCounter : 0|16@1+ (1,0) [0|65535] "" Rig
 SG_ TC_MotorAngle : 16|16@1+ (0.02197265625,0) [0|1440] "deg" Rig
 SG_ TC_ThrottleAngle : 32|16@1- (0.01,0) [-10|100] "deg" Rig
BO_ 768 EngineData: 8 Engine
 SG_ EngineSpeed : 0|16@1+ (0.25,0) [0|16000] "rpm" TC
 SG_ AirConditioning_Enable : 16|1@1+ (1,0) [0|1] "" TC
 SG_ FanMotorCurrent : 24|16@1- (0.01,0) [0|50] "A" TC
BO_ 769 Lights: 8 Body
 SG_ LampCurrent : 0|16@1- (0.01,0) [0|50] "A" Rig
 SG_ LightMode : 16|4@1+ (1,0) [0|3] "" Rig
VAL_ 256 TC_Mode 0 "Off" 1 "Position" 2 "Voltage" ;
"""


def test_messages_of_other_units_hide_no_role_of_the_controller(tmp_path, capsys):
    (tmp_path / "tc.dbc").write_text(WITH_OTHERS)
    assert main(["new", str(tmp_path / "tc.dbc"), "--out", str(tmp_path / "new")]) == 0
    said = capsys.readouterr().out
    assert "MISSING" not in said
    assert "nothing can be run" not in said
    found = proposals(load_dbc(tmp_path / "tc.dbc"))
    of_controller = {role: {guess.signal.split(".")[0] for guess in found[role]} for role in found}
    assert of_controller.pop("engine_speed") == {"EngineData"}
    assert {name for names in of_controller.values() for name in names} <= {"TC_Command", "TC_Feedback", "TC_Angles"}
    assert "throttle_position" not in found  # ThrottleUmot is the motor's voltage
    assert [guess.signal for guess in found["motor_voltage"]] == ["TC_Feedback.ThrottleUmot"]
    assert_uncommented_lines_are_yaml((tmp_path / "new" / "bench.yaml").read_text())


def test_a_mode_with_other_numbers_says_so(tmp_path, capsys):
    (tmp_path / "tc.dbc").write_text(WITH_OTHERS)
    assert main(["new", str(tmp_path / "tc.dbc"), "--out", str(tmp_path / "new")]) == 0
    assert "command_mode: TC_Command.TC_Mode (its numbers are 0 off, 1 position, 2 voltage" in capsys.readouterr().out
    bench = " ".join((tmp_path / "new" / "bench.yaml").read_text().replace("\n  #", "").split())
    assert "0 off, 1 position, 2 voltage; the role's are 0 off, 1 position, 2 velocity, 3 voltage" in bench
    assert "command_mode" not in chosen(proposals(load_dbc(tmp_path / "tc.dbc")))


def test_a_file_without_nodes_is_judged_by_its_messages():
    text = re.sub(r"^(BO_ .*) \w+$", r"\1 Vector__XXX", WITH_OTHERS, flags=re.MULTILINE)
    found = proposals(
        cantools.database.load_string(re.sub(r" (TC|Rig)$", " Vector__XXX", text, flags=re.MULTILINE), "dbc")
    )
    assert {"throttle_angle", "motor_angle", "motor_current", "command_position", "command_mode"} <= found.keys()
    assert not any("Lamp" in guess.signal or "Fan" in guess.signal for role in found for guess in found[role])


def test_two_that_fit_equally_are_left_to_the_reader():
    found = proposals(database_of(("MotorCurrentA", "A"), ("MotorCurrentB", "A")))
    assert len(found["motor_current"]) == 2
    assert not chosen(found)


def test_nothing_is_written_over(tmp_path, capsys):
    dbc = str(find("dbc", "etb_controller"))
    assert main(["new", dbc, "--out", str(tmp_path)]) == 0
    (tmp_path / "bench.yaml").write_text("mine")
    assert main(["new", dbc, "--out", str(tmp_path)]) == 2
    assert (tmp_path / "bench.yaml").read_text() == "mine"
    assert "exists already" in capsys.readouterr().err


NOTHING_KNOWN = """VERSION ""
BS_:
BU_: ECU
BO_ 100 Foo: 8 ECU
 SG_ Bar : 0|8@1+ (1,0) [0|0] "" ECU
"""


def test_a_bench_without_a_guess_is_refused_until_a_role_is_written_into_it(tmp_path, capsys):
    (tmp_path / "any.dbc").write_text(NOTHING_KNOWN)
    bench, out = tmp_path / "new" / "bench.yaml", str(tmp_path / "out")
    assert main(["new", str(tmp_path / "any.dbc"), "--out", str(bench.parent)]) == 0
    log = tmp_path / "log.asc"
    frames = "".join(f"{k / 100:.6f} 1 64 Rx d 8 {k:02x}{' 00' * 7}\n" for k in range(200))
    log.write_text(f"base hex timestamps absolute\n{frames}")
    of_log = [str(log), "--bench", str(bench)]
    for words in (["plot", *of_log], ["replay", *of_log], ["explain", *of_log, "--model", "default", "--out", out]):
        assert main(words) == 2
        assert "roles: no role is mapped; write each below it, indented" in capsys.readouterr().err
    bench.write_text(bench.read_text().replace("roles:\n", "roles:\n  motor_current: Foo.Bar\n"))
    assert main(["plot", *of_log, "--out", str(tmp_path / "log.png")]) == 0
    assert "0 to 199 A" in capsys.readouterr().out
