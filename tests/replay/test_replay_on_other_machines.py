"""A replay gives the same bits on another x86-64 machine: an old one is made of this one by taking features away."""

import os
import subprocess
import sys

import pytest
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__
from whole_run import run_on

OLD_MACHINE = {
    "NUMBA_CPU_NAME": "x86-64",  # what the compiled kernels may use
    "NUMBA_CPU_FEATURES": "+sse2",
    "NPY_DISABLE_CPU_FEATURES": " ".join(name for name in __cpu_dispatch__ if __cpu_features__[name]),
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F,-AVX512VL,-ERMS",  # which libm is called
    "OPENBLAS_CORETYPE": "Nehalem",
}


@pytest.mark.study
@pytest.mark.parametrize(
    ("bench", "scenario"),
    [("virtual_classic", "friction_check"), ("virtual_fd", "friction_check"), ("virtual_fd", "end_of_line")],
)
def test_a_replay_on_an_old_machine_gives_the_same_bits(tmp_path, tmp_path_factory, bench, scenario):
    live = run_on(tmp_path, bench=bench, scenario=scenario, unit="faulty")
    compiled = tmp_path_factory.getbasetemp() / "compiled-for-an-old-machine"  # once for all benches
    environment = {**os.environ, **OLD_MACHINE, "NUMBA_CACHE_DIR": str(compiled)}
    command = [sys.executable, "-m", "etb_hil", "replay", str(live.session.folder)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 10, done.stderr
    assert "The same results as live, bit for bit." in done.stdout
