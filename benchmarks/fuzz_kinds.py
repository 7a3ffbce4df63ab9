"""Every kind of file that users give: how a wrong one is made from a valid one, and the commands that read it.

A kind is a function of a generator, a folder and the `Seeds`; it writes the file and returns the words of a command,
and the exit code that its verdict had before it was changed, None where a change may well change it.
"""

import json
import shutil
import sqlite3
from dataclasses import dataclass

import fuzz_containers as containers
import numpy as np
from fuzz_mutations import changed_bytes, changed_json_lines, changed_json_text, changed_lines

from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, deliver, execute, prepare
from etb_hil.canio.frames import FrameFlag, concatenate_frames
from etb_hil.canio.logs.blf import read_blf
from etb_hil.canio.logs.writing import write_log
from etb_hil.replays.export import export

BENCH = "virtual_classic"
SHORT = 400  # frames of the logs that are only read
TEXT_LOGS, PACKED = (".asc", ".log", ".trc", ".csv"), (".asc", ".trc", ".blf", ".mf4", ".db")
TABLE = ["t_s", "motor_voltage_V", "throttle_angle_deg", "motor_current_A"]
CODES = {"default": 0, "faulty": 10}


@dataclass(frozen=True)
class Seeds:
    """Valid files: a session and logs of a unit that passes and of one that fails, short logs, and files of text."""

    sessions: dict
    logs: dict
    short: dict
    texts: dict


def seeds(folder):
    """Make the valid files in a folder."""
    sessions, logs, short = {}, {}, {}
    for unit in CODES:
        files = {"scenario": "friction_check", "bench": BENCH, "model": "default", "limits": "default", "unit": unit}
        job = JobFiles(**{key: find("model" if key == "unit" else key, name) for key, name in files.items()})
        prepared = prepare(job)
        session = execute(prepared, folder / unit, "A7", 3).session.folder
        deliver(prepared, folder / unit)
        sessions[unit] = session
        frames = concatenate_frames(read_blf(session / "raw.blf"))
        for suffix in (".blf", ".mf4", ".asc", ".log", ".csv", ".db"):
            export([frames], folder / f"{unit}{suffix}")
            logs[unit, suffix] = (folder / f"{unit}{suffix}").read_bytes()
        few = frames.select(slice(SHORT))
        few.flags[::50] |= np.uint8(FrameFlag.REMOTE)
        few.flags[1::50] |= np.uint8(FrameFlag.ERROR)
        for suffix in (".blf", ".mf4", ".asc", ".log", ".csv", ".db", ".trc"):
            log = write_log(folder / f"short{suffix}", int(few.stamp_ns[0]))
            log.write(few)
            log.close()
            short[suffix] = (folder / f"short{suffix}").read_bytes()
    stock = {"bench": BENCH, "scenario": "friction_check", "limits": "default", "model": "faulty"}
    texts = {kind: find(kind, name).read_text("utf-8") for kind, name in stock.items()}
    texts["dbc"] = find("dbc", "etb_controller").read_text("utf-8")
    time_s = np.arange(2000) * 1e-3
    rows = zip(time_s, np.sin(time_s) * 6, 20 + 10 * np.sin(time_s), np.cos(time_s), strict=True)
    texts["table"] = "\n".join([",".join(TABLE), *(",".join(f"{value:.6g}" for value in row) for row in rows), ""])
    return Seeds(sessions, logs, short, texts)


def _changed_log(rng, suffix, path, data):
    if suffix in TEXT_LOGS:
        path.write_bytes(changed_lines(rng, data.decode()).encode("utf-8", "surrogatepass"))
    elif suffix == ".db":
        containers.changed_sqlite(rng, path, data)
    else:
        path.write_bytes({".blf": containers.changed_blf, ".mf4": containers.changed_mf4}[suffix](rng, data))


def _log(suffix):
    def make(rng, folder, given):
        path, judged = folder / f"log{suffix}", rng.random() < 0.25 and suffix != ".trc"
        unit = rng.choice(list(CODES))
        _changed_log(rng, suffix, path, given.logs[unit, suffix] if judged else given.short[suffix])
        if judged or rng.random() < 0.3:
            return ["replay", str(path), "--bench", BENCH], CODES[unit] if judged else None
        out = rng.choice([".blf", ".mf4", ".asc", ".parquet", ".db"])
        words = ["export", str(path), str(folder / f"out{out}")]
        return [*words, *(["--dbc", str(find("dbc", "etb_controller"))] if out in {".parquet", ".mf4"} else [])], None

    return make


def _packed(rng, folder, given):
    suffix = rng.choice(PACKED)
    plain = folder / f"plain{suffix}"
    if rng.random() < 0.5:
        _changed_log(rng, suffix, plain, given.short[suffix])
    else:
        plain.write_bytes(given.short[suffix])
    path = folder / f"log{suffix}.gz"
    path.write_bytes(containers.changed_gzip(rng, plain.read_bytes()))
    return rng.choice([["replay", str(path), "--bench", BENCH], ["export", str(path), str(folder / "out.blf")]]), None


