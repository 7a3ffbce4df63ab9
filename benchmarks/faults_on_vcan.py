"""Random schedules of up to four faults over real SocketCAN at wall clock: signals, stops, resets, the bus, the disk.

    python benchmarks/faults_on_vcan.py --runs 100
    python benchmarks/faults_on_vcan.py --first 17 --runs 1 -v     # one schedule again
    python benchmarks/faults_on_vcan.py --runs 100 --slower 5      # on a host that stalls: one second takes five

Bench and controller are two processes beside a vcan0, in a network namespace of this kernel or under User Mode Linux as
in `tests/vcan`. At its end must hold what `faults_schedules.py` asks in virtual time: the bridge is off by the
controller's own log wherever the results say so, no verdict is wrong, every exit code is one of the documented ones,
the session can be replayed. What a loaded host spoils is a bench fault or inconclusive.
"""

import argparse
import json
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "tests" / "vcan"))
ETB_HIL = (sys.executable, "-m", "etb_hil")
EXPECTED = {"default": "pass", "faulty": "fail"}
BENCHES = ("vcan_classic", "vcan_fd")
DOCUMENTED = {0, 2, 3, 4, 5, 10}
BAD = ("NOT OFF", "WRONG", "CRASH", "HANG", "UNREADABLE")
MOST, LAST_S, BEGIN_S, END_S = 4, 14.0, 120.0, 180.0
ENDS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGUSR1")


class Stand:
    """A controller and a bench in two processes, in a folder of their own."""

    def __init__(self, folder, bench, unit):
        self.folder, self.bench, self.unit, self.resets = folder, bench, unit, 0
        self.is_killed = False
        self.power_on()
        self.said = (folder / "said").open("w")
        words = ["run", "friction_check", "--bench", bench, "--out", str(folder / "sessions"), "--serial", "V1"]
        self.run = subprocess.Popen([*ETB_HIL, *words], stdout=self.said, stderr=subprocess.STDOUT)

    def power_on(self):
        log = self.folder / f"controller-{self.resets}.jsonl"
        words = ["controller", "--bench", self.bench, "--unit", self.unit, "--log", str(log)]
        self.controller = subprocess.Popen([*ETB_HIL, *words], stdout=subprocess.PIPE, text=True)
        self.controller.stdout.readline()  # it says that it is ready

    def switch_off(self):
        for process in (self.run, self.controller):
            if process.poll() is None:
                process.kill()
            process.wait()
        self.controller.stdout.close()
        self.said.close()

    def has_begun(self):
        return any(self.folder.glob("sessions/*/events.jsonl"))

    def bridge_is_on(self):
        """Return whether the bridge is on by the log of the controller that has power."""
        lines = (self.folder / f"controller-{self.resets}.jsonl").read_text().splitlines()
        switches = [event for line in lines if (event := json.loads(line)["event"]).startswith("drive_")]
        return bool(switches) and switches[-1] == "drive_on"


def ended(stand, rng):
    stand.run.send_signal(getattr(signal, rng.choice(ENDS)))


def killed(stand, rng):  # noqa: ARG001 (one signature for all)
    stand.is_killed = True
    stand.run.kill()


def paused(process, rng):
    process.send_signal(signal.SIGSTOP)
    time.sleep(2.0 ** rng.uniform(-8.0, 1.0))  # 4 ms to 2 s
    process.send_signal(signal.SIGCONT)


def reset(stand, rng):
    stand.controller.kill()
    stand.controller.wait()
    stand.controller.stdout.close()
    time.sleep(rng.uniform(0.0, 0.3))
    stand.resets += 1
    stand.power_on()


def bus_down(stand, rng):  # noqa: ARG001
    subprocess.run(["ip", "link", "set", "vcan0", "down"], check=True)
    time.sleep(2.0 ** rng.uniform(-8.0, 0.0))
    subprocess.run(["ip", "link", "set", "vcan0", "up"], check=True)


def babbled(stand, rng):
    """Send frames of the bench's own ids, or of the highest priority, that nobody means."""
    import can  # noqa: PLC0415 (in the guest alone)

    with can.Bus("vcan0", interface="socketcan", fd=stand.bench == "vcan_fd") as bus:
        ident = rng.choice([0x000, 0x100, 0x110, 0x120, 0x121, 0x130])
        for _ in range(rng.choice([1, 10, 200])):
            try:
                bus.send(can.Message(arbitration_id=ident, is_extended_id=False, data=rng.randbytes(8)))
            except can.CanError:  # the bus may be down
                return
            time.sleep(0.001)


def second_bench(stand, rng):  # noqa: ARG001
    words = ["run", "paper_step", "--bench", stand.bench, "--out", str(stand.folder / "other")]
    subprocess.run([*ETB_HIL, *words], capture_output=True, check=False, timeout=END_S)


def disk_full(stand, rng):  # noqa: ARG001
    resource.prlimit(stand.run.pid, resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))


def clock_set(stand, rng):  # noqa: ARG001
    if os.environ.get("VCAN_MACHINE") == "uml":  # the guest's own clock, and no other's
        time.clock_settime(time.CLOCK_REALTIME, time.time() + rng.choice([-1, 1]) * 2.0 ** rng.uniform(-8.0, 6.0))


ACTS = {
    "ended": ended, "killed": killed, "bench paused": lambda stand, rng: paused(stand.run, rng),
    "controller paused": lambda stand, rng: paused(stand.controller, rng), "controller reset": reset,
    "bus down": bus_down, "babbling": babbled, "second bench": second_bench, "disk full": disk_full,
    "clock set": clock_set,
}  # fmt: skip


