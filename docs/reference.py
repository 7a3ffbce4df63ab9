"""Writes the pages of the reference that come from the code, at each build: `python docs/reference.py`."""

import argparse
import ast
import inspect
import math
from pathlib import Path

import etb_hil
from etb_hil.base.roles import COMMANDED, ROLES
from etb_hil.bench.bench_reasons import BENCH_REASONS
from etb_hil.bench.unit_reasons import UNIT_REASONS
from etb_hil.cli.file_kinds import KINDS, file_schema
from etb_hil.cli.main import COMMANDS, EXIT_CODES, _parser
from etb_hil.diagnosis.measurement_registry import measurement_kinds
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.port import Port
from etb_hil.results.explanation_file import explanation_schema
from etb_hil.results.json_file import results_schema
from etb_hil.uds.trouble_codes import CODES

PACKAGE = Path(__file__).parents[1] / "etb_hil"
MADE = "<!-- Made by docs/reference.py from the code: edit it there. -->\n\n"
PACKAGES = (
    "base", "results", "store", "recording", "plant", "estimation", "hypotheses", "observer", "diagnosis",
    "discrepancy", "canio", "uds", "controller", "scenario", "session", "bench", "replays", "histories", "station",
    "report", "paper",
)  # fmt: skip


def kept():
    """Return the pages that a checkout holds, so that links to them work there; a test finds outdated ones."""
    pages = (roles, effects, measurements, trouble_codes, commands, files, reasons)
    return {page.__name__: page() for page in pages}


def built():
    """Return the pages that only a build of the documents makes."""
    packages = {f"packages/{name}": package_page(name) for name in PACKAGES}
    return {"python": python(), **packages}


def write(folder):
    """Write all pages into a folder."""
    (folder / "packages").mkdir(parents=True, exist_ok=True)
    for name, text in {**kept(), **built()}.items():
        (folder / f"{name}.md").write_text(MADE + text, "utf-8")


def trouble_codes():
    """Return which trouble codes speak of a throttle body, and which measurements they are held against."""
    rows = [
        f"| {code} | {meaning.text} | {', '.join(f'`{one}`' for one in meaning.measurements)} |"
        for code, meaning in CODES.items()
    ]
    return "\n".join(["# Trouble codes\n", "| code | what it says | measurements |", "|---|---|---|", *rows, ""])


def commands():
    """Return the arguments of each command with their help; whatever the version of argparse, the page is the same."""
    parts = [f"# Commands\n\n{EXIT_CODES.capitalize()}.\n"]
    for name in COMMANDS:
        subparsers = next(a for a in _parser(name)._actions if a.dest == "command")  # noqa: SLF001 (no public way)
        parser = subparsers.choices[name]
        parts.append(f"## etb-hil {name}\n\n{parser.description}\n\n| argument | |\n|---|---|")
        actions = [one for one in parser._actions if one.dest != "help" and one.help != argparse.SUPPRESS]  # noqa: SLF001
        parts += [f"| {_argument(one)} | {_cell(_help(one, parser))} |" for one in actions]
        parts.append("")
    return "\n".join(parts)


def _argument(action):
    value = action.metavar or (action.dest if not action.option_strings else action.dest.upper())
    value = " ".join(value) if isinstance(value, tuple) else value
    names = action.option_strings or [value]
    takes = f" {value}" if action.option_strings and action.nargs != 0 else ""
    return ", ".join(f"`{name}{takes}`" for name in names)


def _help(action, parser):
    return _plain((action.help or "") % {**vars(action), "prog": parser.prog})


def files():
    """Return the keys of every file that people write, and of those that commands write."""

    parts = [
        (
            "# Files\n\nYAML 1.2; values carry their unit (`30 deg`, `0.35 N·m`). "
            "`etb-hil schema KIND` prints the JSON schema of a kind.\n"
        )
    ]
    written = {"results": results_schema, "explanation": explanation_schema}
    for kind in (*KINDS, *written):
        schema = written[kind]() if kind in written else file_schema(kind)
        parts.append(f"## {kind.replace('_', ' ')}\n")
        parts += _table(schema)
        for name, definition in sorted(schema.get("$defs", {}).items()):
            if "properties" in definition:
                parts += [f"### {name} (of {kind.replace('_', ' ')})\n", *_table(definition)]
    return "\n".join(parts)


def _table(schema):
    yield f"{_plain(schema.get('description', ''))}\n"
    yield "| key | what it holds | default | |\n|---|---|---|---|"
    needed = schema.get("required", [])
    for key, value in schema.get("properties", {}).items():
        default = "needed" if key in needed else f"`{value['default']}`" if "default" in value else ""
        yield f"| `{key}` | {_kind(value)} | {_cell(default)} | {_cell(_plain(value.get('description', '')))} |"
    yield ""


