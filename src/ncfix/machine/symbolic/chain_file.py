"""Chain files: any serial chain as a list of elementary transformations, in TOML. docs/derive.md describes them.

The transformations are texts like `T(0, -e, -e/tan(Yp))` or `Rz(Cp)`, from the workpiece to the tool. They are read as
arithmetic and are never executed: the only names are those of the variables, pi, sin, cos, tan and sqrt.
"""

from __future__ import annotations

import ast
import operator
import os
from collections.abc import Callable, Mapping
from pathlib import Path

import sympy as sp

from ncfix.diagnostics import ConfigError, NcfixError, Place
from ncfix.inputs import MAX_CONFIG_BYTES, content_of
from ncfix.machine.symbolic.chain import UNITS, Chain, Expr, Rotation, Size, Step, Translation, Variable
from ncfix.toml_text import Report, TomlTable, decoded, did_you_mean, key_lines, parsed

SCHEMA = 1
OPERATORS: Mapping[type, Callable[..., Expr]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
FUNCTIONS: Mapping[str, Callable[[Expr], Expr]] = {"sin": sp.sin, "cos": sp.cos, "tan": sp.tan, "sqrt": sp.sqrt}
STEPS = ("T", "Rx", "Ry", "Rz")
UNIT_TO = 1e-9
"""Largest deviation from 1 of the squared length of a unit vector, which has about nine digits in the file."""


def load_chain(path: str | Path) -> Chain:
    """The chain that a file describes; raises `ConfigError` with every fault found (NCF302 ... NCF305, NCF391)."""
    try:
        source = content_of(os.fspath(path), MAX_CONFIG_BYTES)
    except OSError as error:
        raise ConfigError.of("NCF300", f"cannot read the chain file: {error.strerror}", Place(str(path))) from error
    return loads_chain(decoded(source, str(path), "NCF301"), str(path))


def loads_chain(text: str, path: str = "<chain>") -> Chain:
    """The chain that a text describes; raises the same errors as `load_chain`."""
    values = parsed(text, path, "NCF301")
    report = Report(path, text, key_lines(text))
    chain = _chain(TomlTable(values, (), report))
    if report.messages:
        raise ConfigError.collected(report.messages)
    return chain


def _chain(root: TomlTable) -> Chain:
    version = root.integer("ncfix-chain", required=True)
    if version not in (None, SCHEMA):
        root.note("NCF317", "ncfix-chain", f"version {version} of the chain file; this ncfix reads version {SCHEMA}")
    name = root.text("name") or "chain"
    tables = root.table("variable", required=True)
    found = [_variable(tables, name) for name in tables.values] if tables else []
    variables = tuple(variable for variable in found if variable)
    senses = {axis: -1 if axis in _texts(root, "left_handed") else 1 for axis in UNITS}
    formulas = _Formulas({variable.name: variable.sign * variable.symbol for variable in variables})
    steps = []
    for index, text in enumerate(_texts(root, "chain", True)):
        try:
            steps.append(formulas.step(text, senses))
        except _FormulaError as error:
            root.report.note("NCF391", ("chain", index), f"{text!r}: {error}", error.hint)
    x, y, z = (sp.Rational(str(part)) for part in root.numbers("tool_axis", count=3) or (0, 0, 1))
    if abs(x * x + y * y + z * z - 1) > UNIT_TO:
        root.note("NCF313", "tool_axis", "is not a unit vector")
    root.close()
    _check_steps(root, variables, steps)
    return Chain(name, variables, tuple(steps), (x, y, z))


def _texts(root: TomlTable, key: str, required: bool = False) -> list[str]:
    values = root.get(key, required)
    if values is None:
        return []
    if not isinstance(values, list) or not all(isinstance(value, str) for value in values):
        root.note("NCF304", key, "expected a list of texts")
        return []
    return values


def _variable(tables: TomlTable, name: str) -> Variable | None:
    section = tables.table(name)
    if section is None:
        return None
    size = section.choice("size", "large", "small", required=True, hint="")
    angle, value, sign = section.flag("angle"), section.number("value"), section.integer("sign")
    if sign not in (None, 1, -1):
        section.note("NCF304", "sign", f"{sign} is neither 1 nor -1")
    arguments = tuple(_texts(section, "depends_on"))
    definition, axis = section.text("definition") or "", section.flag("axis")
    section.close()
    number = None if value is None else float(value * sp.pi / 180) if angle else value
    try:
        kind = Size.SMALL if size == "small" else Size.LARGE
        return Variable(name, kind, definition, axis, angle, arguments, number, sign or 1)
    except NcfixError as error:
        tables.note("NCF391", name, error.messages[0].text, error.messages[0].hint)
        return None


def _check_steps(root: TomlTable, variables: tuple[Variable, ...], steps: list[Step]) -> None:
    smalls = [variable.symbol for variable in variables if variable.small]
    zero = dict.fromkeys(smalls, sp.Integer(0))
    for step in steps:
        if any(part.xreplace(zero).has(sp.zoo, sp.oo, sp.nan) for part in step.expressions):
            text = f"{', '.join(map(str, step.expressions))} is not finite where the small variables are zero"
            root.note("NCF391", "chain", text)
        elif isinstance(step, Rotation) and any(step.angle.diff(small).has(*smalls) for small in smalls):
            root.note("NCF391", "chain", f"the angle {step.angle} is not linear in the small variables")


class _FormulaError(Exception):
    """Raised with the fault of a formula."""

    def __init__(self, text: str, hint: str = "") -> None:
        super().__init__(text)
        self.hint = hint


class _Formulas:
    """Reads formulas in which the given names may occur."""

    def __init__(self, names: Mapping[str, Expr]) -> None:
        self._names = {**names, "pi": sp.pi}

    def step(self, text: str, senses: Mapping[str, int]) -> Step:
        """The elementary transformation that a text describes; `senses`: axis -> -1 for left-handed rotations."""
        try:
            call = ast.parse(text.strip(), mode="eval").body
        except (SyntaxError, ValueError, RecursionError) as error:
            raise _FormulaError("cannot be read") from error
        if not isinstance(call, ast.Call) or not isinstance(call.func, ast.Name) or call.func.id not in STEPS:
            raise _FormulaError("a transformation is T(x, y, z), Rx(angle), Ry(angle) or Rz(angle)")
        values = [self._value(argument) for argument in call.args]
        wanted = 3 if call.func.id == "T" else 1
        if len(values) != wanted or call.keywords:
            raise _FormulaError(f"{call.func.id} takes {wanted} {'lengths' if wanted == 3 else 'angle'}")
        if call.func.id == "T":
            return Translation((values[0], values[1], values[2]))
        axis = call.func.id[1]
        return Rotation(UNITS[axis], senses[axis] * values[0])

    def _value(self, node: ast.AST) -> Expr:
        if isinstance(node, ast.Constant) and type(node.value) in (int, float):
            return sp.Rational(str(node.value))
        if isinstance(node, ast.Name):
            if node.id not in self._names:
                raise _FormulaError(f"there is no variable {node.id!r}", did_you_mean(node.id, self._names))
            return self._names[node.id]
        if isinstance(node, ast.UnaryOp) and type(node.op) in OPERATORS:
            return OPERATORS[type(node.op)](self._value(node.operand))
        if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
            return OPERATORS[type(node.op)](self._value(node.left), self._value(node.right))
        if isinstance(node, ast.Call) and len(node.args) == 1 and not node.keywords:
            function = FUNCTIONS.get(ast.unparse(node.func))
            if function:
                return function(self._value(node.args[0]))
        text = f"{ast.unparse(node)!r} is not allowed in a formula"
        raise _FormulaError(text, "a formula has numbers, names, + - * / **, sin, cos, tan, sqrt")
