"""The notebooks use what is public alone, and the reference lists all of it; a build of the documents runs them."""

import ast
import re
import subprocess
import sys

import documents
import pytest

import etb_hil

NOTEBOOKS = sorted((documents.DOCS / "tutorials" / "notebooks").glob("*.md"))


def test_there_are_notebooks():
    assert len(NOTEBOOKS) >= 3


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_listed_and_uses_what_is_public(notebook):
    assert f"\nnotebooks/{notebook.stem}\n" in (documents.DOCS / "tutorials" / "index.md").read_text("utf-8")
    cells = re.findall(r"```{code-cell}[^\n]*\n(.*?)```", notebook.read_text("utf-8"), re.DOTALL)
    assert cells
    code = "\n".join(line for line in "\n".join(cells).splitlines() if not line.startswith("%"))
    nodes = list(ast.walk(ast.parse(code)))
    imported = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    imported |= {node.module for node in nodes if isinstance(node, ast.ImportFrom)}
    assert "etb_hil" in imported
    assert not [name for name in imported if name.startswith("etb_hil.")]
    used = {node.attr for node in nodes if isinstance(node, ast.Attribute) and ast.unparse(node.value) == "etb"}
    assert used <= set(etb_hil.__all__)


def test_the_reference_has_every_public_name(tmp_path):
    code = f"import sys, pathlib; sys.path.insert(0, {str(documents.DOCS)!r}); import reference; "
    code += f"reference.write(pathlib.Path({str(tmp_path)!r}))"
    subprocess.run([sys.executable, "-c", code], check=True)
    page = (tmp_path / "python.md").read_text("utf-8")
    index = (documents.DOCS / "reference" / "index.md").read_text("utf-8")
    for name in etb_hil.__all__:
        assert re.search(rf":: etb_hil\.{name}$", page, re.MULTILINE), name
        assert f"`~etb_hil.{name}`" in page
    assert "\npython\n" in index
    for kept in (documents.DOCS / "reference").glob("*.md"):
        if kept.read_text("utf-8").startswith(documents.MADE):
            made = (tmp_path / kept.name).read_text("utf-8")
            assert kept.read_text("utf-8") == made, f"{kept.name} is outdated: run python docs/reference.py"


LINK = re.compile(r"\]\(([^)#\s:]+)(?:#[^)\s]*)?\)")


@pytest.mark.parametrize("page", documents.PAGES, ids=lambda page: page.stem)
def test_links_of_a_page_lead_to_files(page):
    for target in LINK.findall(page.read_text("utf-8")):
        path = (page.parent / target).resolve()
        assert path.exists(), target


BUILT = re.compile(r"^(python\.md|packages/|results/)")  # by each build of the documents


@pytest.mark.parametrize("index", sorted(documents.DOCS.glob("*/index.md")), ids=lambda page: page.parent.name)
def test_an_index_links_to_each_of_its_pages_in_a_checkout(index):
    links = set(LINK.findall(index.read_text("utf-8")))
    pages = {path.relative_to(index.parent).as_posix() for path in index.parent.rglob("*.md")}
    kept = {page for page in pages if not BUILT.search(page)} - {"index.md"}
    assert kept <= links
