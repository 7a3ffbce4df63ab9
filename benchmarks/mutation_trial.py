"""Runs tests in a forked process with one module of the package replaced by a mutant."""

import ast
import functools
import gc
import importlib.util
import os
import pickle
import resource
import select
import shutil
import signal
import sys
import tempfile
import time
from dataclasses import dataclass, field

import numba
import pytest
from mutation_operators import probed

TESTS_S = 10.0  # the tests of one mutant take so long at most; slower ones are not asked
TIMES, MORE_S = 3.0, 8.0  # a mutant may use so many times the processor time of its tests, and so much more
WALL = 10.0  # times the processor time: a busy machine kills no mutant, a mutant that waits for ever ends
MEMORY = 6 << 30


@dataclass(eq=False)
class Watch:
    """A plug-in of pytest: which tests run which lines of a file, how long each takes, and which do not pass."""

    lines: dict = field(default_factory=dict)  # line -> tests, or whole files of tests
    seconds: dict = field(default_factory=dict)  # of processor time
    failed: set = field(default_factory=set)
    now: str = ""
    since: float = 0.0

    def add(self, line):
        """Note that a statement is about to be run."""
        self.lines.setdefault(line, set()).add(self.now)

    def pytest_runtest_logstart(self, nodeid):
        """Follow a test."""
        self.now, self.since = nodeid, time.process_time()

    def pytest_runtest_logfinish(self, nodeid):
        """Note how long it took."""
        self.seconds[nodeid] = time.process_time() - self.since

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef):
        """Count what a fixture of many tests runs for all tests of the file."""
        kept = self.now
        if fixturedef.scope != "function":
            self.now = kept.split("::")[0]
        try:
            return (yield)
        finally:
            self.now = kept

    def pytest_runtest_logreport(self, report):
        """Note that it does not pass as it is."""
        if not report.passed:
            self.failed.add(report.nodeid)

    def tests_of(self, mutant):
        """Return the tests to ask, fastest first: those that run its line, all for a line that is run on import."""
        ran = self.lines.get(mutant.statement, set())
        is_at_import = mutant.is_at_import or "" in ran  # of a function: run before the first test
        good = sorted((seconds, test) for test, seconds in self.seconds.items() if test not in self.failed)
        chosen, spent = [], 0.0
        for seconds, test in good:
            runs_it = is_at_import or test in ran or test.split("::")[0] in ran
            if runs_it and (spent := spent + seconds) <= TESTS_S:
                chosen.append(test)
        return chosen


@dataclass(eq=False)
class Chosen:
    """A plug-in of pytest: only these tests, in this order."""

    tests: list

    def pytest_collection_modifyitems(self, items):
        """Leave the others out."""
        rank = {test: number for number, test in enumerate(self.tests)}
        items[:] = sorted((item for item in items if item.nodeid in rank), key=lambda item: rank[item.nodeid])


class Replaced:
    """Finds one module of the package, and loads it from a syntax tree in place of its file."""

    def __init__(self, tree, path, syntax, watch=None):
        self._name = ".".join(path.relative_to(tree).with_suffix("").parts)
        self._path, self._syntax, self._watch = path, syntax, watch

    def find_spec(self, name, path=None, target=None):  # noqa: ARG002 (the signature of a finder)
        """Return the module's spec, None for every other module."""
        return importlib.util.spec_from_file_location(name, self._path, loader=self) if name == self._name else None

    def create_module(self, spec):
        """Leave it to Python."""

    def exec_module(self, module):
        """Run the syntax tree as the module."""
        module.__dict__["__ran__"] = self._watch
        exec(compile(self._syntax, str(self._path), "exec"), module.__dict__)  # noqa: S102 (what a loader is for)


def forget(tree, path, *, compiled):
    """Have the package's modules that import a file, themselves or through others, loaded anew; where no kernel is
    `compiled`, all of them.

    The others were loaded before the fork, once for all mutants.
    """
    name = ".".join(path.relative_to(tree).with_suffix("").parts)
    importers = _importers(tree)
    package = name.partition(".")[0]
    gone, found = set(), {name} if compiled else {one for one in sys.modules if one.partition(".")[0] == package}
    while found:
        gone |= found
        found = {each for one in found for each in importers.get(one, ())} - gone
    for one in gone & sys.modules.keys():
        del sys.modules[one]
        above, _, last = one.rpartition(".")
        if hasattr(sys.modules.get(above), last):
            delattr(sys.modules[above], last)


