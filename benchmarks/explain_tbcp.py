"""A real throttle body in open loop: fitted in free run on two PWM frequencies, predicted at all others.

    python benchmarks/explain_tbcp.py FOLDER_OF_ETB_TBCP [FREQUENCY,FREQUENCY]

What `etb-hil explain ... --fit-on 10000,15000` answers, as a table. No current, no calibrated angle: sensor volts stand
for radians by a slope that the map assumes, and torques are relative to a motor constant that the model file assumes.
"""

import sys
import time
from pathlib import Path

from etb_hil.discrepancy.explain import explain
from etb_hil.plant.parameters import load_model
from etb_hil.recording.tables import read_table

EXAMPLES = Path(__file__).resolve().parent.parent / "docs" / "examples"


def main(folder, fit_on="10000,15000"):
    begin = time.process_time()
    recording = read_table(Path(folder) / "tbcp_open_loop_duty_staircase.csv", EXAMPLES / "etb_tbcp.map.yaml")
    model = load_model(EXAMPLES / "etb_tbcp.model.yaml")
    found = explain([recording], model, fit_on=[float(value) for value in fit_on.split(",")]).explanation
    print(f"verdict {found.verdict}; {found.unexplained.text}")
    print(f"next test: {found.next_test.text}")
    print(f"{found.starts.text}; {'; '.join(found.data_quality[0].flags)}")
    for name, one in found.calibrated.items():
        low, high = one.interval
        print(f"  {name:18} {one.value:.4g} ({low:.4g} to {high:.4g}) {'; '.join(one.flags)}")
    for run in found.runs:
        at = (("measured", run.break_away_voltage.measured_v), ("model", run.break_away_voltage.model_v))
        volts = ", ".join(f"{who} {value:.2f} V" for who, value in at if value is not None)
        seen = "  (fitted)" if run.used_in_fit else ""
        print(f"{run.value:6.0f} Hz  R^2 {run.r_squared:.3f}  breaks away at: {volts}{seen}")
    print(f"{time.process_time() - begin:.0f} s of processor time")


if __name__ == "__main__":
    main(*sys.argv[1:])
