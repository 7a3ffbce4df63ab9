"""The quick tests cover every package, and every file that they name is there."""

from pathlib import Path

from quick import QUICK

TESTS = Path(__file__).parent.parent
PACKAGES = TESTS.parent / "etb_hil"
NAMED_OTHERWISE = {"histories": "history", "replays": "replay", "stock": "plant"}


def test_every_package_has_quick_tests():
    folders = {name.partition("/")[0] for name in QUICK}
    packages = {path.parent.name for path in PACKAGES.glob("*/__init__.py")}
    assert {NAMED_OTHERWISE.get(name, name) for name in packages} <= folders


def test_every_quick_file_is_there():
    assert [name for name in QUICK if not (TESTS / f"{name}.py").is_file()] == []
    assert list(QUICK) == sorted(set(QUICK))
