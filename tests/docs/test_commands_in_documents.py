"""Every command that the documents show is run as printed, or, for a stated reason, held against the real options."""

import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import documents
import pytest

from etb_hil.cli.main import COMMANDS, _parser, main

# Pages whose commands are no session of one reader: each is held against the command's options alone.
NO_SESSION = {"README", "CHANGELOG", "CONTRIBUTING", "SECURITY", "at_the_bench", "page", "own_controller"}
RUN = [page for page in documents.PAGES if documents.DOCS / "decisions" not in page.parents]
RUN = [page for page in RUN if page.stem not in NO_SESSION and {*documents.typed(page)} & {*documents.blocks(page)}]
FOREIGN = ["can_passat/passat-idling.trc", "can_passat/vw_pq.dbc", "etb_tbcp/tbcp_open_loop_duty_staircase.csv"]
DATA = Path(os.environ.get("ETB_HIL_REAL_DATA", documents.CHECKOUT.parent / "shared" / "data"))
LONG = {"first_explanation"}  # two explanations take a minute: .ci/study runs the page
EXIT_CODES = {
    "etb-hil run --serial A-002 --unit faulty": 10,
    "etb-hil replay sessions/*a-002": 10,
    "etb-hil replay sessions/*a-002 --limits dv_e5": 10,
    "etb-hil check my_controller/scenario.yaml --bench my_controller/faulty.yaml --model my_controller/model.yaml": 2,
    "etb-hil replay sessions/*r-1 --limits dv_e5 --model dv_e5": 4,  # which this unit is not
    "etb-hil station line.station.yaml": 3,  # before the golden unit
    "etb-hil run --bench virtual_uds --unit faulty": 10,
}
NOT_RUN = {
    "etb-hil run --station line.station.yaml --batch": "waits for serial numbers: tests/cli drives it in a terminal",
    "etb-hil replay sessions/*r-1 --onto vcan_classic": "needs a kernel with vcan: tests/vcan",
    "etb-hil reproduce --out reproduction": "tests/paper/test_reproduction.py",
    "etb-hil isolability default friction_check": "takes minutes: tests/discrepancy/test_isolability.py",
}


# What stands in a page as code of its own and is no command of `etb-hil` on a page of `RUN`: where it is run.
ELSEWHERE = {
    "python3 -m venv .venv && .venv/bin/pip install -q . && .venv/bin/etb-hil run": ".ci/run",
    "python3 -m venv .venv && .venv/bin/pip install -q -e '.[test]'": ".ci/run",
    "python3 -m venv .venv && . .venv/bin/activate": ".ci/run",
    "python3 -m venv .venv": ".ci/run",
    ".venv/bin/pip install -q -e '.[dev]'": ".ci/run",
    "pip install": ".ci/run",
    "python benchmarks/fuzz.py": "tests/trusted/test_fuzz.py",
    "python benchmarks/fuzz_coverage.py": "benchmarks/fuzz_coverage.py",  # needs atheris; its options are checked below
    "python benchmarks/faults_": "benchmarks/faults_study.py",  # hours; its options are checked below
    "./pipeline.sh": "tests/cli/test_ci_example.py",
    "etb-hil run --batch": "tests/cli",
    "etb-hil completion bash": "tests/cli/test_completion.py",
    "etb-hil controller --bench vcan_classic": "tests/vcan",
    "etb-hil run --bench vcan_classic": "tests/vcan",
    "etb-hil page": "tests/page",
}


@pytest.mark.parametrize("page", documents.PAGES, ids=lambda page: page.stem)
def test_every_command_in_a_block_is_run_here_or_elsewhere(page):
    for line in documents.executed(page):
        is_run = page in RUN and re.match(r"(?:etb-hil|grep|cat) ", line)
        is_form = re.search(r" (?:[A-Z]+\b(?!-)|\[)", line)  # with placeholders: its options are checked below
        where = next((path for begin, path in ELSEWHERE.items() if line.startswith(begin)), None)
        assert is_run or is_form or where, (page.name, line)
        assert where is None or (documents.CHECKOUT / where).exists(), where


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, id=page.stem, marks=[pytest.mark.study] if page.stem in LONG else []) for page in RUN],
)
def test_a_page_as_its_reader_types_it(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for name, text in documents.files(page).items():
        (tmp_path / name).write_text(text, "utf-8")
    shutil.copy(documents.CHECKOUT / "dbc" / "etb_controller.dbc", tmp_path / "my_controller.dbc")
    for example in (documents.DOCS / "examples").glob("*.yaml"):
        shutil.copy(example, tmp_path)
    if page.stem == "other_data":
        if not DATA.is_dir():
            pytest.skip("no measured data beside the checkout (ETB_HIL_REAL_DATA)")
        for name in FOREIGN:
            shutil.copy(DATA / name, tmp_path)
    commands = documents.typed(page)
    assert commands
    for command in commands:
        if command in NOT_RUN:
            continue
        if not command.startswith("etb-hil "):
            subprocess.run(["bash", "-c", command], check=True)
            continue
        words = [path for word in shlex.split(command)[1:] for path in expanded(word, tmp_path)]
        if words[0] == "run":
            words.append("--yes")  # nobody sits at a test
        code = main(words)
        told = capsys.readouterr()
        assert code == EXIT_CODES.get(command, 0), (command, told.out[-2000:], told.err[-2000:])


def expanded(word, folder):
    """Return what a shell makes of a word."""
    found = sorted(str(path.relative_to(folder)) for path in folder.glob(word)) if "*" in word else [word]
    assert found, word
    return found


def test_the_first_command_of_the_readme(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    first = next(line for line in documents.executed(documents.CHECKOUT / "README.md") if "etb-hil run" in line)
    commands = re.findall(r"\.venv/bin/etb-hil ([^&]+)", first)
    assert [main([*shlex.split(command), "--yes"]) for command in commands] == [0, 10]


BENCHMARK = re.compile(r"(?:python |`)(?:benchmarks/)?([a-z_]+\.py)((?: [^`\n|]*)?)")


@pytest.mark.parametrize("page", [*documents.PAGES, *documents.RESULTS], ids=lambda page: page.stem)
def test_every_benchmark_and_option_that_a_page_names_is_there(page):
    for name, rest in BENCHMARK.findall(page.read_text("utf-8")):
        path = documents.CHECKOUT / "benchmarks" / name
        options = re.findall(r"(?<![\w-])--[a-z][a-z-]*", rest)
        if path.exists() or f"python benchmarks/{name}" in page.read_text("utf-8"):
            assert [option for option in options if f'"{option}"' not in path.read_text("utf-8")] == [], name


@pytest.mark.parametrize("page", documents.PAGES, ids=lambda page: page.stem)
def test_every_command_and_option_that_a_page_names_is_there(page):
    for command, rest in documents.shown(page):
        assert command in COMMANDS, (page.name, command)
        choices = next(action for action in _parser(command)._actions if action.dest == "command").choices
        options = {option for action in choices[command]._actions for option in action.option_strings}
        for option in re.findall(r"(?<![\w-])--[a-z][a-z-]*", rest):
            assert option in options, (page.name, command, option)
        if rest and "--" not in rest and not re.search(r"[A-Z\[<{*.]", rest):
            choices[command].parse_args(shlex.split(rest))  # whole, without placeholders


def test_what_is_not_run_still_stands_in_a_page():
    every = {command for page in documents.PAGES for command in documents.typed(page)}
    assert NOT_RUN.keys() | EXIT_CODES.keys() <= every
