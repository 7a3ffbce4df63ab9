"""Whatever is in a file, reading it ends soon, in an answer or in an error that names the file."""

import json
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest
from faults_study import job_of
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from etb_hil.base.errors import EtbHilError, InputError
from etb_hil.base.stock import find
from etb_hil.bench.bench_file import load_bench
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.bench.preflight import check_scenario
from etb_hil.canio.logs.reading import read_log
from etb_hil.cli.main import main
from etb_hil.diagnosis.limits_file import load_limits
from etb_hil.plant.parameters import load_model
from etb_hil.replays.session_replay import replay
from etb_hil.report.html_report import write_report
from etb_hil.scenario.scenario_file import load_scenario

STOCK = {"scenario": "friction_check", "bench": "virtual_classic", "model": "default", "limits": "default"}
LOAD = {"scenario": load_scenario, "bench": load_bench, "model": load_model, "limits": load_limits}
SOON_S = 60.0  # of the processor: a reader that hangs takes longer

NASTY = [
    "", "~", "true", ".nan", ".inf", "-.inf", "1e999", "1e-320", "-1", "0", "9" * 400, "0x" + "f" * 400,
    "0o" + "7" * 400, "nan s", "inf rad", "1e400 A", "-5 deg", "1 furlong", "[1 deg, 2 deg]", "[]", "{}",
    "{a: {b: {c: 1}}}", "x" * 3000, "'../../../../etc/passwd'", "/dev/zero", "/", "<script>alert(1)</script>",
    "'\"\"'", "&a 1", "*a", "!!python/name:os.system 1", "!!binary aGFsbG8=", "|\n  text", "2026-11-20", "1:30",
    "off", "\t", "\x00", "\x1b[2J", "\ufeff", "🙂", "% s", "1 s s",
]  # fmt: skip

bytes_of_any_kind = st.one_of(
    st.binary(max_size=300),
    st.text(max_size=300).map(lambda text: text.encode("utf-8", "surrogatepass")),
    st.sampled_from(
        [b"", b"\x00" * 5000, b"[" * 100_000, b"a: " * 50_000, b"- " * 3000, b"&a [*a]", b"\xff\xfe\x00\x00"]
    ),
)


def changed(text):
    """Strategies for a text with some of its lines changed."""
    lines = text.splitlines()
    edit = st.tuples(st.integers(0, len(lines) - 1), st.sampled_from(["value", "drop", "twice", "indent", "key"]))
    return st.lists(st.tuples(edit, st.sampled_from(NASTY)), min_size=1, max_size=3).map(lambda e: _edited(lines, e))


def _edited(lines, edits):
    lines = list(lines)
    for (row, how), value in edits:
        line = lines[row % len(lines)]
        head, colon, _ = line.partition(": ")
        lines[row % len(lines)] = {
            "value": f"{head}{colon}{value}",
            "drop": "",
            "twice": f"{line}\n{line}",
            "indent": f"   {line}",
            "key": f"{value}: {line.strip()}",
        }[how]
    return "\n".join(lines).encode("utf-8", "surrogatepass")


def ends_well(read, path):
    """Read; allow an answer, or an error of ours that names the file, soon."""
    begun = time.process_time()
    try:
        answer = read(path)
    except EtbHilError as error:
        answer, said = None, str(error)
        if not isinstance(error, InputError) or path.name not in said or "\x1b" in said:
            raise AssertionError(f"no clear error: {said}") from error
    assert time.process_time() - begun < SOON_S
    return answer


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("angle: [-3 deg, 87 deg]", "angle: [87 deg, -3 deg]", r"bench.yaml:9: limits.angle: the first angle must lie"),
        ("etb_virtual, channel: bench", "scketcan, channel: can0", r"yaml:3: bus.interface: no such .*'socketcan'"),
        ("dbc: etb_controller", "dbc: etb_contro", r"bench.yaml:4: dbc: no dbc file 'etb_contro'; allowed: a path"),
        ("1 Mbit/s", "100 kbit/s", r"bench.yaml:3: bus: the bus cannot carry this"),
    ],
)
def test_a_bench_that_cannot_be_is_refused_with_its_place(tmp_path, old, new, told):
    text = find("bench", STOCK["bench"]).read_text()
    assert old in text
    (tmp_path / "bench.yaml").write_text(text.replace(old, new))
    with pytest.raises(InputError, match=told):
        prepare(
            JobFiles(**{kind: find(kind, name) for kind, name in STOCK.items()} | {"bench": tmp_path / "bench.yaml"})
        )


def test_a_dbc_file_that_is_none_exports_nothing(tmp_path, session, capsys):
    (tmp_path / "any.dbc").write_text("no DBC file")
    out = tmp_path / "out.parquet"
    assert main(["export", str(session.session.folder), str(out), "--dbc", str(tmp_path / "any.dbc")]) == 2
    assert "any.dbc: cannot be read as a DBC file" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("kind", STOCK)
def test_files_that_people_write(tmp_path, kind):
    path = tmp_path / f"{kind}.yaml"
    original = find(kind, STOCK[kind]).read_text()
    setup, throttle = load_bench(find("bench", STOCK["bench"])), load_model(find("model", "default")).values

    @settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
    @given(st.one_of(bytes_of_any_kind, changed(original)))
    def reads(content):
        path.write_bytes(content)
        document = ends_well(LOAD[kind], path)
        if kind == "scenario" and document is not None:
            ends_well(lambda _: check_scenario(document, setup, throttle), path)

    reads()
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]


