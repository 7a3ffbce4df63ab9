"""Units of a DBC file are the same for `new`, `check` and exports, however the file is encoded."""

import numpy as np
import pytest

from etb_hil.base.errors import InputError
from etb_hil.bench.bench_file import load_bench
from etb_hil.canio.dbc.dbc_file import load_dbc
from etb_hil.canio.dbc.role_proposals import chosen, proposals
from etb_hil.cli.main import main
from etb_hil.recording.tables import read_table

HEAD = 'VERSION ""\nNS_ :\nBS_:\nBU_: A B\nBO_ 256 Etb: 8 A\n'
SIGNALS = (
    ' SG_ ThrottleAngle : 0|16@1- (0.01,0) [0|0] "°" B\n'
    ' SG_ Temperature : 16|16@1- (0.1,0) [0|0] "°C" B\n'
    ' SG_ Torque : 32|16@1- (0.001,0) [0|0] "N·m" B\n'
)
COMMENT = 'CM_ SG_ 256 ThrottleAngle "Öffnung der Klappe";\n'
LOG = "".join(f"(1700000000.{k:03d}000) can0 100#{100 + k:02X}0{k % 2}FA0000000000\n" for k in range(50))
IN_TWO = (HEAD + SIGNALS).encode() + COMMENT.encode("cp1252")
ENCODED = {
    "UTF-8": (HEAD + SIGNALS + COMMENT).encode(),
    "UTF-8 with a byte order mark": (HEAD + SIGNALS + COMMENT).encode("utf-8-sig"),
    "Windows' code page": (HEAD + SIGNALS + COMMENT).encode("cp1252"),
    "one line in another encoding": IN_TWO,
}


@pytest.mark.parametrize("content", ENCODED.values(), ids=ENCODED.keys())
@pytest.mark.parametrize("newline", [b"\n", b"\r\n"], ids=["LF", "CRLF"])
def test_units_and_comments_are_those_that_were_written(content, newline, tmp_path):
    path = tmp_path / "a.dbc"
    path.write_bytes(content.replace(b"\n", newline))
    (message,) = load_dbc(path).messages
    assert [signal.unit for signal in message.signals] == ["°", "°C", "N·m"]
    assert message.get_signal_by_name("ThrottleAngle").comment == "Öffnung der Klappe"


@pytest.mark.parametrize("content", ENCODED.values(), ids=ENCODED.keys())
def test_a_proposed_bench_is_read_and_so_are_the_exports(content, tmp_path, monkeypatch):
    pytest.importorskip("pyarrow")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.dbc").write_bytes(content)
    (tmp_path / "a.log").write_text(LOG)
    assert main(["new", "a.dbc", "--out", "bench"]) == 0
    roles = load_bench(tmp_path / "bench" / "bench.yaml").bench.roles
    assert roles.keys() == {"throttle_angle", "temperature"}
    assert main(["export", "a.log", "a.parquet", "--dbc", "a.dbc"]) == 0
    recording = read_table(tmp_path / "a.parquet")
    assert np.allclose(recording.series("temperature").values, 25.0)
    assert np.isclose(recording.series("throttle_angle").values[0], np.radians(1.0))


@pytest.mark.parametrize(
    ("name", "role", "unit", "scale"),
    [
        ("motor_voltage", "motor_voltage", "Volts", 1.0),
        ("motor_current", "motor_current", "Ampere", 1.0),
        ("temperature", "temperature", "Â°C", 1.0),
        ("throttle_angle", "throttle_angle", "Grad", np.pi / 180.0),
        ("supply_voltage", "supply_voltage", "Unit_Volt", 1.0),
    ],
)
def test_every_spelling_that_is_proposed_is_read(name, role, unit, scale, tmp_path, monkeypatch):
    """A unit that `new` knows is none that `check` and the export's reader refuse."""
    pytest.importorskip("pyarrow")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.dbc").write_text(f'{HEAD} SG_ {name} : 0|16@1- (1,0) [0|0] "{unit}" B\n', "utf-8")
    (tmp_path / "a.log").write_text(LOG)
    assert role in chosen(proposals(load_dbc(tmp_path / "a.dbc")))
    assert main(["new", "a.dbc", "--out", "bench"]) == 0
    assert role in load_bench(tmp_path / "bench" / "bench.yaml").bench.roles
    assert main(["export", "a.log", "a.parquet", "--dbc", "a.dbc"]) == 0
    assert np.isclose(read_table(tmp_path / "a.parquet").series(role).values[0], 100.0 * scale)


@pytest.mark.parametrize("order", ["utf-16-le", "utf-16-be"])
def test_utf_16_is_named(order, tmp_path):
    path = tmp_path / "a.dbc"
    path.write_bytes(("\N{ZERO WIDTH NO-BREAK SPACE}" + HEAD + SIGNALS).encode(order))
    with pytest.raises(InputError, match=r"a\.dbc: is UTF-16 text .*save the file as UTF-8"):
        load_dbc(path)
