"""A disk that is full or read-only: each command says so with the file's name and leaves no half file."""

import shutil
import subprocess
import sys

import output_study
import pytest

MOUNT = 'mount -t tmpfs -o "$1" none disk && shift && { head -c "$1" /dev/zero >disk/other; shift; "$@"; code=$?; }'
LISTED = "; find disk -type f -printf '%f %s\\n'; exit $code"
ALONE = ("unshare", "--mount")
# of each: the command, and how many of 300 kB other files take
COMMANDS = {
    "history": ("history sessions --out disk/new", 290),
    "export mf4": ("export SESSION disk/new.mf4", 290),
    "export db": ("export SESSION disk/new.db", 290),
    "export log": ("export SESSION disk/new.log", 290),
    "export parquet": ("export SESSION disk/new.parquet", 290),
    "plot": ("plot OTHER --roles motor_current --out disk/new.png", 290),
    "baseline": ("baseline SESSION --out disk/new.yaml", 300),
    "new": (f"new {output_study.CHECKOUT}/dbc/etb_controller.dbc --out disk/new", 300),
    "simulate csv": ("simulate paper_step --out disk/new.csv", 290),
    "simulate parquet": ("simulate paper_step --out disk/new.parquet", 290),
    "schema": ("schema scenario --out disk/new", 300),
    "replay": ("replay LOG --jobs 1 --out disk/new", 290),
    "run": ("run short.yaml --out disk/new", 300),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    if shutil.which("unshare") is None or subprocess.run([*ALONE, "true"], check=False, capture_output=True).returncode:
        pytest.skip("this user may not mount a small disk")
    folder = tmp_path_factory.mktemp("commands")
    output_study.prepare(folder)
    (folder / "disk").mkdir()
    return folder


def on_disk(folder, name, *, options, taken_kb):
    """Run a command beside a small disk; return exit code, errors, and the sizes of the files that it left there."""
    words = output_study.words_of(folder, COMMANDS[name][0])
    script = ["bash", "-c", MOUNT + LISTED, "bash", options, f"{taken_kb}k"]
    command = [*ALONE, *script, sys.executable, "-m", "etb_hil", *words]
    done = subprocess.run(command, cwd=folder, check=False, capture_output=True, text=True)
    listed = [line.split() for line in done.stdout.splitlines()]
    left = {entry[0]: int(entry[1]) for entry in listed if len(entry) == 2 and entry[1].isdigit()}
    return done.returncode, done.stderr, left


@pytest.mark.parametrize("name", COMMANDS)
def test_a_full_disk_keeps_no_half_file(folder, name):
    code, said, left = on_disk(folder, name, options="size=300k", taken_kb=COMMANDS[name][1])
    assert code == 2
    assert "Traceback" not in said
    assert "disk/new" in said
    assert "No space left on device" in said or "disk is full" in said
    whole = {"other", "history.csv", "history.json", "progress.jsonl", "state.json"}
    assert left.keys() <= whole, left
    assert all(left.values()), left


# A read-only disk is met where a full one is: three ways to write here, all commands every night.
@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[] if name in {"export mf4", "plot", "run"} else pytest.mark.study) for name in COMMANDS],
)
def test_a_read_only_disk_is_named(folder, name):
    code, said, left = on_disk(folder, name, options="size=300k,ro", taken_kb=0)
    assert code == 2
    assert "Traceback" not in said
    assert "disk/new" in said
    assert "Read-only file system" in said
    assert not left
