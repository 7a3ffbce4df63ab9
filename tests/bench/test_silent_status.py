"""A controller whose status stands in several messages: what decides is seen, or nothing moves on."""

import pytest

from etb_hil.base.stock import find
from etb_hil.bench import job as job_room
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.canio.bus.faults import Lost, Window

MESSAGES = {"SupplyVoltage": ("Supply", 305), "BridgeOn": ("Bridge", 306), "Faults": ("Fault", 307)}
HEAD = "schema: etb_hil/scenario/1\nname: test\n%sphases:\n- {id: zero, kind: current_zero, duration: 0.2 s}\n"
HOLD = "- {id: hold, kind: hold, position: 20 deg, duration: 2.5 s}\n"
END_NS = 10**12


def split_bench(folder, cycle_ms=10):
    """Write a bench file and a DBC with supply, bridge and faults in messages of their own."""
    lines = find("dbc", "etb_controller").read_text("utf-8").splitlines()
    added = []
    for signal, (message, ident) in MESSAGES.items():
        own = next(line for line in lines if line.startswith(f" SG_ {signal} "))
        lines = [line.replace(f" 304 {signal} ", f" {ident} {signal} ") for line in lines if line != own]
        added += [f"BO_ {ident} {message}: 8 Controller", own, ""]
    first = next(k for k, line in enumerate(lines) if line.startswith("CM_"))
    last = next(k for k, line in enumerate(lines) if line.startswith('BA_ "GenMsgCycleTime"'))
    cycles = [f'BA_ "GenMsgCycleTime" BO_ {ident} {cycle_ms};' for _, ident in MESSAGES.values()]
    text = "\n".join([*lines[:first], *added, *lines[first:last], *cycles, *lines[last:], ""])
    (folder / "split.dbc").write_text(text, "utf-8")
    bench = find("bench", "virtual_classic").read_text("utf-8").replace("dbc: etb_controller", "dbc: split.dbc")
    for signal, (message, _) in MESSAGES.items():
        bench = bench.replace(f"EtbStatus.{signal}", f"{message}.{signal}")
    (folder / "split.yaml").write_text(bench, "utf-8")
    return folder / "split.yaml"


@pytest.fixture
def run(tmp_path, monkeypatch):
    def judged(phases, *, supply="", ident=None, since_s=0.0, cycle_ms=10, without="nothing"):
        scenario = tmp_path / "scenario.yaml"
        scenario.write_text(HEAD % supply + phases)
        bench = split_bench(tmp_path, cycle_ms)
        lines = bench.read_text("utf-8").splitlines(keepends=True)
        bench.write_text("".join(line for line in lines if not line.lstrip().startswith(f"{without}:")), "utf-8")
        job = prepare(JobFiles(scenario, bench, find("model", "default"), find("limits", "default")))
        connect = job_room.connect

        def with_loss(*given):
            link, clock = connect(*given)
            lost = Window(round(since_s * 1e9), END_NS, frozenset({ident}))
            link.network.faults = () if ident is None else (Lost(lost),)
            return link, clock

        monkeypatch.setattr(job_room, "connect", with_loss)
        finished = execute(job, tmp_path, "", 1)
        monkeypatch.undo()
        return finished

    return judged


SUPPLY = "supply: [12 V, 15 V]\n"


@pytest.mark.parametrize("since_s", [0.0, 1.0])
@pytest.mark.parametrize(
    ("ident", "role", "supply"), [(305, "supply voltage", SUPPLY), (306, "enable", ""), (307, "faults", "")]
)
def test_a_role_that_decides_and_falls_silent_stops_the_run(run, ident, role, supply, since_s):
    bench = run(HOLD, ident=ident, since_s=since_s, supply=supply).results.bench
    assert bench.reason_id == "frames_stopped"
    assert f"status frame with {role}" in bench.reason


def test_all_of_them_together_let_the_run_end(run):
    assert run(HOLD, supply=SUPPLY).results.bench.reason_id == ""


def test_a_supply_that_no_window_is_stated_for_decides_nothing(run):
    assert run(HOLD, ident=305).results.bench.reason_id == ""


def test_a_role_that_the_bench_does_not_have_decides_nothing(run):
    assert run(HOLD, without="faults").results.bench.reason_id == ""


def test_a_message_may_be_missed_twice_in_its_own_cycle(run):
    assert run(HOLD, ident=307, since_s=0.5, cycle_ms=2000).results.bench.reason_id == ""


def test_the_bridge_does_not_go_on_before_the_supply_is_known(run):
    short = "- {id: hold, kind: hold, position: 20 deg, duration: 0.2 s}\n"
    finished = run(short, ident=305, supply=SUPPLY, cycle_ms=2000)
    assert finished.results.bench.reason_id == "supply_window"
    assert "no reading of the supply" in finished.results.bench.reason
    assert [phase.id for phase in finished.results.phases] == ["zero", "hold"]
