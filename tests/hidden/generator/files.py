"""A case as files: what the tool may open in one folder, the truth in another."""

import json
from pathlib import Path

import numpy as np

from generator.model_file import model_text
from generator.separability import sealed

COLUMNS = {
    "time": ("time_s", "%.7f"),
    "motor_voltage": ("motor_voltage_V", "%.3f"),
    "motor_current": ("motor_current_A", "%.4f"),
    "motor_angle": ("motor_angle_rad", "%.7f"),
    "throttle_angle": ("throttle_angle_rad", "%.7f"),
    "temperature": ("temperature_degC", "%.2f"),
    "supply_voltage": ("supply_voltage_V", "%.3f"),
}


def write_case(case, folder, sealed_path, *, binary=False):
    """Write `data.csv` (or `data.npz`), `model.yaml` and `about.json` to `folder`, and the truth to `sealed_path`.

    ValueError where the truth would lie in the folder that the tool opens.
    """
    folder, sealed_path = Path(folder), Path(sealed_path)
    if folder.resolve() in sealed_path.resolve().parents:
        raise ValueError("the truth must not lie in the folder that the tool opens")
    folder.mkdir(parents=True, exist_ok=True)
    sealed_path.parent.mkdir(parents=True, exist_ok=True)
    data = {COLUMNS[role][0]: values for role, values in case.table.items()}
    if binary:
        np.savez(folder / "data.npz", **data)
    else:
        formats = [COLUMNS[role][1] for role in case.table]
        np.savetxt(
            folder / "data.csv",
            np.column_stack(list(data.values())),
            fmt=formats,
            delimiter=",",
            header=",".join(data),
            comments="",
        )
    (folder / "model.yaml").write_text(model_text(case.nominal, case.sensors, f"unit {case.truth['seed']}"), "utf-8")
    (folder / "about.json").write_text(json.dumps(case.about, indent=1), "utf-8")
    sealed_path.write_text(json.dumps(sealed(case), indent=1), "utf-8")
