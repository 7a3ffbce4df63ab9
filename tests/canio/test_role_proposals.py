"""What `etb-hil new` guesses of DBC files, ours, foreign and vehicles', and that a guess is never stated as certain."""

import os
import shutil
from pathlib import Path

import cantools
import pytest

from etb_hil.base.errors import InputError
from etb_hil.base.roles import COMMANDED
from etb_hil.base.stock import find
from etb_hil.bench.bench_file import load_bench
from etb_hil.canio.dbc.dbc_file import load_dbc
from etb_hil.canio.dbc.role_proposals import chosen, proposals, words_of
from etb_hil.cli.main import main

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
    measured = mapped.keys() - COMMANDED - {"sample_counter"}
    best = chosen(found)
    assert measured <= best.keys()
    assert not best.keys() & COMMANDED  # what moves something is never guessed into place


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
    found = proposals(load_dbc(VEHICLES / file))
    assert signal in [guess.signal for guess in found[role][:3]]
    assert not {"motor_angle", "throttle_angle", "command_mode"} & chosen(found).keys()  # a vehicle's bus has none


@pytest.mark.skipif(not VEHICLES.is_dir(), reason="needs the measured data beside the checkout")
@pytest.mark.parametrize("path", [*sorted(VEHICLES.glob("*.dbc")), *PEERS], ids=lambda path: path.stem)
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
    assert "These are guesses" in said


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


def database_of(*signals):
    lines = "".join(f' SG_ {name} : {16 * i}|16@1+ (1,0) [0|0] "{unit}" X\n' for i, (name, unit) in enumerate(signals))
    return cantools.database.load_string(f'VERSION ""\nBU_: X\nBO_ 1 Msg: 8 X\n{lines}', "dbc")


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
    assert "its unit is" in found[role][0].grounds


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("ThrottlePosition", ""),
        ("ThrottleError", "deg"),
        ("MotorCurrent", "V"),
        ("SteeringAngle", "deg"),
        ("DK", "km/h"),
    ],
)
def test_what_speaks_against_a_role_is_no_guess(name, unit):
    assert not proposals(database_of((name, unit)))


def test_two_that_fit_alike_are_left_to_the_reader():
    found = proposals(database_of(("MotorCurrentA", "A"), ("MotorCurrentB", "A")))
    assert len(found["motor_current"]) == 2
    assert not chosen(found)


def test_nothing_is_written_over(tmp_path, capsys):
    dbc = str(find("dbc", "etb_controller"))
    assert main(["new", dbc, "--out", str(tmp_path)]) == 0
    (tmp_path / "bench.yaml").write_text("mine")
    assert main(["new", dbc, "--out", str(tmp_path)]) == 2
    assert (tmp_path / "bench.yaml").read_text() == "mine"
    assert "is there already" in capsys.readouterr().err


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
        assert "bench.yaml:23: roles: no role is mapped; write each below it, indented" in capsys.readouterr().err
    bench.write_text(bench.read_text().replace("  # motor_current: Message.Signal", "  motor_current: Foo.Bar"))
    assert main(["plot", *of_log, "--out", str(tmp_path / "log.png")]) == 0
    assert "0 to 199 A" in capsys.readouterr().out


def test_a_confirmed_bench_of_our_own_controller_is_ready(tmp_path, capsys):
    """Do what the comments tell: take the # away, add the list of counters and the wrap, name the bus."""
    main(["new", str(find("dbc", "etb_controller")), "--out", str(tmp_path)])
    path = tmp_path / "bench.yaml"
    text = path.read_text().replace(
        "socketcan, channel: can0, bitrate: 500 kbit/s", "etb_virtual, channel: b, bitrate: 1 Mbit/s"
    )
    text = text.replace("  # command_", "  command_").replace("  # request_", "  request_")
    text = "\n".join(
        line for line in text.split("\n") if not line.startswith(("  command_", "  request_")) or "Etb" in line
    )
    text = text.replace("EtbEncoder.MotorAngle\n", "{signal: EtbEncoder.MotorAngle, wraps: true}\n")
    text += "  sample_counter: [EtbCurrent.CurrentSampleCounter, EtbEncoder.EncoderSampleCounter]\n"
    path.write_text(text)
    arguments = [
        "check",
        str(tmp_path / "scenario.yaml"),
        "--bench",
        str(path),
        "--model",
        str(tmp_path / "model.yaml"),
    ]
    assert main(arguments) == 0, capsys.readouterr().out
