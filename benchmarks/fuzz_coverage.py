"""One reader fuzzed in-process, guided by what of our code each file reaches (atheris, `pip install atheris`).

    python benchmarks/fuzz_coverage.py KIND [--seconds 30] [--seed 1]

The changes are those of `fuzz.py`; a file that reaches a new branch is changed further. Anything but an InputError,
60 s for a file or more than 1 GiB ends it with the file's bytes (`crash-...` in the current folder). Compiled scanners
are not instrumented.
"""

import argparse
import contextlib
import random
import sys
import tempfile
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["etb_hil"]):
    import etb_hil.canio.logs.foreign
    import etb_hil.canio.logs.mf4
    import etb_hil.canio.logs.text  # noqa: F401 (read_log imports these where they are needed)
    from etb_hil.base.errors import InputError
    from etb_hil.base.stock import find
    from etb_hil.base.yamlfile import load
    from etb_hil.canio.dbc.dbc_file import load_dbc
    from etb_hil.canio.logs.reading import read_log
    from etb_hil.recording.tables import read_table
    from etb_hil.scenario.scenario_file import Scenario

import fuzz_containers as containers
import numpy as np
from fuzz_mutations import changed_bytes, changed_lines

from etb_hil.canio.frames import FrameBlock
from etb_hil.canio.logs.writing import write_log

LOGS = ("blf", "mf4", "asc", "log", "trc", "csv", "db")
TABLE = ["t_s", "motor_voltage_V", "throttle_angle_deg"]


def of_text(rng, data):
    """Change lines of what may be any bytes."""
    return changed_lines(rng, data.decode("utf-8", "surrogateescape")).encode("utf-8", "surrogateescape")


def seed_of(kind, folder):
    """A valid file of a kind."""
    if kind in LOGS:
        zero = np.zeros(300, np.uint8)
        payload = np.arange(2400, dtype=np.int64).astype(np.uint8).reshape(300, 8)
        frames = FrameBlock(
            1_700_000_000_000_000_000 + np.arange(300) * 1_000_000,
            zero + np.uint32(0x123),
            zero,
            zero + 8,
            payload,
            zero,
        )
        log = write_log(folder / f"seed.{kind}", int(frames.stamp_ns[0]))
        log.write(frames)
        log.close()
        return (folder / f"seed.{kind}").read_bytes()
    if kind in {"mat", "parquet"}:
        rng = random.Random(0)  # noqa: S311 (what is wrong in a file is no secret)
        return getattr(containers, f"changed_{kind}")(rng, TABLE)
    if kind == "table":
        return (",".join(TABLE) + "\n" + "".join(f"{k / 1000},{k % 7},{k % 90}\n" for k in range(300))).encode()
    return find(*{"dbc": ("dbc", "etb_controller"), "yaml": ("scenario", "friction_check")}[kind]).read_bytes()


def main():
    """Fuzz one reader."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("kind", choices=[*LOGS, "dbc", "yaml", "table", "mat", "parquet"])
    parser.add_argument("--seconds", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="fuzz-coverage"))
    suffix = {"table": "csv"}.get(options.kind, options.kind)
    path = folder / f"file.{suffix}"
    reader = {
        "dbc": load_dbc,
        "yaml": lambda one: load(one, Scenario),
        "table": read_table,
        "mat": read_table,
        "parquet": read_table,
    }
    read = reader.get(options.kind, lambda one: sum(map(len, read_log(one))))
    change = {
        "blf": containers.changed_blf,
        "mf4": containers.changed_mf4,
        "mat": changed_bytes,
        "parquet": changed_bytes,
        "db": changed_bytes,
    }
    corpus = folder / "corpus"
    corpus.mkdir()
    (corpus / "seed").write_bytes(seed_of(options.kind, folder))

    def one(data):
        path.write_bytes(data)
        with contextlib.suppress(InputError):
            read(path)

    def mutated(data, most, seed):
        rng = random.Random(seed)  # noqa: S311 (what is wrong in a file is no secret)
        with contextlib.suppress(Exception):  # what was changed before may be no container any more
            return change.get(options.kind, of_text)(rng, data)[:most]
        return changed_bytes(rng, data)[:most]

    limits = [
        f"-max_total_time={options.seconds}",
        f"-seed={options.seed}",
        "-timeout=60",
        "-rss_limit_mb=1024",
        "-max_len=1000000",
    ]
    atheris.Setup([sys.argv[0], *limits, str(corpus)], one, custom_mutator=mutated)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
