"""Which options of `replay` go together, the edges of their values, and the files and units that they name."""

import argparse

import pytest
from whole_run import run_on

from etb_hil.base.errors import InputError
from etb_hil.base.outcome import ExitCode
from etb_hil.base.stock import find
from etb_hil.cli.replay import add_arguments
from etb_hil.cli.replay_options import (
    against_baseline,
    baseline_of,
    is_session,
    own_rules,
    require_that_fits,
    segment_length,
    units_of,
    window_of,
    worst,
)
from etb_hil.replays.window import Window


def options(words):
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    return parser.parse_args(words.split())


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Be in a folder with an empty session `s`."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s").mkdir()
    (tmp_path / "s" / "session.json").touch()
    return tmp_path


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    "words",
    [
        "a.blf --segment 1 --channel 0 --channel 255 --bench x --bench y --model m --limits l --observer o",
        "a.blf --window 0 0.1 --baseline b",
        "a.blf --segment 999999999 --window 3 999999999",
        "a.blf b.blf --join",
        "a.blf s --jobs 1 --bench virtual_fd --channel 3 --segment 5 --out o --window 0 1 --model m --limits l",
        "a.blf b.blf --dask tcp://host:1",
        "s --jobs 2",
        "s --window 0 1 --model m --limits l --observer o --baseline b --against s",
        "a.blf --against s --channel 3 --bench b --observer o --window 0 1 --baseline b --model m --limits l",
        "a.blf b.blf --against s --join",
        "a.blf --onto b --channel 2 --window 0 1",
        "a.blf s --onto b --join",
    ],
)
def test_what_goes_together(words):
    require_that_fits(options(words))


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("a.blf --segment 0.99", "--segment is too short"),
        ("a.blf --segment 1e9", "--segment is too short or too long"),
        ("a.blf --channel 256", "--channel is out of range (it is 256); allowed: 0 to 255"),
        ("a.blf --window 1 1", "--window must begin before it ends"),
        ("a.blf --window -1 1", "--window must begin before it ends"),
        ("a.blf --window 1 1e9", "--window must begin before it ends"),
        ("a.blf --jobs 1 --observer o", "--observer does not go with --jobs or --dask"),
        ("a.blf --dask x --baseline b", "--baseline does not go with --jobs or --dask"),
        ("s --jobs 1 --segment 5", "--segment: there are sessions alone"),
        ("s s --jobs 1 --channel 5 --bench b", "--bench, --channel: there are sessions alone"),
        ("a.blf --against s --bench a --bench b", "--against takes one unit (it is 2)"),
        ("a.blf --against s --bench a --bench b --channel 1 --channel 2 --channel 3", "takes one unit (it is 6)"),
        ("a.blf --onto b --jobs 2", "--jobs does not go with --onto"),
        ("a.blf --onto b --against s", "--against does not go with --onto"),
        ("a.blf s", "several sources; allowed: one"),
        ("s a.blf --join --model m", "--join does not go with a session"),
        ("a.blf s --join", "name its raw.blf, or judge each with --jobs"),
    ],
)
def test_what_does_not_go_together(words, says):
    with pytest.raises(InputError) as caught:
        require_that_fits(options(words))
    assert says in str(caught.value)


@pytest.mark.usefixtures("folder")
def test_everything_that_is_wrong_is_said_at_once():
    with pytest.raises(InputError) as caught:
        require_that_fits(options("a.blf b.blf --out o --segment 0 --channel -1 --channel 256"))
    said = [problem.what for problem in caught.value.problems]
    assert said == [
        "--out does not go with a log", "--segment is too short or too long", "--channel is out of range",
        "--channel is out of range", "several sources",
    ]  # fmt: skip


def test_a_session_is_known_by_its_manifest(folder):
    assert is_session(folder / "s")
    assert not is_session(folder)


def test_each_bench_is_judged_on_each_channel():
    units = units_of(options("a.blf --bench virtual_fd --bench virtual_classic --channel 4 --channel 0"))
    assert [(files.bench.stem, channel) for files, channel in units] == [
        ("virtual_fd", 4), ("virtual_fd", 0), ("virtual_classic", 4), ("virtual_classic", 0),
    ]  # fmt: skip


def test_a_log_is_judged_by_stock_files_unless_others_are_named():
    ((files, channel),) = units_of(options("a.blf --observer angle"))
    assert (files.bench, files.model, files.limits, files.dbc, files.observer, channel) == (
        find("bench", "virtual_classic"), find("model", "default"), find("limits", "default"),
        find("dbc", "etb_controller"), "angle", None,
    )  # fmt: skip
    ((files, _),) = units_of(options("a.blf --model faulty --limits dv_e5"))
    assert (files.model, files.limits) == (find("model", "faulty"), find("limits", "dv_e5"))
    assert own_rules(options("a.blf --limits dv_e5")) == (None, find("limits", "dv_e5"))


def test_the_plug_ins_of_a_bench_are_loaded_before_it_is_read(tmp_path):
    bench = tmp_path / "own.yaml"
    bench.write_text(find("bench", "virtual_classic").read_text("utf-8") + "plugins: [nosuch.py]\n", "utf-8")
    with pytest.raises(InputError, match=r"nosuch\.py"):
        units_of(options(f"a.blf --bench {bench}"))


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    """A short run whose model is another than the stock one."""
    folder = tmp_path_factory.mktemp("sessions")
    scenario = folder / "short.yaml"
    phases = "  - {id: zero, kind: current_zero, duration: 0.3 s}\n"
    scenario.write_text(f"schema: etb_hil/scenario/1\nname: short\nphases:\n{phases}")
    return run_on(folder, scenario=scenario, bench="virtual_fd")


def test_what_is_compared_is_judged_by_the_files_of_its_session(live):
    ((files, _),) = units_of(options(f"a.blf --against {live.session.folder}"))
    assert files.bench.is_relative_to(live.session.folder)
    assert files.limits.is_relative_to(live.session.folder)
    ((files, _),) = units_of(options(f"a.blf --against {live.session.folder} --bench virtual_classic"))
    assert files.bench == find("bench", "virtual_classic")
    ((files, _),) = units_of(options(f"a.blf --against {live.session.folder} --model faulty"))
    assert files.model == find("model", "faulty")


def test_without_a_baseline_an_exit_code_stays(live, tmp_path, capsys):
    assert baseline_of(options("a.blf")) is None
    assert against_baseline(None, live.results, 10) is ExitCode.UNIT_FAILED
    assert capsys.readouterr().out == ""
    path = tmp_path / "baseline.yaml"
    path.write_text("schema: etb_hil/baseline/1\nnumbers: {T_c: {value: 0.1 N·m, tolerance: 5 %}}\n")
    baseline = baseline_of(options(f"a.blf --baseline {path}"))
    assert against_baseline(baseline, live.results, 0) is ExitCode.INCONCLUSIVE
    assert "T_c" in capsys.readouterr().out


def test_times_are_taken_to_nanoseconds():
    assert window_of(options("a.blf")) is None
    assert window_of(options("a.blf --window 0.1 2.5")) == Window(100_000_000, 2_500_000_000)
    assert segment_length(options("a.blf")) == 60.0
    assert segment_length(options("a.blf --segment 7")) == 7.0


@pytest.mark.parametrize(
    ("codes", "expected"),
    [([2, 3], 2), ([3, 10], 3), ([4, 10], 10), ([5, 4], 4), ([0, 5], 5), ([0, 0], 0), (iter([0]), 0)],
)
def test_of_several_judgements_the_worst_counts(codes, expected):
    assert worst(codes) == expected