def _kind(value):
    if "$ref" in value:
        return value["$ref"].rsplit("/", 1)[-1]
    if "const" in value or "enum" in value:
        return ", ".join(f"`{each}`" for each in value.get("enum", [value.get("const")]))
    if "anyOf" in value or "oneOf" in value:
        return " or ".join(dict.fromkeys(_kind(each) for each in value.get("anyOf", value.get("oneOf"))))
    kind = value.get("type", "any")
    if kind == "array":
        return f"list of {_kind(value.get('items') or {'anyOf': value.get('prefixItems', [{}])})}"
    return " or ".join(kind) if isinstance(kind, list) else kind


def _plain(text):
    return " ".join(text.split())


def _listed(names):
    return ", ".join(f"`{name}`" for name in names)


def _cell(text):
    return text.replace("|", "\\|")


def roles():
    """Return the roles that signals can have."""

    rows = [
        f"| `{r.name}` | {r.unit} | {r.meaning} | {'commanded' if r.name in COMMANDED else ''} |"
        for r in ROLES.values()
    ]
    return "\n".join(
        [
            "# Roles\n\nWhat a signal is, whichever bus, file or model it comes from.\n",
            "| role | unit | meaning | |",
            "|---|---|---|---|",
            *rows,
            "",
        ]
    )


def effects():
    """Return the catalogue of what the base model leaves out."""

    parts = [
        (
            "# Effects\n\nWhat the base model leaves out; a model file names them by id under `effects`, "
            "an explanation finds them. [How to write and to add one](../howto/own_effect.md). Angles are in degrees; "
            "a model file may state any unit of the same kind.\n"
        ),
        "| effect | acts at | needs | looks like |\n|---|---|---|---|",
        *(
            f"| [`{effect.id}`](#{effect.id}) | {_listed(port.name.lower() for port in effect.terms)} "
            f"| {', '.join(sorted(need.value for need in effect.needs))} | {_cell(effect.looks_like)} |"
            for effect in CATALOGUE.values()
        ),
        "",
    ]
    for effect in CATALOGUE.values():
        parts.append(f"## {effect.id}\n\n    {effect.equation}\n")
        parts.append("| parameter | unit | from | to | source |\n|---|---|---|---|---|")
        parts += [_bounds(p) for p in effect.stated]
        parts.append(f"\n- In data: {_sentence(effect.looks_like)}\n- On the unit: {_sentence(effect.check)}")
        if effect.look_alikes:
            pairs = ", ".join(f"`{name}`" for name in effect.look_alikes)
            parts.append(f"- Looks like: {pairs}; to distinguish them: {_sentence(effect.separated_by)}")
        parts.append(f"- Balance: {effect.balance.name.lower()}; parity: {effect.parity.value}.")
        if effect.limits:
            parts.append(f"- Limits: {_sentence(effect.limits)}")
        parts.append(f"- Source: {_sentence(effect.source)}\n")
    parts.append(
        "## Ports\n\nWhere terms enter the equations, and what their functions may ask for beside parameters. "
        "Functions take and return SI units, angles in rad. Closed ports belong to this package's own effects.\n\n"
        "| port | what a term there is | unit | several terms | quantities | states | |\n|---|---|---|---|---|---|---|"
    )
    parts += [
        f"| `{port.name}` | {port.says} | {port.unit} | {port.combine.value} | {_listed(port.asks)} "
        f"| {'yes' if port.has_states else ''} | {'' if port.is_open else 'closed'} |"
        for port in Port
    ]
    parts.append("")
    return "\n".join(parts)


def _bounds(parameter):
    """Return a row of a parameter's bounds, angles in degrees."""
    low, high, unit = parameter.low, parameter.high, parameter.unit
    if unit in {"rad", "rad/s"}:
        low, high = (float(f"{math.degrees(bound):.3g}") for bound in (low, high))
        unit = unit.replace("rad", "deg")
    return f"| `{parameter.name}` | {unit} | {low:g} | {high:g} | {_cell(parameter.source)} |"


def _sentence(text):
    return text if text.endswith((".", "?", "!")) else f"{text}."


