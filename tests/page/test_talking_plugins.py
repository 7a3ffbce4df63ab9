"""A plug-in that prints does not disturb the page; one that ends its process is a stated error."""

import subprocess
import sys

import pytest

from etb_hil.base.stock import find

TALKS = """
import atexit, os
print("hello from the plug-in", flush=True)
os.write(1, b"hello from its library\\n")
atexit.register(print, "goodbye")
from etb_hil.plugins.readers import Reader
READER = Reader("mine", (".mine",), open)
"""


@pytest.fixture
def bench(tmp_path):
    """Return what writes a bench whose plug-in is this text."""

    def bench(text):
        (tmp_path / "talks_pd.py").write_text(text)
        path = tmp_path / "talking.bench.yaml"
        path.write_text(find("bench", "virtual_classic").read_text("utf-8") + "plugins: [talks_pd.py]\n")
        return path

    return bench


def served_once(bench, folder):
    return subprocess.run(
        [sys.executable, "-m", "etb_hil", "page", "--port", "0", "--bench", str(bench)],
        cwd=folder, capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip


def test_what_a_plugin_prints_goes_to_standard_error(bench, tmp_path):
    command = [sys.executable, "-m", "etb_hil", "page", "--port", "0", "--bench", str(bench(TALKS))]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as page:
        assert page.stdout.readline().startswith("http://127.0.0.1:")
        page.terminate()
        said = page.communicate(timeout=120)[1]
    for line in ("hello from the plug-in", "hello from its library", "goodbye"):
        assert line in said


def test_what_is_wrong_with_a_talking_plugin_is_told_at_the_end(bench, tmp_path):
    done = served_once(bench("print('hello')\n"), tmp_path)
    assert done.returncode == 2
    assert done.stderr.splitlines()[0] == "hello"
    assert "talks_pd.py: the file declares no part" in done.stderr.splitlines()[-1]


def test_a_survey_that_ends_early_is_a_stated_error(bench, tmp_path):
    done = served_once(bench("import os\nos._exit(3)\n"), tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("the bench cannot be surveyed: exit code 3")
    assert "Traceback" not in done.stderr