@pytest.mark.filterwarnings("ignore")
def test_dbc_files(tmp_path):
    path = tmp_path / "any.dbc"
    original = find("dbc", "etb_controller").read_text()
    bench = find("bench", "virtual_classic")

    @settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
    @given(st.one_of(bytes_of_any_kind, changed(original)))
    @example(original.replace(" SG_ MotorVoltage : 32|16", " SG_ MotorVoltage : 20|16").encode())  # overlaps
    @example(original.replace("EtbCurrent: 8", "EtbCurrent: 4").encode())
    @example(
        re.sub(r"^(BO_ .*)$", r"\1\n\1", original, flags=re.MULTILINE).encode()
    )  # each message twice, one of them empty
    @example(re.sub(r"^( SG_ .*)$", r"\1\n\1", original, flags=re.MULTILINE).encode())
    @example(original.replace("16|16@1-", "16|160@1-").encode())
    @example(original.replace("(0.001,0)", "(0,0)").encode())
    @example(original.replace("(0.001,0)", "(1e400,0)").encode())
    def reads(content):
        path.write_bytes(content)
        ends_well(lambda p: load_bench(bench, p), path)

    reads()


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    return execute(
        job_of("virtual_classic", "default", "paper_step"),
        tmp_path_factory.mktemp("run"),
        "<script>x</script>/../..",
        1,
    )


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("suffix", [".blf", ".asc", ".log", ".trc", ".csv", ".mf4", ".db", ".xyz"])
def test_logs(tmp_path, session, suffix):
    path = tmp_path / f"log{suffix}"
    raw = session.session.raw_log.read_bytes()[:60_000]

    def frames(p):
        return sum(len(block) for block in read_log(p))

    @settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
    @given(
        st.one_of(
            bytes_of_any_kind,
            st.integers(0, len(raw)).map(lambda cut: raw[:cut]),
            st.tuples(st.integers(0, 3000), st.binary(min_size=1, max_size=40)).map(
                lambda spoilt: raw[: spoilt[0]] + spoilt[1] + raw[spoilt[0] + len(spoilt[1]) :]
            ),
        )
    )
    def reads(content):
        path.write_bytes(content)
        ends_well(frames, path)

    reads()


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", ["session.json", "events.jsonl", "raw.blf"])
def test_sessions(tmp_path, session, name):
    folder = tmp_path / "session"
    shutil.copytree(session.session.folder, folder)
    original = (folder / name).read_bytes()[:40_000]
    lines = original.decode("latin-1")

    @settings(max_examples=15, deadline=None, suppress_health_check=list(HealthCheck))
    @given(
        st.one_of(
            bytes_of_any_kind,
            st.integers(0, len(original)).map(lambda cut: original[:cut]),
            changed(lines) if name != "raw.blf" else st.nothing(),
        )
    )
    def reads(content):
        (folder / name).write_bytes(content)
        try:
            replay(folder)
        except InputError as error:
            assert str(folder) in str(error)  # noqa: PT017 (an answer is right, too)

    reads()


def test_a_serial_number_can_do_no_harm(tmp_path, session):
    parent = session.session.folder.parent
    folders = {p.name for p in parent.iterdir() if p.is_dir()}
    assert folders - {"waiting_for_store"} == {session.session.folder.name}
    report = write_report(session.results, session.series, tmp_path)
    page = report.read_text()
    assert "<script>x" not in page
    assert "&lt;script&gt;x&lt;/script&gt;/../.." in page
    assert json.loads((session.session.folder / "session.json").read_text())["serial"] == "<script>x</script>/../.."


@pytest.mark.parametrize("name", ["a" * 5000, "a\x00b", "\udcff"])
@pytest.mark.parametrize("kind", [*STOCK, "dbc"])
def test_a_name_that_no_file_can_have_is_refused(kind, name):
    with pytest.raises(InputError, match=rf"no {kind} file .*; allowed: a path") as refused:
        find(kind, name)
    assert len(str(refused.value)) < 1000


@pytest.mark.parametrize("command", ["schema", "schema scenario"])
def test_a_reader_that_has_read_enough_is_no_error(command):
    words = [sys.executable, "-m", "etb_hil", *command.split()]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        assert not process.stderr.read()


@pytest.mark.parametrize("option", ["--json", "--junit"])
def test_a_device_is_not_taken_away_for_what_ci_reads(tmp_path, capsys, option):
    os.mkfifo(tmp_path / "device")
    assert main(["run", option, str(tmp_path / "device")]) == 2
    assert "must be a regular file" in capsys.readouterr().err
    assert (tmp_path / "device").is_fifo()


@pytest.mark.parametrize("path", ["/dev/zero", "/", "/dev/null", "/proc/self/mem", "no\x00name"])
@pytest.mark.parametrize("kind", STOCK)
def test_what_is_no_file_is_refused(kind, path):
    if not os.path.lexists("/dev/zero"):
        pytest.skip("no such devices on this system")
    with pytest.raises(InputError):
        LOAD[kind](Path(path))
