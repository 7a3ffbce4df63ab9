"""Mutation operators on the syntax tree: small faults in comparisons, conditions, arithmetic, constants and calls.

Not mutated are messages (f-strings, what is raised), docstrings, annotations, decorators and imports.
"""

import ast
from dataclasses import dataclass, field

COMPARISONS = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
EXACT = (ast.Eq, ast.NotEq, ast.Is, ast.IsNot, ast.In, ast.NotIn)  # turned round, a comparison is its own negation
ARITHMETIC = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Mult, ast.Mod: ast.Mult,
    ast.LShift: ast.RShift, ast.RShift: ast.LShift, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
    ast.BitXor: ast.BitAnd, ast.Pow: ast.Mult,
}  # fmt: skip
PAIRS = [("min", "max"), ("all", "any"), ("floor", "ceil"), ("argmin", "argmax"), ("minimum", "maximum")]
CALLS = {**dict(PAIRS), **{second: first for first, second in PAIRS}}
LARGE = 10  # from here on an integer is a size and no index: it is doubled and halved, as a float is
UNITS = {1e9, 1e6, 1e3, 1e-3, 1e-6, 1e-9}  # they convert: the multiplication by them is mutated
COMPILERS = {"njit", "jit"}


@dataclass
class Mutant:
    """One fault of a module: where it is, what it changes, and the place in the syntax tree that takes it."""

    line: int
    statement: int  # the line on which its statement begins
    function: str  # the names of classes and functions around it, "" at module level
    is_at_import: bool  # not in a function
    is_compiled: bool
    before: str
    after: str
    parent: ast.AST = field(repr=False)
    name: str = field(repr=False)
    index: int | None = field(repr=False)
    new: ast.AST = field(repr=False)

    def apply(self):
        """Put the fault into the tree."""
        if self.index is None:
            setattr(self.parent, self.name, self.new)
        else:
            getattr(self.parent, self.name)[self.index] = self.new
        ast.fix_missing_locations(self.parent)


def mutants_of(tree):
    """Return the mutants of a module's syntax tree, in the order of its lines.

    `is_compiled` says that numba compiles what changes: a function, or a constant of a module with such functions.
    """
    has_compiled = any(_is_compiled(node) for node in ast.walk(tree))
    return sorted(_visit(tree, 0, "", has_compiled, is_at_import=True), key=lambda mutant: mutant.line)


def _is_compiled(node):
    names = (getattr(each, "func", each) for each in getattr(node, "decorator_list", ()))
    return any(ast.unparse(name).split(".")[-1] in COMPILERS for name in names)


def probed(tree, *, compiled):
    """Put `__ran__.add(line)` before every statement of functions, in place; not where they are `compiled`, too."""
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    inside = {id(node): node for f in functions if not (compiled and _is_compiled(f)) for node in ast.walk(f)}
    for node in inside.values():
        for name in ("body", "orelse", "finalbody"):
            if isinstance(statements := getattr(node, name, None), list):
                statements[:] = [each for one in statements for each in (_probe(one), one)]
    return ast.fix_missing_locations(tree)


def _probe(statement):
    return ast.copy_location(ast.parse(f"__ran__.add({statement.lineno})").body[0], statement)


def _visit(node, statement, function, is_compiled, *, is_at_import):
    for name, index, child in _children(node):
        inner, compiled, later = function, is_compiled, is_at_import
        begins = child.lineno if isinstance(child, ast.stmt) else statement
        if isinstance(child, ast.FunctionDef | ast.ClassDef):
            inner, compiled = f"{function}.{child.name}".lstrip("."), _is_compiled(child)
            later = is_at_import and isinstance(child, ast.ClassDef)
        later = later or name in {"defaults", "kw_defaults"}
        for new in _changes(child, node, name):
            ast.copy_location(new, child)
            before, after = (ast.unparse(each).splitlines()[0] for each in (child, new))
            yield Mutant(child.lineno, begins, inner, later, compiled, before, after, node, name, index, new)
        yield from _visit(child, begins, inner, compiled, is_at_import=later)


def _children(node):
    """Yield the field, the index in it and the child of all that may be mutated."""
    for name, value in ast.iter_fields(node):
        if name in {"annotation", "returns", "decorator_list", "target", "targets", "exc", "cause", "ops", "op", "ctx"}:
            continue
        for index, child in enumerate(value if isinstance(value, list) else [value]):
            if isinstance(child, ast.AST) and not _is_left_out(child):
                yield name, index if isinstance(value, list) else None, child


def _is_left_out(node):
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return True  # a docstring
    is_for_types = isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
    return is_for_types or isinstance(node, ast.JoinedStr | ast.Import | ast.ImportFrom)


def _changes(node, parent, name):  # noqa: C901 (a table of kinds)
    """Yield what may stand in a node's place."""
    match node:
        case ast.Compare():
            for k, operator in enumerate(node.ops):
                other = COMPARISONS[type(operator)]()
                yield ast.Compare(node.left, [*node.ops[:k], other, *node.ops[k + 1 :]], node.comparators)
        case ast.BoolOp():
            for k in range(len(node.values)):
                rest = [*node.values[:k], *node.values[k + 1 :]]
                yield rest[0] if len(rest) == 1 else ast.BoolOp(node.op, rest)
        case ast.UnaryOp(op=ast.Not() | ast.USub()):
            yield node.operand
        case ast.BinOp() if type(node.op) in ARITHMETIC and not _is_of_types(node):
            yield ast.BinOp(node.left, ARITHMETIC[type(node.op)](), node.right)
        case ast.Constant():
            yield from (ast.Constant(value) for value in _constants(node.value))
        case ast.Call():
            yield from _calls(node)
        case ast.AugAssign() | ast.Raise() | ast.Continue() | ast.Break() | ast.Expr(value=ast.Call()):
            yield ast.Pass()
        case ast.Assign() if any(isinstance(target, ast.Attribute | ast.Subscript) for target in node.targets):
            yield ast.Pass()
    if isinstance(parent, ast.If | ast.IfExp) and name == "test" and not _is_turned_round_anyway(node):
        yield ast.UnaryOp(ast.Not(), node)
    if name == "ifs":
        yield ast.Constant(value=True)


def _is_of_types(node):
    """Return whether `a | b` joins types, as in `isinstance(x, A | B)` and in names of types."""
    sides = (node.left, node.right)
    none = any(isinstance(side, ast.Constant) and side.value is None for side in sides)
    return isinstance(node.op, ast.BitOr) and (none or all(ast.unparse(side)[0].isupper() for side in sides))


def _is_turned_round_anyway(node):
    is_exact = isinstance(node, ast.Compare) and len(node.ops) == 1 and isinstance(node.ops[0], EXACT)
    return is_exact or (isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not))


def _constants(value):
    if isinstance(value, bool):
        return [not value]
    if isinstance(value, int) and abs(value) < LARGE:
        return [value + 1]
    if isinstance(value, int):
        return [value * 2, value // 2]
    if isinstance(value, float) and value not in UNITS:
        return [value * 2.0, value / 2.0] if value else [1.0]
    return []


def _calls(node):
    name = getattr(node.func, "attr", getattr(node.func, "id", ""))
    if name in CALLS:
        other = ast.Attribute(node.func.value, CALLS[name], ast.Load()) if hasattr(node.func, "attr") else None
        yield ast.Call(other or ast.Name(CALLS[name], ast.Load()), node.args, node.keywords)
    if name == "abs" and len(node.args) == 1:
        yield node.args[0]
