"""The Python of a how-to, run as printed, block after block."""

import re
import subprocess
import sys

import documents


def test_the_python_page_as_its_reader_types_it(tmp_path):
    text = (documents.DOCS / "howto" / "python.md").read_text("utf-8")
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert len(blocks) > 4
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(blocks)], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-3000:]
    assert "fail" in done.stdout
    assert "parameter:stiction" in done.stdout
    assert {path.name for path in tmp_path.iterdir()} >= {"signals.csv", "extended.yaml", "before_and_after.png"}
