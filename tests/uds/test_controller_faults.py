"""`etb-hil controller --uds-fault` on a real bus between two processes: each fault is a bench fault in bounded time."""

import os
import subprocess
import sys

import can
import pytest
import yaml
from whole_run import files

from etb_hil.base.outcome import BenchOutcome, ExitCode
from etb_hil.base.stock import find
from etb_hil.bench.job import execute, prepare
from etb_hil.cli.main import main

SHORT = """schema: etb_hil/scenario/1
name: Short
phases:
  - {id: ramp, kind: ramp, between: [10 deg, 20 deg], speed: 1 rad/s}
"""
REASONS = {
    "no-answer": "uds_no_answer",
    "pending-for-ever": "uds_no_answer",
    "wrong-length": "uds_bad_answer",
    "wrong-sequence": "uds_bad_answer",
    "wrong-service": "uds_bad_answer",
    "second-tester": "uds_second_tester",
}
HOST = {"host_late", "frames_stopped", "answers_late"}


@pytest.fixture
def bench(tmp_path):
    bus = yaml.safe_load(find("bench", "udp_multicast").read_text("utf-8"))["bus"]
    bus["options"]["port"] = 23200 + os.getpid() % 20_000
    try:
        can.Bus(interface="udp_multicast", channel=bus["channel"], port=bus["options"]["port"]).shutdown()
    except (ImportError, can.CanError, OSError) as error:
        pytest.skip(f"no multicast on this machine: {error}")
    plain = yaml.safe_load(find("bench", "virtual_uds").read_text("utf-8")) | {"bus": bus}
    plain["uds"]["timing"] = {"longest": "2 s"}
    path = tmp_path / "bench.yaml"
    path.write_text(yaml.safe_dump(plain), "utf-8")
    (tmp_path / "short.yaml").write_text(SHORT, "utf-8")
    return path


@pytest.mark.slow
def test_each_fault_is_a_bench_fault_in_bounded_time(bench, tmp_path):
    chosen = files(bench=bench, scenario=tmp_path / "short.yaml", unit="default")
    job = prepare(chosen.__class__(chosen.scenario, chosen.bench, chosen.model, chosen.limits))
    for fault, reason in REASONS.items():
        words = [sys.executable, "-m", "etb_hil", "controller", "--bench", str(bench), "--uds-fault", fault]
        with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as controller:
            try:
                assert controller.stdout.readline().startswith("controller of"), fault
                results = execute(job, tmp_path / "sessions", "", 1).results
            finally:
                controller.terminate()
        assert results.bench.outcome is BenchOutcome.FAULT, fault
        assert results.unit.verdict is None, fault
        assert results.phases == (), fault
        assert results.bench.reason_id in {reason, *HOST}, (fault, results.bench)
        assert results.duration_s < 300.0, fault  # it ends; how soon depends on the host, too


def test_a_fault_needs_a_bench_with_diagnostics(capsys):
    words = ["controller", "--bench", "udp_multicast", "--uds-fault", "no-answer"]
    assert main(words) == ExitCode.BAD_INPUT
    assert "section 'uds'" in capsys.readouterr().err