def measurements():
    """Return the measurements that there are, for limits files."""

    rows = [
        f"| `{kind.id}` | {_cell(kind.name)} | {kind.unit} | {'95 %' if kind.has_interval else 'none'} "
        f"| {', '.join(sorted(kind.phases)) or 'motion'} | {_listed(sorted(kind.roles))} | {_cell(kind.source)} |"
        for kind in measurement_kinds().values()
    ]
    return "\n".join(
        [
            "# Measurements\n\nA limits file limits what has an interval, by its id. `results.json` has these units.\n",
            "| id | measurement | unit | interval | phases | roles, beside current and motor angle | definition |",
            "|---|---|---|---|---|---|---|",
            *rows,
            "",
        ]
    )


def reasons():
    """Return what each reason id of a result says, and what to do then."""

    parts = ["# Reasons\n\n`reason_id` in `results.json`, the sentence on the screen, and what to do next.\n"]
    for title, table in (("Of the unit", UNIT_REASONS), ("Of the bench", BENCH_REASONS)):
        parts.append(f"## {title}\n\n| id | sentence | next |\n|---|---|---|")
        parts += [f"| `{name}` | {_cell(w.reason)} | {_cell(w.next_step)} |" for name, w in table.items()]
        parts.append("")
    return "\n".join(parts)


def python():
    """Return the page of the Python interface: a table that links, and what autodoc makes of each public name."""
    kinds = {"functions": [], "classes": [], "errors": [], "modules": []}
    for name in etb_hil.__all__:
        kinds[_kind_of(getattr(etb_hil, name))].append(name)
    parts = [
        (
            "# Python interface\n\nThe public names of `etb_hil`; [how to use them](../howto/python.md). "
            "All quantities are in SI units where nothing else is stated.\n"
        ),
        "| name | |\n|---|---|",
    ]
    for name in (name for names in kinds.values() for name in names):
        first = inspect.getdoc(getattr(etb_hil, name)).splitlines()[0]
        parts.append(f"| {{py:obj}}`~etb_hil.{name}` | {_cell(first)} |")
    for kind, names in kinds.items():
        parts.append(f"\n## {kind.capitalize()}\n")
        directives = {"functions": "autofunction", "classes": "autoclass", "errors": "autoexception"}
        directive = {**directives, "modules": "automodule"}[kind]
        for name in names:
            members = "" if kind == "functions" else ":members:\n:inherited-members: Exception, Mapping, StrEnum\n"
            parts.append(f"```{{eval-rst}}\n.. {directive}:: etb_hil.{name}\n{_indented(members)}```\n")
    return "\n".join(parts)


def _kind_of(public):
    if inspect.ismodule(public):
        return "modules"
    if not inspect.isclass(public):
        return "functions"
    return "errors" if issubclass(public, Exception) else "classes"


def _indented(options):
    return "".join(f"   {line}\n" for line in options.splitlines())


def package_page(package):
    """Return the public names of a package with their signatures and docstrings, read from the source alone."""
    parts = [f"# Package `etb_hil.{package}`\n"]
    for path in sorted((PACKAGE / package).rglob("*.py")):
        tree = ast.parse(path.read_text("utf-8"))
        name = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")
        doc = _doc(tree)
        if path.name == "__init__.py":
            parts.append(f"{doc}\n" if path.parent == PACKAGE / package else "")
            continue
        parts.append(f"## {name}\n\n{doc}\n")
        named = [node for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef)]
        parts += [_entry(node) for node in named if not node.name.startswith("_")]
    return "\n".join(parts)


def _entry(node):
    if isinstance(node, ast.FunctionDef):
        return f"```text\n{_signature(node)}\n```\n\n{_doc(node)}\n"
    bases = ", ".join(ast.unparse(base) for base in node.bases)
    members = [
        f"- `{_signature(child)}`: {_doc(child).splitlines()[0] if _doc(child) else ''}"
        for child in node.body
        if isinstance(child, ast.FunctionDef) and not child.name.startswith("_")
    ]
    fields = [
        f"    {child.target.id}: {ast.unparse(child.annotation)}"
        for child in node.body
        if isinstance(child, ast.AnnAssign)
        and isinstance(child.target, ast.Name)
        and not child.target.id.startswith("_")
    ]
    head = "\n".join([f"class {node.name}{f'({bases})' if bases else ''}", *fields])
    return "\n".join([f"```text\n{head}\n```\n\n{_doc(node)}\n", *members, ""])


def _signature(node):
    returns = f" -> {ast.unparse(node.returns)}" if node.returns else ""
    return f"{node.name}({ast.unparse(node.args)}){returns}"


def _doc(node):
    text = ast.get_docstring(node) or ""
    return text.replace("<", "&lt;").replace("*", "\\*").replace("[", "\\[")


if __name__ == "__main__":
    write(Path(__file__).parent / "reference")
