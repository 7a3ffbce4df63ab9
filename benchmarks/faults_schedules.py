"""Random schedules of up to four faults on the virtual bench: bus, controller, clocks, host, disk, operator.

    python benchmarks/faults_schedules.py --runs 1000
    python benchmarks/faults_schedules.py --runs 1000 --minutes 5
    python benchmarks/faults_schedules.py --first 417 --runs 1 -v     # one schedule again

Each schedule runs in a process of its own, which it may kill. What must hold at its end:

- the bridge is off, by the controller's own log, wherever the results say that this was verified;
- no healthy unit failed, no faulty one passed;
- the run ended with results or with an error of ours, no other exception;
- the session, where one was begun, can be replayed, to the same results where the run had any and its log is whole.
"""

import argparse
import os
import pickle
import resource
import signal
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path

import numpy as np
from faults_cases import CASES, LAST, MS, Injected, S
from faults_study import EXPECTED, job_of, seed_of, spoilt_connect

from etb_hil.base.errors import EtbHilError, InputError
from etb_hil.bench import job as job_room
from etb_hil.bench.job import execute
from etb_hil.controller.virtual_controller import VirtualController
from etb_hil.replays.session_replay import replay
from etb_hil.session.differences import first_difference

MOST = 4
BENCHES = ("virtual_classic", "virtual_fd")


class Host:
    """A link to the bench on whose computer things happen: `acts` are pairs of a time and what is then called."""

    def __init__(self, link, clock, acts):
        self._link, self._clock = link, clock
        self._acts = sorted(acts, key=lambda act: act[0])

    def __getattr__(self, name):
        return getattr(self._link, name)

    def receive(self):
        """Do what is due, then receive."""
        while self._acts and self._clock.now_ns() >= self._acts[0][0]:
            self._acts.pop(0)[1](self._clock)
        return self._link.receive()


def _raised(number):
    return lambda clock: os.kill(os.getpid(), number)  # noqa: ARG005 (one signature)


def _stalled(length_ns):
    return lambda clock: clock.sleep_until_ns(clock.now_ns() + length_ns)


def _full(_clock):
    """Have the system refuse each byte that is written to a file from now on, as a full disk does."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))


def _read_only(folder):
    """Have files of the folder that are open refuse to be written, as those of a disk that became read-only."""

    def act(_clock):
        for name in list(Path("/proc/self/fd").iterdir()):
            path = name.resolve()
            if path.is_relative_to(folder) and path.is_file():
                reading = os.open(path, os.O_RDONLY)
                os.dup2(reading, int(name.name))
                os.close(reading)

    return act


def _acts(name, rng, folder):
    """Return what happens on the bench's computer, and a note of it."""
    at = int(rng.uniform(0.1 * S, LAST))
    if name == "killed":
        return [(at, _raised(signal.SIGKILL))], f"killed at {at / S:.2f} s"
    if name == "stopped":
        which = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGUSR1)[int(rng.integers(5))]
        return [(at, _raised(which))], f"{which.name} at {at / S:.2f} s"
    if name == "stalled":
        length = int(np.exp(rng.uniform(np.log(2), np.log(2_000))) * MS)
        return [(at, _stalled(length))], f"stalled at {at / S:.2f} s for {length / MS:.0f} ms"
    if name == "slow disk":
        lengths = (np.exp(rng.uniform(np.log(0.5), np.log(80), 30)) * MS).astype(int)
        acts = [(at + 20 * MS * k, _stalled(int(length))) for k, length in enumerate(lengths)]
        return acts, f"30 slow writes from {at / S:.2f} s, up to {lengths.max() / MS:.0f} ms"
    act = _full if name == "disk full" else _read_only(folder)
    return [(at, act)], f"{name} at {at / S:.2f} s"


HOST = ("killed", "stopped", "stalled", "slow disk", "disk full", "disk read-only")


