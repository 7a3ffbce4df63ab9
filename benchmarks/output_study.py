"""Exit codes of all commands where their output is lost: full disk, closed pipe, an encoding that lacks characters.

    python benchmarks/output_study.py                # a table of all commands
    python benchmarks/output_study.py replay plot    # of these alone

Right is the exit code that the command has on a terminal; 2 where the text of a command that judges nothing is lost on
a full disk. A traceback is wrong everywhere.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[1]
STATION = CHECKOUT / "docs/examples/line.station.yaml"
SHORT = """schema: etb_hil/scenario/1
name: Short
phases:
  - {id: zero, kind: current_zero, duration: 0.3 s}
"""
# command line by name; SESSION, OTHER and LOG are of a unit that failed
COMMANDS = {
    "run": "run --unit faulty --out runs",
    "run --json -": "run --unit faulty --out runs --json -",
    "run --batch": "run short.yaml --batch --out runs",
    "replay SESSION": "replay SESSION",
    "replay --against": "replay LOG --against SESSION",
    "replay LOG": "replay LOG",
    "replay LOG --channel": "replay LOG --channel 0 --channel 0",
    "replay LOGS": "replay LOG SESSION --jobs 2 --out tables",
    "baseline": "baseline SESSION --out baseline.yaml",
    "export": "export SESSION signals.mf4",
    "plot": "plot OTHER --roles motor_current --out current.png",
    "explain": "explain OTHER --model default --out explained",
    "isolability": "isolability default paper_step",
    "station": "station line.yaml --out runs",
    "history": "history sessions",
    "new": f"new {CHECKOUT}/dbc/etb_controller.dbc --out new",
    "check": "check",
    "simulate": "simulate paper_step --out simulated.csv",
    "reproduce": "reproduce --out figures",
    "schema": "schema scenario",
    "completion": "completion bash",
    "--help": "--help",
}
USUAL = {  # exit codes on a terminal, where they are not 0
    "run": 10, "run --json -": 10, "run --batch": 4, "replay SESSION": 10, "replay --against": 10, "replay LOG": 10,
    "replay LOG --channel": 10, "replay LOGS": 10, "explain": 4, "station": 3,
}  # fmt: skip
JUDGE_NOTHING = {
    "baseline", "export", "plot", "isolability", "history", "new", "simulate", "reproduce", "schema", "completion",
    "--help",
}  # fmt: skip
WAYS = {
    "usual": ("file", "utf-8"),
    "full disk": ("full disk", "utf-8"),
    "closed pipe": ("closed pipe", "utf-8"),
    "| head -1": ("head", "utf-8"),
    "cp932": ("file", "cp932"),
    "ascii": ("file", "ascii"),
}

HEAVY = {"explain", "isolability", "reproduce"}


def prepare(folder):
    """Make the files that the commands read: two sessions of a faulty unit, a station, a short scenario."""
    for scenario in ("friction_check", "paper_step"):
        words = ["run", scenario, "--unit", "faulty", "--out", "sessions"]
        subprocess.run([sys.executable, "-m", "etb_hil", *words], cwd=folder, check=False, capture_output=True)
    (folder / "short.yaml").write_text(SHORT)
    shutil.copyfile(STATION, folder / "line.yaml")


def words_of(folder, line):
    """Return the words of a command line, with the paths that SESSION, OTHER and LOG stand for."""
    session, other = (next((folder / "sessions").glob(f"*{kind}*")) for kind in ("friction-check", "steps"))
    places = {"SESSION": session, "OTHER": other, "LOG": session / "raw.blf"}
    return [str(places.get(word, word)) for word in line.split()]


def outcome(folder, name, sink="file", encoding="utf-8"):
    """Return the exit code of a command whose output goes into a sink of SINKS, and what standard error says."""
    shutil.rmtree(folder / "new", ignore_errors=True)  # two commands write over nothing
    (folder / "baseline.yaml").unlink(missing_ok=True)
    command = [sys.executable, "-m", "etb_hil", *words_of(folder, COMMANDS[name])]
    with ExitStack() as opened:
        if sink == "full disk":
            out = opened.enter_context(Path("/dev/full").open("wb"))
        elif sink == "closed pipe":
            reading, out = os.pipe()
            opened.callback(os.close, out)
            os.close(reading)
        else:
            out = subprocess.PIPE
        if sink == "head":
            command = ["bash", "-c", '"$@" | head -1; exit ${PIPESTATUS[0]}', "bash", *command]
        environment = {**os.environ, "PYTHONIOENCODING": encoding}
        done = subprocess.run(
            command, cwd=folder, input=b"A-1\n", stdout=out, stderr=subprocess.PIPE, env=environment, check=False
        )
    return done.returncode, done.stderr.decode(errors="replace")


def is_right(name, sink, code, said):
    """Return whether a command ended as it has to."""
    usual = USUAL.get(name, 0)
    right = 2 if sink == "full disk" and name in JUDGE_NOTHING else usual
    return code == right and "Traceback" not in said and "Exception ignored" not in said


def main():
    chosen = [name for name in COMMANDS if len(sys.argv) < 2 or name.split()[0] in sys.argv[1:]]
    print(f"{'command':22}", *(f"{way:>12}" for way in WAYS))
    wrong = 0
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        prepare(folder)
        for name in chosen:
            cells = []
            for sink, encoding in WAYS.values():
                code, said = outcome(folder, name, sink, encoding)
                right = is_right(name, sink, code, said)
                wrong += not right
                cells.append(f"{code}{' trace' if 'Traceback' in said else ''}{'' if right else ' !'}")
            print(f"{name:22}", *(f"{cell:>12}" for cell in cells), flush=True)
    print(f"{wrong} wrong")
    return wrong > 0


if __name__ == "__main__":
    sys.exit(main())
