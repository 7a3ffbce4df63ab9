"""CONTRIBUTING shows the layers that the import contract holds, and names files and commands that are there."""

import re
import tomllib

import documents

TEXT = (documents.CHECKOUT / "CONTRIBUTING.md").read_text("utf-8")
PROJECT = tomllib.loads((documents.CHECKOUT / "pyproject.toml").read_text("utf-8"))


def test_the_picture_has_the_layers_of_the_contract_in_order():
    contract = PROJECT["tool"]["importlinter"]["contracts"][0]["layers"]
    picture = TEXT[TEXT.index("## Layers") : TEXT.index("[Architecture]")]
    shown = re.findall(r"^    (\S+(?: \| \S+)?)  ", picture, re.MULTILINE)
    assert shown == [layer.replace("etb_hil.", "") for layer in contract]


def test_files_and_folders_that_it_names_are_there():
    named = re.findall(r"`((?:etb_hil|docs|tests|benchmarks|\.ci)/[\w./]*)`", TEXT)
    assert len(named) > 15
    assert [path for path in named if not (documents.CHECKOUT / path).exists()] == []


def test_the_version_is_one():
    assert f'__version__ = "{PROJECT["project"]["version"]}"' in (
        documents.CHECKOUT / "etb_hil" / "__init__.py"
    ).read_text("utf-8")
