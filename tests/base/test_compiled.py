"""Machine code on disk is used as long as everything it was made from is the same, and never longer.

Each test edits a copy of the package and starts processes that call one compiled function, a control law, which holds
functions and constants of other files.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba import literally
from numba.extending import overload

import etb_hil
from etb_hil.base.compiled import njit

CALL = """
import numpy as np
from etb_hil.cli.compiling import announce_compiling
announce_compiling()
from etb_hil.controller.laws.choice import law_torque
print(law_torque({law}, np.array([2.0, 4.0, 8.0, 16.0]), np.array([1.0, 0.0]), 1.0, 0.5))
"""
PD, PID = 0, 1
PD_FILE = "controller/laws/kinds/pd.py"
PD_TORQUE = "return gain[0] * error + gain[1] * rate"
NOTICE = "Compiling for this machine. Later starts take the machine code from a cache.\n"


class Installation:
    """A copy of the package in a folder of its own, with caches of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.package = folder / "site" / "etb_hil"
        self._environment = {"PATH": os.environ["PATH"], "PYTHONPATH": str(folder / "site")}
        self.user_cache = folder / "user"
        self.set("XDG_CACHE_HOME", self.user_cache)
        if not self.package.exists():
            shutil.copytree(Path(etb_hil.__file__).parent, self.package, ignore=shutil.ignore_patterns("__pycache__"))

    def set(self, name: str, value: Path) -> None:
        """Set an environment variable for later starts."""
        self._environment[name] = str(value)

    def start(self, law: int = PD) -> tuple[float, bool]:
        """Start a process; return a law's torque, and whether the process said that it compiles."""
        done = subprocess.run(
            [sys.executable, "-c", CALL.format(law=law)],
            cwd=self.user_cache.parent, env=self._environment, capture_output=True, text=True, check=True,
        )  # fmt: skip
        assert done.stderr in {"", NOTICE}
        return float(done.stdout), done.stderr == NOTICE

    def edit(self, name: str, old: str, new: str) -> None:
        """Replace text in a source file; its time is that of an old archive, as an upgraded wheel has it."""
        path = self.package / name
        text = path.read_text("utf-8")
        assert old in text
        path.write_text(text.replace(old, new), "utf-8")
        os.utime(path, (1e9, 1e9))

    def files(self) -> set[Path]:
        """Return the files of machine code beside the package."""
        return set((self.package / "__pycache__" / "machine_code").glob("*/*"))


@pytest.fixture
def installation(tmp_path):
    return Installation(tmp_path)


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """An installation that was started once, for copies."""
    first = Installation(tmp_path_factory.mktemp("compiled"))
    assert first.start() == (4.0, True)
    return first


@pytest.fixture
def started(compiled, tmp_path):
    """A copy of an installation that was started once, with its machine code."""
    shutil.copytree(compiled.folder, tmp_path, dirs_exist_ok=True)
    return Installation(tmp_path)


def test_a_copy_of_an_installation_compiles_nothing(started):
    assert started.start() == (4.0, False)


def _in_a_shared_folder(installation, folder):
    installation.set("NUMBA_CACHE_DIR", folder / "shared")
    return folder / "shared"


def _beside_the_package(installation, _folder):
    return installation.package / "__pycache__" / "machine_code"


def _where_the_package_is_read_only(installation, _folder):
    (installation.package / "__pycache__").mkdir()
    (installation.package / "__pycache__" / "machine_code").touch()  # so that not even root can write there
    return installation.user_cache


@pytest.mark.parametrize(
    "place",
    [
        _beside_the_package,
        pytest.param(_in_a_shared_folder, marks=pytest.mark.study),
        _where_the_package_is_read_only,
    ],
)
def test_a_changed_function_of_another_file_runs_at_once_wherever_the_machine_code_lies(installation, tmp_path, place):
    folder = place(installation, tmp_path)
    assert installation.start() == (4.0, True)
    assert [*folder.rglob("*law_torque*")]
    assert installation.start() == (4.0, False)
    installation.edit(PD_FILE, PD_TORQUE, PD_TORQUE.replace("+", "-"))
    assert installation.start() == (0.0, True)
    assert installation.start() == (0.0, False)


def test_a_changed_constant_of_another_file_is_used_at_once(installation):
    assert installation.start(PID) == (4.0, True)
    installation.edit("controller/laws/interface.py", "CUT_OFF = 0", "CUT_OFF = 1")
    assert installation.start(PID) == (12.0, True)  # no torque was cut off there: the integral takes 8 N·m


def test_an_edit_of_what_is_not_compiled_compiles_nothing(started):
    started.edit("controller/laws/registry.py", '"control law"', '"position law"')
    started.edit("base/errors.py", "; allowed: ", "; expected: ")
    started.edit(PD_FILE, "Return the torque in N·m for", "# one more line\n    Return, in N·m, the torque for")
    started.edit(PD_FILE, "BANDWIDTH = 180.0", "BANDWIDTH = 170.0")
    assert started.start() == (4.0, False)


def test_an_edit_of_one_function_leaves_no_machine_code_behind(started):
    before = started.files()
    started.edit(PD_FILE, PD_TORQUE, f"{PD_TORQUE} + 1.0")
    assert started.start() == (5.0, True)
    after = started.files()
    assert len(after) == len(before)
    assert {path.name.split("-")[0] for path in before - after} == {
        "etb_hil.controller.laws.choice.law_torque",
        "etb_hil.controller.laws.kinds.pd.torque",
    }


