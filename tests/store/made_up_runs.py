"""Results of runs with all that a store keeps of them."""

import hashlib

from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.results.measurement import Measurement, Measurements
from etb_hil.results.run_result import Bench, Exceedance, InputFile, Phase, RunResult, Unit

LIMITS = b"schema: etb_hil/limits/1\n"


def result(number, bench="bench 1", serial="SN 1", **changes):
    value = 0.17 + 1e-4 * number
    fields = {
        "run_id": f"run-{number:04d}",
        "unit": Unit(UnitVerdict.PASS, "within_limits", serial=serial, part_number="p", revision="1"),
        "bench": Bench(BenchOutcome.OK, name=bench),
        "started": f"2026-11-24T08:{number // 60:02d}:{number % 60:02d}.000+00:00",
        "scenario": "Friction check",
        "measurements": Measurements(
            [
                Measurement("T_st", "", value, "N·m", value - 0.01, value + 0.01, None, 0.26),
                Measurement("temperature", "housing", 21.0, "degC"),
                Measurement("T_c", "sliding", None, "N·m"),
            ]
        ),
        "phases": (Phase("home", "Home", 0.0, 1.5, "done"), Phase("sweep", "Sweep", 1.5)),
        "exceedances": (Exceedance("T_st", 0.1, 0.2, 0.3, 0.26, phase="home"),),
        "inputs": (InputFile("limits", "limits.yaml", hashlib.sha256(LIMITS).hexdigest()),),
    }
    return RunResult(**{**fields, **changes})


def session(folder):
    """Make the folder of a session with its limits file, as far as the store reads one."""
    inputs = folder / "a session" / "inputs"
    inputs.mkdir(parents=True, exist_ok=True)
    (inputs / "limits.yaml").write_bytes(LIMITS)
    return inputs.parent