def schedule(number):
    """Return a generator, the bench, the unit, and the faults with their times in s after the run began."""
    rng = random.Random(f"vcan {number}")  # noqa: S311 (no secret)
    names = [rng.choice(list(ACTS)) for _ in range(rng.randint(1, MOST))]
    acts = sorted((rng.uniform(0.0, LAST_S), name) for name in names)
    return rng, BENCHES[number % 2], list(EXPECTED)[number // 2 % 2], acts


def judged(stand, code):
    """Return the class of a schedule that has ended, and what there is to say."""
    said = (stand.folder / "said").read_text(errors="replace")
    if "Traceback" in said or not (code in DOCUMENTED or (stand.is_killed and code == -signal.SIGKILL)):
        return "CRASH", f"exit code {code}: {said[-1500:]}"
    results = next(stand.folder.glob("sessions/*/results.json"), None)
    if results is None:
        return ("killed" if stand.is_killed else "told"), f"exit code {code}"
    found = json.loads(results.read_text())
    verdict, bench = found["unit"]["verdict"], found["bench"]
    if bench["safe_state"] and stand.bridge_is_on():
        return "NOT OFF", f"{bench}"
    reason = f"{verdict or bench['outcome']} {bench['reason_id']}"
    if verdict is None:
        return ("fault" if bench["safe_state"] else "not seen off"), reason
    if verdict == "inconclusive":
        return "unsure", reason
    return ("right" if verdict == EXPECTED[stand.unit] else "WRONG"), reason


def unreadable(folder):
    """Return what is wrong with the sessions that a schedule left, if anything."""
    for session in folder.glob("sessions/*/session.json"):
        done = subprocess.run([*ETB_HIL, "replay", str(session.parent)], capture_output=True, text=True, check=False)
        is_little = done.returncode == 2 and (session.parent / "raw.blf").stat().st_size < 1_000
        if "Traceback" in done.stderr or not (done.returncode in DOCUMENTED - {2} or is_little):
            return f"replay: exit code {done.returncode}: {done.stderr[-1000:]}"
    return None


def run_one(number, folder):
    """Run a schedule; return its class and what there is to say."""
    rng, bench, unit, acts = schedule(number)
    stand = Stand(folder, bench, unit)
    try:
        deadline = time.monotonic() + BEGIN_S
        while not stand.has_begun() and stand.run.poll() is None and time.monotonic() < deadline:
            time.sleep(0.01)
        begun = time.monotonic()
        for at_s, name in acts:
            while time.monotonic() < begun + at_s and stand.run.poll() is None:
                time.sleep(0.002)
            if stand.run.poll() is not None:
                break
            ACTS[name](stand, rng)
        try:
            code = stand.run.wait(END_S)
        except subprocess.TimeoutExpired:
            return "HANG", f"no end within {END_S:g} s"
        time.sleep(0.1)  # the watchdog of a bench that was killed has 30 ms
        kind, said = judged(stand, code)
    finally:
        stand.switch_off()
    if (wrong := unreadable(folder)) is not None:
        return "UNREADABLE", f"{said}: {wrong}"
    return kind, said


def inside(first, count):
    """Run schedules beside a vcan0; print a JSON line each."""
    for number in range(first, first + count):
        with tempfile.TemporaryDirectory() as folder:
            kind, said = run_one(number, Path(folder))
        _, bench, unit, acts = schedule(number)
        note = " + ".join(f"{name} at {at_s:.2f} s" for at_s, name in acts)
        print(json.dumps({"kind": kind, "acts": [name for _, name in acts],
                          "said": f"{number} [{bench} {unit}] {note}: {said}"}), flush=True)  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--first", type=int, default=0, help="number of the first schedule")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="begin no schedule after so long")
    parser.add_argument("--slower", type=int, default=1, help="slow the guest's clock down so many times")
    parser.add_argument("-v", action="store_true", help="say what every schedule came to")
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.inside:
        return inside(options.first, options.runs)
    import vcan_machine  # noqa: PLC0415 (needs pytest, which is not in the guest's way)

    counts, ends = Counter(), Counter()
    until = time.monotonic() + 60.0 * options.minutes
    for number in range(options.first, options.first + options.runs):  # each on a kernel of its own
        if time.monotonic() > until:
            break
        words = [sys.executable, str(Path(__file__).resolve()), "--inside", "--first", str(number), "--runs", "1"]
        with tempfile.TemporaryDirectory() as place:
            done = vcan_machine.run(words, Path(place), 600.0 * options.slower, slower=options.slower)
        if done.returncode or not done.stdout:
            raise SystemExit(f"schedule {number} did not run: {done.stdout}{done.stderr}")
        found = json.loads(done.stdout.splitlines()[-1])
        counts[found["kind"]] += 1
        ends.update((name, found["kind"]) for name in set(found["acts"]))
        if options.v or found["kind"] in BAD:
            print(f"{found['kind']:12} {found['said']}", flush=True)
    kinds = ("right", "unsure", "fault", "not seen off", "told", "killed", *BAD)
    print(f"{'schedules with':24}" + "".join(f"{kind:>13}" for kind in kinds))
    for name in ACTS:
        print(f"{name:24}" + "".join(f"{ends[name, kind]:13d}" for kind in kinds))
    print(f"{f'all {counts.total()}':24}" + "".join(f"{counts[kind]:13d}" for kind in kinds))
    return any(counts[kind] for kind in BAD)


if __name__ == "__main__":
    raise SystemExit(main())