def _dbc(rng, folder, given):
    path = folder / "file.dbc"
    path.write_text(changed_lines(rng, given.texts["dbc"]), "cp1252", "replace")
    (folder / "log.blf").write_bytes(given.short[".blf"])
    bench = find("bench", BENCH).read_text("utf-8").replace("etb_controller", "file.dbc")
    (folder / "bench.yaml").write_text(bench, "utf-8")
    return rng.choice(
        [
            ["new", str(path), "--out", str(folder / "new")],
            ["export", str(folder / "log.blf"), str(folder / "out.mf4"), "--dbc", str(path)],
            ["check", "friction_check", "--bench", str(folder / "bench.yaml")],
            ["replay", str(folder / "log.blf"), "--bench", str(folder / "bench.yaml")],
        ]
    ), None


def _yaml(rng, folder, given):
    kind = rng.choice(["bench", "scenario", "limits", "model"])
    path = folder / f"{kind}.yaml"
    path.write_text(changed_lines(rng, given.texts[kind]), "utf-8", "surrogatepass")
    session = str(given.sessions["default"])
    check = ["check", "friction_check", "--bench", BENCH]
    words = {
        "bench": [["check", "friction_check", "--bench", str(path)], ["replay", "LOG", "--bench", str(path)]],
        "scenario": [["check", str(path), "--bench", BENCH], ["isolability", str(path)]],
        "limits": [["replay", "SESSION", "--limits", str(path)]],
        "model": [["replay", "SESSION", "--model", str(path)], [*check, "--unit", str(path)]],
    }
    (folder / "log.blf").write_bytes(given.short[".blf"])
    chosen = rng.choice(words[kind])
    if "SESSION" in chosen:
        shutil.copytree(session, folder / "session")
    places = {"LOG": str(folder / "log.blf"), "SESSION": str(folder / "session")}
    return [places.get(word, word) for word in chosen], None


def _session(rng, folder, given):
    unit = rng.choice(list(CODES))
    session = folder / "session"
    shutil.copytree(given.sessions[unit], session)
    path = session / rng.choice(
        ["session.json", "session.json", "results.json", "events.jsonl", "events.jsonl", "raw.blf", "inputs"]
    )
    if path.is_dir():
        path = rng.choice(sorted(path.iterdir()))
    if path.suffix == ".blf":
        path.write_bytes(containers.changed_blf(rng, path.read_bytes()))
    else:
        change = {".json": changed_json_text, ".jsonl": changed_json_lines}.get(path.suffix, changed_lines)
        path.write_text(change(rng, path.read_text("utf-8")), "utf-8", "surrogatepass")
    command = rng.choice(["replay", "replay", "replay", "export", "history", "baseline", "plot"])
    out = {
        "export": [str(folder / "out.blf")],
        "baseline": ["--out", str(folder / "baseline.yaml")],
        "plot": ["--out", str(folder / "x.svg")],
    }
    return [command, str(session), *out.get(command, [])], CODES[
        unit
    ] if command == "replay" and path.name == "raw.blf" else None


def _store(rng, folder, given):
    path = folder / "results.db"
    source = sqlite3.connect(given.sessions["default"].parent / "results.db")
    with sqlite3.connect(path) as database:
        for table in ("runs", "phases", "measurements", "alembic_version"):
            cursor = source.execute(f"SELECT * FROM {table}")  # noqa: S608
            names = [column[0] for column in cursor.description]
            if rng.random() < 0.1:
                names = names[: rng.randint(1, len(names))]
            database.execute(f"CREATE TABLE {table} ({', '.join(names)})")
            for row in cursor:
                values = [containers.odd_value(rng) if rng.random() < 0.1 else value for value in row[: len(names)]]
                database.execute(f"INSERT INTO {table} VALUES ({', '.join('?' * len(names))})", values)  # noqa: S608
    database.close()
    source.close()
    if rng.random() < 0.3:
        path.write_bytes(changed_bytes(rng, path.read_bytes()))
    return ["history", str(path), "--out", str(folder / "history")], None


def _table(suffix):
    def make(rng, folder, given):
        path = folder / f"table{suffix}"
        if suffix == ".csv":
            path.write_bytes(changed_lines(rng, given.texts["table"]).encode("utf-8", "surrogatepass"))
        elif suffix == ".mat":
            path.write_bytes(containers.changed_mat(rng, TABLE))
        else:
            path.write_bytes(containers.changed_parquet(rng, TABLE))
        return rng.choice(
            [
                ["plot", str(path), "--out", str(folder / "x.svg")],
                ["simulate", "--voltage", str(path), "--model", "default", "--out", str(folder / "out.csv")],
            ]
        ), None

    return make


def _progress(rng, folder, given):
    logs, out = folder / "logs", folder / "out"
    logs.mkdir()
    out.mkdir()
    for name in "ab":
        (logs / f"{name}.blf").write_bytes(given.short[".blf"])
    good = json.dumps({"key": "k", "path": str(logs / "a.blf"), "status": "judged", "verdict": "pass"}) + "\n"
    (out / "progress.jsonl").write_text(changed_json_lines(rng, good * 3), "utf-8", "surrogatepass")
    sources = [str(logs / "a.blf"), str(logs / "b.blf")]
    return ["replay", *sources, "--bench", BENCH, "--jobs", "1", "--out", str(out)], None


KINDS = {suffix.removeprefix("."): _log(suffix) for suffix in (".blf", ".mf4", ".asc", ".log", ".trc", ".csv", ".db")}
KINDS |= {"gz": _packed, "dbc": _dbc, "yaml": _yaml, "session": _session, "store": _store, "progress": _progress}
KINDS |= {"table": _table(".csv"), "mat": _table(".mat"), "parquet": _table(".parquet")}