@functools.cache
def _importers(tree):
    """Return by which modules each module of the package is imported, anywhere in them."""
    found = {}
    for path in (tree / "etb_hil").rglob("*.py"):
        parts = path.relative_to(tree).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            names = [each.name for each in getattr(node, "names", ())] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.module:
                names = [node.module, *(f"{node.module}.{each.name}" for each in node.names)]
            for each in names:
                found.setdefault(each, set()).add(name)
    return found


def watched(tree, path, files, *, compiled):
    """Run all tests of these files as they are; return what they run, and whether kernels were compiled for it."""
    watch = Watch()
    syntax = probed(ast.parse(path.read_text("utf-8")), compiled=compiled)

    def work():
        forget(tree, path, compiled=compiled)
        sys.meta_path.insert(0, Replaced(tree, path, syntax, watch))
        _ask(tree, files, watch, compiled=compiled)
        return watch.lines, watch.seconds, watch.failed

    found = _in_child(work, 1200.0)
    if found is None:
        raise SystemExit(f"the tests of {path} do not end: {' '.join(files)}")
    watch.lines, watch.seconds, watch.failed = found
    return compiled, watch


def killed(tree, path, syntax, mutant, watch):
    """Return whether a test fails, or does not end, with this mutant in its place."""
    compiled, watch = watch
    if not (tests := watch.tests_of(mutant)):
        return False

    def work():
        mutant.apply()
        forget(tree, path, compiled=compiled)
        sys.meta_path.insert(0, Replaced(tree, path, syntax))
        files = list(dict.fromkeys(test.split("::")[0] for test in tests))
        return _ask(tree, files, Chosen(tests), "-x", compiled=compiled)

    return _in_child(work, TIMES * sum(watch.seconds[test] for test in tests) + MORE_S) != 0


def _ask(tree, files, plugin, *options, compiled):
    """Run tests in this process; return pytest's exit code."""
    os.chdir(tree)
    os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"
    numba.config.DISABLE_JIT = not compiled
    folder = tempfile.mkdtemp(prefix="mutant-")
    try:
        always = ["-q", "--assert=plain", "-p", "no:cacheprovider", f"--basetemp={folder}/t"]
        always += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]  # of what is loaded before the fork
        always += ["-p", "xdist.plugin", "-p", "etb_hil.pytest_plugin"]  # the others cost a second a mutant
        return int(pytest.main([*always, *options, *files], plugins=[plugin]))
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _in_child(work, seconds):
    """Return what `work` returns in a forked process; None where it crashes or needs more processor time than this."""
    reader, writer = os.pipe()
    pid = os.fork()
    if not pid:
        gc.freeze()  # what the parent has is not looked at again at each end of pytest
        try:
            os.setpgid(0, 0)
            resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 1))
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
            nowhere = os.open(os.devnull, os.O_RDWR)
            for number in range(3):
                os.dup2(nowhere, number)
            said = pickle.dumps(work())
            os.write(writer, len(said).to_bytes(8, "little"))
            with os.fdopen(writer, "wb") as pipe:
                pipe.write(said)
        finally:
            os._exit(0)
    os.close(writer)
    said = _read(reader, time.monotonic() + WALL * seconds)
    os.close(reader)
    try:
        os.killpg(pid, signal.SIGKILL)  # and what its tests left behind
    except (ProcessLookupError, PermissionError):
        os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    return said


def _read(reader, deadline):
    """Read one object of a stated length; None where it does not come by then."""
    said = b""
    while len(said) < 8 or len(said) < 8 + int.from_bytes(said[:8], "little"):
        left = deadline - time.monotonic()
        if left <= 0 or not select.select([reader], [], [], left)[0] or not (part := os.read(reader, 1 << 16)):
            return None
        said += part
    return pickle.loads(said[8:])  # noqa: S301 (our own child's)