def schedule(number):
    """Return the bench, the unit and the faults of a schedule; half of the faults are those of the host."""
    rng = np.random.default_rng(seed_of("schedule", number))
    count = int(rng.integers(1, MOST + 1))
    names = [str(rng.choice(HOST if rng.integers(2) else list(CASES))) for _ in range(count)]
    return rng, BENCHES[number % 2], list(EXPECTED)[number // 2 % 2], list(dict.fromkeys(names))


class Switched:
    """A controller that tells when its bridge went on or off, also after a reset."""

    def __init__(self, job, spoilt):
        self.is_off, self._job = True, job
        self._makers = [each.make for each in spoilt if each.make is not None]

    def make(self, _make, dialect):
        """Return the controller, with the fault that switches it off, if there is one."""

        def make(start_ns):
            self.is_off = True
            return VirtualController(
                self._job.unit, dialect, 1, nominal=self._job.model, start_ns=start_ns, on_switch=self._note
            )

        return self._makers[0](make, dialect) if self._makers else make(0)

    def _note(self, switch):
        self.is_off = not switch.on


def prepared(number, folder, job):
    """Put a schedule's faults on the bench; return its controller, and notes of what is going to happen."""
    rng, _, _, names = schedule(number)
    spoilt, acts, notes = [], [], []
    for name in names:
        if name in CASES:
            spoilt.append(CASES[name](rng, job.setup.dialect))
            notes.append(f"{name} {spoilt[-1].note}")
        else:
            more, note = _acts(name, rng, folder)
            acts += more
            notes.append(note)
    drive = Switched(job, spoilt)
    connect = spoilt_connect([Injected(make=drive.make), *spoilt])

    def connected(job, seed):
        link, clock = connect(job, seed)
        return Host(link, clock, acts), clock

    job_room.connect = connected
    return drive, "; ".join(notes)


def run(number, folder, job):
    """Run a schedule in this process; return its class and what it said."""
    drive, notes = prepared(number, folder, job)
    print(notes, flush=True)
    try:
        results = execute(job, folder, "", number).results
    except (EtbHilError, KeyboardInterrupt) as told:
        return "told", str(told)
    except Exception:  # noqa: BLE001 (what the study looks for)
        return "CRASH", traceback.format_exc(limit=-4)
    bench, verdict = results.bench, results.unit.verdict
    if bench.safe_state and not drive.is_off:
        kind = "NOT OFF"
    elif verdict is None:
        kind = "fault" if bench.safe_state else "not seen off"
    elif verdict == "inconclusive":
        kind = "unsure"
    else:
        kind = "right" if verdict == EXPECTED[schedule(number)[2]] else "WRONG"
    return kind, f"{verdict or bench.outcome} {bench.reason_id}"


def in_child(number, folder, job):
    """Return what a schedule came to in a process of its own, `killed` where it killed that."""
    report = folder.parent / "report"
    if not (pid := os.fork()):
        try:
            with (folder.parent / "notes").open("w") as notes:
                os.dup2(notes.fileno(), 1)
                os.dup2(notes.fileno(), 2)
            reader = os.open(report, os.O_WRONLY | os.O_CREAT)
            said = run(number, folder, job)
            resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
            os.write(reader, pickle.dumps(said))
        finally:
            os._exit(0)
    _, status = os.waitpid(pid, 0)
    if os.WIFSIGNALED(status):
        return ("killed" if os.WTERMSIG(status) == signal.SIGKILL else "CRASH"), f"signal {os.WTERMSIG(status)}"
    text = report.read_bytes()
    return pickle.loads(text) if text else ("CRASH", (folder.parent / "notes").read_text())  # noqa: S301 (our own)


def read_again(folder):
    """Return what is wrong with the session that a schedule left, if anything."""
    for session in folder.glob("*/session.json"):
        try:
            again = replay(session.parent)
            is_whole = again.record.is_recorded and (session.parent / "results.json").exists()
            if is_whole and (found := first_difference(again)) is not None:
                return f"another result: {found}"
        except InputError as error:
            if (session.parent / "raw.blf").stat().st_size > 1_000:
                return f"refused: {error}"
        except Exception:  # noqa: BLE001 (what the study looks for)
            return traceback.format_exc(limit=-4)
    return None


def judge(number, jobs):
    """Return the class of a schedule and what there is to say of it."""
    _, bench, unit, names = schedule(number)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "runs"
        folder.mkdir()
        kind, said = in_child(number, folder, jobs[bench, unit])
        unreadable = read_again(folder)
        notes = (Path(place) / "notes").read_text().splitlines()[:1]
    if unreadable:
        kind, said = "UNREADABLE", f"{said}: {unreadable}"
    return kind, f"{number} [{bench} {unit}] {' + '.join(names)}: {' '.join(notes)}: {said}"


BAD = ("NOT OFF", "WRONG", "CRASH", "UNREADABLE")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="number of the first schedule")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="begin no schedule after so long")
    parser.add_argument("-v", action="store_true", help="say what every schedule came to")
    options = parser.parse_args()
    jobs = {(bench, unit): job_of(bench, unit) for bench in BENCHES for unit in EXPECTED}
    counts, ends = Counter(), Counter()
    until = time.monotonic() + 60.0 * options.minutes
    for number in range(options.first, options.first + options.runs):
        if time.monotonic() > until:
            break
        kind, said = judge(number, jobs)
        counts[kind] += 1
        ends.update((name, kind) for name in schedule(number)[3])
        if options.v or kind in BAD:
            print(f"{kind:12} {said}", flush=True)
    kinds = ("right", "unsure", "fault", "not seen off", "told", "killed", *BAD)
    print(f"{'schedules with':24}" + "".join(f"{kind:>13}" for kind in kinds))
    for name in (*HOST, *CASES):
        print(f"{name:24}" + "".join(f"{ends[name, kind]:13d}" for kind in kinds))
    print(f"{f'all {counts.total()}':24}" + "".join(f"{counts[kind]:13d}" for kind in kinds))
    return any(counts[kind] for kind in BAD)


if __name__ == "__main__":
    raise SystemExit(main())
