"""Shows how evenly set-points go out with and without UDS: the same scenario on both benches, side by side.

    python benchmarks/uds_lateness.py [--runs 3]

On the virtual bus the stamps are exact, so that the difference is what UDS does; processor time is that of the process.
"""

import argparse
import tempfile
import time
from pathlib import Path

from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare

BENCHES = ("virtual_classic", "virtual_uds")


def job_of(bench):
    stock = {"scenario": "friction_check", "model": "default", "limits": "default"}
    return prepare(JobFiles(bench=find("bench", bench), **{kind: find(kind, name) for kind, name in stock.items()}))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=3)
    runs = parser.parse_args().runs
    jobs = {bench: job_of(bench) for bench in BENCHES}
    print("bench            jitter rms     worst  late worst  frame age      run  processor")
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(1, runs + 1):
            for bench, job in jobs.items():
                begun = time.process_time()
                results = execute(job, Path(folder), "", seed).results
                spent = time.process_time() - begun
                fared = results.bench
                print(
                    f"{bench:16} {fared.set_point_jitter.rms_us:8.1f} us {fared.set_point_jitter.worst_us:6.0f} us "
                    f"{fared.lateness.worst_ms:8.3f} ms {fared.frame_age.worst_ms:7.3f} ms {results.duration_s:5.1f} s "
                    f"{spent:8.2f} s"
                )


if __name__ == "__main__":
    main()