def test_machine_code_of_other_versions_and_of_earlier_releases_is_deleted(started):
    (folder,) = {path.parent for path in started.files()}
    other = folder.rename(folder.with_name(f"{folder.name.rpartition('-')[0]}-0123456789abcdef"))
    of_numba = started.package / "controller" / "__pycache__" / "pd.torque-26.py311.1.nbc"
    of_numba.touch()
    assert started.start() == (4.0, True)
    assert folder.is_dir()
    assert not other.exists()
    assert not of_numba.exists()


def test_a_damaged_file_is_compiled_again(started):
    for path in started.files():
        path.write_bytes(path.read_bytes()[:-100])
    assert started.start() == (4.0, True)
    assert started.start() == (4.0, False)


def test_without_a_folder_to_write_to_everything_still_runs(installation, tmp_path):
    (tmp_path / "file").touch()
    installation.set("NUMBA_CACHE_DIR", tmp_path / "file")
    assert installation.start() == (4.0, True)
    assert installation.start() == (4.0, True)


def test_no_function_of_the_package_is_compiled_past_this_cache():
    package = Path(etb_hil.__file__).parent
    sources = {path.relative_to(package).as_posix(): path.read_text("utf-8") for path in package.rglob("*.py")}
    assert {name for name, text in sources.items() if "njit(" in text} > {"base/compiled.py", "plant/step.py"}
    # What is written out from declarations, or comes with a plug-in, is no source of the package: it is compiled anew
    # in every process, into the kernels that call it or to be called by address.
    no_source = {"plant/effects/compose.py", "plant/effects/outside.py", "controller/laws/outside.py"}
    assert {name for name, text in sources.items() if "from numba import" in text} == no_source
    assert not any("cache=True" in sources[name] for name in no_source)


KERNELS = """
import sys
import numpy as np
from etb_hil.base.compiled import njit

@njit(cache=True)
def means(values):
    if len(values) % 2:
        raise ValueError("one is left", len(values))
    return values.reshape(-1, 2).sum(axis=1) / 2.0

@njit(cache=False)
def second(values):
    return means(values)[1]

print(means(np.array([4.0, 2.0, 1.0, 3.0])), "numba.np.arraymath" in sys.modules)
try:
    means(np.ones(3))
except ValueError as error:
    print(error)
print(second(np.array([4.0, 2.0, 1.0, 3.0])))
"""


def test_loading_imports_no_functions_of_numba_and_what_was_loaded_raises_and_is_called_by_new_code(tmp_path):
    (tmp_path / "kernels.py").write_text(KERNELS, "utf-8")
    environment = {"PATH": os.environ["PATH"], "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    said = []
    for _ in range(2):
        command = [sys.executable, "kernels.py"]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
        said.append(done.stdout)
    rest = "('one is left', 3)\n2.0\n"
    assert said == ["[3. 2.] True\n" + rest, "[3. 2.] False\n" + rest]


def test_a_function_that_cannot_be_compiled_fails_at_once_when_it_is_called_again():
    attempts = []

    def to_be_compiled(_value):
        raise AssertionError("called, not compiled")

    @overload(to_be_compiled)
    def _of_numba(value):
        attempts.append(value)
        raise MemoryError("no room for machine code")

    @njit(cache=False)
    def kernel(value):
        return to_be_compiled(value)

    @njit(cache=False)
    def caller(value):
        return kernel(value)

    for called in (kernel, caller):
        with pytest.raises(MemoryError):
            called(1.0)
    before = len(attempts)
    for called in (kernel, caller, kernel, caller):
        with pytest.raises(MemoryError, match="no room for machine code"):
            called(1.0)
    assert len(attempts) == before > 0
    with pytest.raises(MemoryError):
        kernel(1)  # other types are another function
    assert len(attempts) > before


def test_a_function_that_asks_for_the_value_of_an_argument_is_compiled_for_each():
    @njit(cache=False)
    def kernel(place):
        return (1.5, 2)[literally(place)]

    @njit(cache=False)
    def caller(place):
        return kernel(place)

    assert [kernel(0), kernel(1), kernel(0)] == [1.5, 2, 1.5]
    assert [caller(0), caller(1), caller(0)] == [1.5, 2, 1.5]


def test_a_function_is_compiled_once_whatever_numbers_its_callers_write():
    def to_be_compiled(_value):
        raise AssertionError("called, not compiled")

    kinds = []

    @overload(to_be_compiled)
    def _of_numba(value):
        kinds.append(str(value))
        return lambda value: 2 * value

    @njit(cache=False)
    def kernel(value, count):
        return value + to_be_compiled(count)

    @njit(cache=False)
    def caller(value, count):
        return kernel(value, count=3) + kernel(value, count=4) + kernel(value, count=count)

    assert caller(0.5, 5) == 25.5
    assert set(kinds) == {"int64"}


def test_a_function_has_the_same_bits_whoever_calls_it_first():
    """Numba gives a function without options those of the caller that it is compiled for."""

    def polynomial(x):
        return x * x + 3.0 * x + 1.0

    def divided(x):
        return 1.0 / x

    called, undisturbed = (njit(cache=False)(polynomial) for _ in range(2))
    divides = njit(cache=False)(divided)

    @njit(cache=False, fastmath={"contract"}, error_model="numpy")
    def fused(x):
        return called(x) + divides(x)

    @njit(cache=False)
    def plain(x):
        return called(x), undisturbed(x)

    @njit(cache=False)
    def plainly_divided(x):
        return divides(x)

    fused(0.5)
    both = np.array([plain(x) for x in np.random.default_rng(1).uniform(0.1, 9.9, 10_000)])
    np.testing.assert_array_equal(both[:, 0], both[:, 1])
    with pytest.raises(ZeroDivisionError):
        plainly_divided(0.0)
