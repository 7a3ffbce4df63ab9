"""Tab completes commands, options and stock names: asked as a shell asks."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from terminal import Terminal

from etb_hil.cli.main import COMMANDS, main


def offered(tmp_path, line):
    answer = tmp_path / "answer"
    environment = {
        **os.environ, "_ARGCOMPLETE": "1", "_ARGCOMPLETE_IFS": "\n", "_ARGCOMPLETE_STDOUT_FILENAME": str(answer),
        "_ARGCOMPLETE_SUPPRESS_SPACE": "1", "COMP_LINE": line, "COMP_POINT": str(len(line)),
    }  # fmt: skip
    subprocess.run([sys.executable, "-m", "etb_hil.cli.main"], env=environment, cwd=tmp_path, check=False)
    return answer.read_text().split("\n")


def test_commands_options_and_names_are_offered(tmp_path):
    (tmp_path / "virtual_mine.yaml").touch()
    assert set(COMMANDS) <= set(offered(tmp_path, "etb-hil "))
    assert {"--bench", "--batch", "--baseline"} <= set(offered(tmp_path, "etb-hil run --b"))
    benches = set(offered(tmp_path, "etb-hil run --bench virtual_"))
    assert {"virtual_classic", "virtual_fd", "virtual_mine.yaml"} <= benches
    assert "faulty" in offered(tmp_path, "etb-hil check --unit f")
    assert "friction_check" in offered(tmp_path, "etb-hil run fri")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_each_shell_gets_a_script(shell, capsys):
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert "etb-hil" in script
    if program := shutil.which(shell):
        checked = subprocess.run([program, "-n"], input=script, capture_output=True, text=True, check=False)
        assert checked.returncode == 0, checked.stderr


def test_files_of_another_kind_and_commands_before_ours_are_left_out(tmp_path):
    (tmp_path / "friction_plot.png").touch()
    (tmp_path / "friction_mine.yml").touch()
    found = {name for name in offered(tmp_path, "cd here && etb-hil run fri") if name}
    assert {name.strip() for name in found} == {"friction_check", "friction_mine.yml"}


def with_ours_first():
    """Return the environment in which `etb-hil` is this one."""
    return {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}


@pytest.mark.skipif(shutil.which("fish") is None, reason="no fish on this machine")
def test_fish_completes(tmp_path):
    script = 'etb-hil completion fish | source; complete -C "etb-hil run --bench virtual_c"; complete -C "etb-hil his"'
    command = ["fish", "--no-config", "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path, env=with_ours_first())
    assert [line.partition("\t")[0] for line in done.stdout.split("\n") if line] == ["virtual_classic", "history"]


@pytest.mark.skipif(shutil.which("zsh") is None, reason="no zsh on this machine")
def test_zsh_completes(tmp_path):
    terminal = Terminal(tmp_path, "zsh", "-f", "-i", PS1="> ", PATH=with_ours_first()["PATH"])
    terminal.until(">")
    terminal.press('autoload -U compinit; compinit -u -D; eval "$(etb-hil completion zsh)"; echo re""ady\n')
    terminal.until("\nready")
    terminal.press("true; etb-hil run --bench virtual_c\t")
    terminal.until("true; etb-hil run --bench virtual_classic")
    terminal.press(" fri\t")
    terminal.until("virtual_classic  friction_check" if "classic  " in terminal.text else "classic friction_check")
    terminal.press("\x15exit\n")
    assert terminal.end() == 0


def test_bash_completes(tmp_path):
    script = (
        'eval "$(etb-hil completion bash)"\n'
        'COMP_LINE="etb-hil run --bench virtual_c"; COMP_POINT=${#COMP_LINE}; COMP_TYPE=9\n'
        "COMP_WORDS=(etb-hil run --bench virtual_c); COMP_CWORD=3\n"
        '_python_argcomplete etb-hil; echo "<${COMPREPLY[*]}>"\n'
    )
    command = ["bash", "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path, env=with_ours_first())
    assert done.stdout.strip() == "<virtual_classic >"
