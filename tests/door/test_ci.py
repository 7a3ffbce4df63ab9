"""What a newcomer types is what CI checks."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).resolve().parents[2]
GATE = (CHECKOUT / ".ci" / "run").read_text()


def test_the_readme_has_one_test_command_that_the_gate_finds():
    pattern = re.search(r"grep -m1 -e '([^']+)' README\.md", GATE)
    assert pattern is not None
    found = [line.strip() for line in (CHECKOUT / "README.md").read_text().splitlines() if re.search(pattern[1], line)]
    install = "python3 -m venv .venv && .venv/bin/pip install -q -e '.[test]'"
    assert found == [f"{install} && .venv/bin/python -m pytest -n 3 --dist loadfile"]


@pytest.mark.parametrize("name", ["run", "lowest", "nightly", "study"])
def test_a_script_is_valid_bash_and_executable(name):
    assert subprocess.run(["bash", "-n", CHECKOUT / ".ci" / name], check=False).returncode == 0
    assert (CHECKOUT / ".ci" / name).stat().st_mode & 0o111


def test_the_gate_names_no_machine_and_no_package_host():
    assert not re.findall(r"https?://|--index-url|--extra-index-url", GATE)
    assert set(re.findall(r"(?<![\w.}/$])/[a-z][\w/.-]*", GATE)) <= {"/usr/bin/env", "/dev/null", "/run/sshd"}
