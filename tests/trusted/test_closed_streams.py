"""A run whose input, output and errors were closed (`<&- >&- 2>&-`), as a careless service does."""

import json
import subprocess
import sys

import can

from etb_hil.results.json_file import result_from_dict

SCENARIO = """schema: etb_hil/scenario/1
name: Short
phases:
  - {id: zero, kind: current_zero, duration: 0.3 s}
"""


def test_what_a_run_prints_goes_nowhere_and_never_into_its_files(tmp_path):
    (tmp_path / "short.yaml").write_text(SCENARIO)
    command = ["bash", "-c", 'exec "$@" <&- >&- 2>&-', "bash", sys.executable, "-m", "etb_hil", "run", "short.yaml"]
    assert subprocess.run(command, cwd=tmp_path, check=False, timeout=300).returncode == 4
    (session,) = (path.parent for path in tmp_path.glob("sessions/*/session.json"))
    with can.BLFReader(session / "raw.blf") as log:
        assert len(list(log)) > 100
    assert result_from_dict(json.loads((session / "results.json").read_text())).bench.outcome == "ok"
    assert (session / "report.html").is_file()
