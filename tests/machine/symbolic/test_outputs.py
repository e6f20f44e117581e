"""Text, LaTeX, Python and C: every formula is there, and what is printed computes what was derived."""

from __future__ import annotations

import ast
import ctypes
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from conftest import missing
from ncfix.machine import load
from ncfix.machine.symbolic import Chain, Derivation, Size, Variable, derive
from ncfix.machine.symbolic.chain import UNITS, Rotation, Translation
from ncfix.machine.symbolic.printing import compiled, to_c, to_latex, to_python, to_text

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def derivation() -> Derivation:
    return derive(load(ROOT / "examples/machines/angle_head.toml"), include=["EXX", "EB0C", "EA0S", "EZ0C"])


def test_text_has_the_variables_and_one_error_on_each_line(derivation: Derivation) -> None:
    text = to_text(derivation)
    assert text.startswith("gantry with angle head: errors to first order\n")
    assert re.search(r"^  yC = 10 +large  y of the C axis$", text, re.MULTILINE)
    assert re.search(r"^  EXX\(X\) +small  positioning of X$", text, re.MULTILINE)
    assert "  dx =\n    + EXX(X)\n" in text
    assert "  Cp" not in text
    assert text.endswith("Without effect: EZ0C\n")


def test_every_line_of_the_text_adds_up_to_the_error(derivation: Derivation) -> None:
    """The text is not only for people: its summands are the formula."""
    names = {name: sp.Symbol(name, real=True) for name in "XYZCA"} | {
        name: sp.Symbol(name, real=True) for name in ("tool_length", "yC", "EB0C", "EA0S")
    }
    names["EXX"] = sp.Function("EXX", real=True)
    body = to_text(derivation).split("\nError\n")[1]
    for block in re.split(r"\n(?=  (?:d|r)[xyz] = ?)", body)[1:]:
        component = block[2:4]
        summands = re.findall(r"^    [+-] .*$", block, re.MULTILINE)
        total = sp.Add(*(sp.sympify(line.strip().replace("+ ", "", 1), locals=names) for line in summands))
        assert sp.simplify(total - derivation.error[component]) == 0


def test_latex_is_balanced_and_writes_iso_symbols(derivation: Derivation) -> None:
    latex = to_latex(derivation)
    assert latex.count(r"\begin{align*}") == latex.count(r"\end{align*}") == 7
    assert latex.count("{") == latex.count("}")
    assert latex.count(r"\left(") == latex.count(r"\right)")
    assert r"E_{\mathrm{XX}}(X)" in latex
    assert r"E_{\mathrm{B0C}}" in latex
    assert r"\frac{5 \pi}{18}" in latex
    assert "tool_length" not in latex


def test_python_is_tidy_and_self_contained(derivation: Derivation) -> None:
    source = to_python(derivation)
    tree = ast.parse(source)
    imported = [node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)]
    assert [ast.unparse(node) for node in imported] == ["import numpy as np"]
    assert [node.name for node in tree.body if isinstance(node, ast.FunctionDef)] == ["nominal", "error"]
    assert max(len(line) for line in source.splitlines() if not line.startswith('    """')) <= 120
    assert "EB0C" in (ast.get_docstring(tree) or "")


def test_python_computes_what_was_derived(derivation: Derivation) -> None:
    _, error = compiled(derivation)
    rng = np.random.default_rng(4)
    values = dict(zip(("X", "Y", "Z", "C", "A"), rng.uniform(-3, 3, 5), strict=True))
    errors = {"EXX": 0.01, "EB0C": 1e-4, "EA0S": -2e-4}
    found = error(**values, tool_length=120.0, **errors)
    at = {sp.Symbol(name, real=True): value for name, value in {**values, "tool_length": 120.0, "yC": 10.0}.items()}
    at |= {v.symbol: errors.get(v.name, 0.0) for v in derivation.chain.smalls}
    expected = [float(formula.subs(at)) for formula in derivation.error.values()]
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-15)


def test_python_functions_broadcast(derivation: Derivation) -> None:
    nominal, error = compiled(derivation)
    x, c = np.linspace(0, 100, 4)[:, None], np.linspace(0, 1, 3)
    assert nominal(x, 0.0, 0.0, c, 0.0).shape == (4, 3, 6)
    assert error(x, 0.0, 0.0, c, 0.0, EXX=np.zeros((5, 1, 1))).shape == (5, 4, 3, 6)


def test_c_computes_what_python_does(derivation: Derivation, tmp_path: Path) -> None:
    """All dimensions are parameters: a tool length that nobody gives would be zero."""
    compiler = shutil.which("cc") or missing("a C compiler (cc) is not installed", "NCFIX_REQUIRE_TOOLS")
    source, made = tmp_path / "formulas.c", tmp_path / "formulas.so"
    source.write_text(to_c(derivation))
    assert max(map(len, source.read_text().splitlines())) <= 120
    strict = ("-std=c99", "-pedantic", "-Wall", "-Werror", "-shared", "-fPIC")
    subprocess.run([compiler, *strict, source, "-o", made, "-lm"], check=True)
    functions = ctypes.CDLL(str(made))
    rng = np.random.default_rng(5)
    chain = derivation.chain
    for name, function, given in zip(
        ("nominal", "error"),
        compiled(derivation),
        ((*chain.axes, *chain.dimensions), (*chain.axes, *chain.dimensions, *chain.smalls)),
        strict=True,
    ):
        values = dict(zip((each.name for each in given), rng.uniform(-3, 3, len(given)), strict=True))
        result = (ctypes.c_double * 6)()
        getattr(functions, name)(*map(ctypes.c_double, values.values()), result)
        np.testing.assert_allclose(list(result), function(**values), rtol=1e-13, atol=1e-13)


def test_no_name_leaves_the_comment_of_the_c_source() -> None:
    variable = Variable("a", Size.SMALL, "*/ int main")
    chain = Chain("*/ name", (variable,), (Rotation(UNITS["x"], variable.symbol),))
    assert to_c(derive(chain)).count("*/") == 3


def test_second_order_is_named_and_has_products() -> None:
    zero = sp.Integer(0)
    a, b = Variable("a", Size.SMALL), Variable("b", Size.SMALL)
    steps = (Rotation(UNITS["x"], a.symbol), Rotation(UNITS["y"], b.symbol), Translation((zero, zero, sp.Integer(7))))
    derivation = derive(Chain("two tilts", (a, b), steps), 2)
    assert "errors to second order" in to_text(derivation)
    assert derivation.error["dz"] == -7 * a.symbol**2 / 2 - 7 * b.symbol**2 / 2
    assert derivation.error["rz"] == a.symbol * b.symbol / 2
    assert "+ 7*b\n" in to_text(derivation)
    assert r"\delta_x &=  7\,b" in to_latex(derivation)


@pytest.mark.parametrize("name", ["lambda", "a b", "x", "", "1a", "dx", "np", "sin"])
def test_names_that_cannot_be(name: str) -> None:
    with pytest.raises(Exception, match="NCF391"):
        Variable(name)


def test_a_definition_cannot_leave_its_docstring() -> None:
    variable = Variable("a", Size.SMALL, '"""\nraise SystemExit\n"""\\')
    chain = Chain('""" name', (variable,), (Rotation(UNITS["x"], variable.symbol),))
    _, error = compiled(derive(chain))
    np.testing.assert_array_equal(error(a=1e-3), [0, 0, 0, 1e-3, 0, 0])
