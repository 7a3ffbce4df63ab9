"""Mutation tests of the code that decides: how many small faults the tests find, and which survive.

    python benchmarks/mutation.py                             # every module, every mutant (hours)
    python benchmarks/mutation.py bench/safe_state -v         # one module, every mutant named
    python benchmarks/mutation.py --sample 60                 # 60 mutants of each module
    python benchmarks/mutation.py --sample 60 --seed 7        # 60 others
    python benchmarks/mutation.py --changed HEAD~1 --minutes 3  # the lines that a change touches

Each mutant runs in a process of its own, forked from one that has loaded all modules but those that import it. Only
tests that run its line are asked, fastest first. A mutant in compiled code runs uncompiled, with every kernel as plain
Python. A mutant is killed where a test fails or none ends in time. `mutation_survivors.txt` gives the reason of each
survivor that is known; the exit code is 1 where another one survives.
"""

import argparse
import ast
import importlib
import itertools
import os
import random
import re
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

from mutation_modules import MODULES
from mutation_operators import mutants_of
from mutation_trial import killed, watched

HERE = Path(__file__).resolve().parent
PRELOADED = ("numpy", "numba", "scipy.stats", "hypothesis", "pydantic", "yaml", "cantools", "can", "rich", "jinja2")
OURS = ("etb_hil.bench.job", "etb_hil.replays.session_replay", "etb_hil.results.json_file")  # with all they import
SURVIVORS = HERE / "mutation_survivors.txt"


def source_of(tree, module):
    return tree / "etb_hil" / f"{module}.py"


def with_keys(module, source, mutants):
    """Return each mutant with what names it although its line may move; the second with a key ends in ` 2`."""
    seen, found = Counter(), []
    for mutant in mutants:
        line = source[mutant.line - 1].strip()
        key = f"{module} {mutant.function or 'module'}: {line}  [{mutant.before} -> {mutant.after}]"
        seen[key] += 1
        found.append((mutant, key if seen[key] == 1 else f"{key} {seen[key]}"))
    return found


def known_survivors():
    """Return the reason of each survivor that is known: an indented line under the line that names it."""
    lines = SURVIVORS.read_text("utf-8").splitlines()
    return {name: reason.strip() for name, reason in itertools.pairwise(lines) if reason.startswith("    ")}


def changed_lines(tree, reference):
    """Return the lines of each module of the list that differ from a commit."""
    found = {}
    for module in MODULES:
        command = ["git", "-C", tree, "diff", "-U0", reference, "--", source_of(tree, module)]
        text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        spans = [(int(at), int(n or 1)) for at, n in re.findall(r"^@@ -\S+ \+(\d+)(?:,(\d+))? @@", text, re.MULTILINE)]
        if spans:
            found[module] = {line for at, count in spans for line in range(at, at + count)}
    return found


def tried(tree, module, lines, options, until):
    """Yield each mutant that was tried in a module, in these `lines` or in all, with its key and what became of it."""
    path = source_of(tree, module)
    source = path.read_text("utf-8").splitlines()
    syntax = ast.parse("\n".join(source))
    mutants = with_keys(module, source, mutants_of(syntax))
    random.Random(options.seed).shuffle(mutants)  # noqa: S311 (no secret)
    if lines is not None:
        mutants = [one for one in mutants if one[0].line in lines]
    watches = {}
    for mutant, key in mutants[: options.sample]:
        if time.monotonic() > until:
            return
        compiled = mutant.is_compiled
        if compiled not in watches:
            watches[compiled] = watched(tree, path, MODULES[module].tests(compiled=compiled), compiled=not compiled)
        yield mutant, key, killed(tree, path, syntax, mutant, watches[compiled])


def print_row(module, count):
    if total := count.total():
        score = f"{100.0 * count['killed'] / total:.1f} %"
        print(
            f"{module:28}{total:8d}{count['killed']:8d}{count['known']:7d}{count['SURVIVED']:7d}{score:>8}", flush=True
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("modules", nargs="*", help="such as bench/safe_state; all where none is named")
    parser.add_argument("--sample", type=int, help="mutants of each module, at random")
    parser.add_argument("--seed", type=int, default=1, help="which ones")
    parser.add_argument("--changed", metavar="COMMIT", help="only lines that differ from it")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="start no mutant after so long")
    parser.add_argument("--tree", type=Path, default=HERE.parent, help="another checkout: its code, its tests")
    parser.add_argument("-v", action="store_true", help="name every mutant")
    options = parser.parse_args()
    if unknown := set(options.modules) - set(MODULES):
        parser.error(f"no such module: {', '.join(sorted(unknown))}; there are {', '.join(MODULES)}")
    tree, until = options.tree.resolve(), time.monotonic() + 60.0 * options.minutes
    sys.path.insert(0, str(tree))
    os.environ["CI"] = "1"  # the same examples of property tests every time
    for name in (*PRELOADED, *OURS):
        importlib.import_module(name)
    lines = changed_lines(tree, options.changed) if options.changed else {}
    modules = list(lines) if options.changed else options.modules or list(MODULES)
    known, counts, missed = known_survivors(), {}, []
    print(f"{'module':28}{'mutants':>8}{'killed':>8}{'known':>7}{'other':>7}{'score':>8}")
    for module in modules:
        counts[module] = count = Counter()
        for mutant, key, is_killed in tried(tree, module, lines.get(module), options, until):
            kind = "killed" if is_killed else "known" if key in known else "SURVIVED"
            count[kind] += 1
            if options.v or kind == "SURVIVED":
                print(f"{kind:8} {mutant.line:4d} {key}", flush=True)
            if kind == "SURVIVED":
                missed.append(key)
        print_row(module, count)
    print_row("all", sum(counts.values(), Counter()))
    return bool(missed)


if __name__ == "__main__":
    raise SystemExit(main())
