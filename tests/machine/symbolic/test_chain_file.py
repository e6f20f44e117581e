"""Chain files: what they mean, and a message for every mistake."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from ncfix.diagnostics import ConfigError, UsageError
from ncfix.machine.symbolic import derive, load_chain, loads_chain, require_sympy
from ncfix.machine.symbolic.chain import UNITS, Rotation, Translation
from ncfix.machine.symbolic.printing import compiled

ROOT = Path(__file__).resolve().parents[3]
GOOD = """
ncfix-chain = 1
name = "arm"
chain = ["Rz(q)", "T(L + dL, 0, 1/3)", "Ry(-a/2)", "T(0.1*L, sin(q)**2, -sqrt(2))"]
[variable]
q = { size = "large", axis = true, angle = true }
L = { size = "large", value = 100, definition = "length of the arm" }
dL = { size = "small", depends_on = ["q"] }
a = { size = "small", angle = true }
"""
q, L, a = sp.symbols("q L a", real=True)


def test_what_it_means() -> None:
    chain = loads_chain(GOOD)
    dL = sp.Function("dL", real=True)(q)
    assert chain.name == "arm"
    assert chain.steps == (
        Rotation(UNITS["z"], q),
        Translation((L + dL, sp.Integer(0), sp.Rational(1, 3))),
        Rotation(UNITS["y"], -a / 2),
        Translation((L / 10, sp.sin(q) ** 2, -sp.sqrt(2))),
    )
    assert [v.name for v in chain.axes] == ["q"]
    assert chain.variable("L").value == 100
    assert derive(chain).error["dx"].coeff(dL) == sp.cos(q)


def test_angles_are_degrees_in_the_file_and_radians_inside() -> None:
    chain = load_chain(ROOT / "examples/chains/angle_head.toml")
    assert chain.variable("Yp").value == pytest.approx(50 * np.pi / 180, abs=1e-15)


def test_clockwise_variables_and_left_handed_axes() -> None:
    """Both turn the other way; two of them cancel."""
    plain = GOOD.replace('"Rz(q)"', '"Rz(q)", "Rx(a)"')
    sign = plain.replace("angle = true }\n", "angle = true, sign = -1 }\n", 1)
    left = 'left_handed = ["z"]\n'.join(plain.split('name = "arm"\n'))
    both = 'left_handed = ["z"]\n'.join(sign.split('name = "arm"\n'))
    angles = [loads_chain(text).steps[0].angle for text in (plain, sign, left, both)]  # type: ignore[union-attr]
    assert angles == [q, -q, -q, q]
    assert loads_chain(left).steps[1].angle == a  # type: ignore[union-attr]


def test_include_and_zero() -> None:
    chain = loads_chain(GOOD)
    assert [v.name for v in derive(chain, include="d*").chain.smalls] == ["dL"]
    assert derive(chain, include=[]).error["dx"] == 0
    with pytest.raises(UsageError, match="NCF393"):
        derive(chain, include="b")
    _, error = compiled(derive(chain.without(["a"])))
    assert error(0.0, dL=1.0)[0] == 1.0


@pytest.mark.parametrize(
    ("old", "new", "code", "said"),
    [
        ('"Rz(q)"', '"Rz(p)"', "NCF391", "no variable 'p'"),
        ('"Rz(q)"', '"Rw(q)"', "NCF391", "Rx(angle)"),
        ('"Rz(q)"', '"Rz(q, q)"', "NCF391", "takes 1 angle"),
        ('"Rz(q)"', '"T(q)"', "NCF391", "takes 3 lengths"),
        ('"Rz(q)"', '"Rz(q"', "NCF391", "cannot be read"),
        ('"Rz(q)"', "\"Rz(__import__('os'))\"", "NCF391", "is not allowed in a formula"),
        ('"Rz(q)"', '"Rz(q.real)"', "NCF391", "is not allowed in a formula"),
        ('"Rz(q)"', '"Rz(True)"', "NCF391", "is not allowed in a formula"),
        ('"Rz(q)"', '"Rz(a*a)"', "NCF391", "not linear"),
        ('"Rz(q)"', '"Rz(sin(a))"', "NCF391", "not linear"),
        ('"Rz(q)"', '"T(1/a, 0, 0)"', "NCF391", "where the small variables are zero"),
        ('"Rz(q)"', '"Rz(1/0)"', "NCF391", "not finite"),
        ('"Rz(q)"', "7", "NCF304", "list of texts"),
        ('q = { size = "large"', 'x = { size = "large"', "NCF391", "cannot be the name"),
        ('size = "small", angle', 'size = "tiny", angle', "NCF304", "neither large nor small"),
        ('size = "small", angle', 'sise = "small", angle', "NCF302", "sise"),
        ("axis = true, angle = true", "axis = true, angle = true, sign = 2", "NCF304", "neither 1 nor -1"),
        ("ncfix-chain = 1", "ncfix-chain = 2", "NCF317", "version 2"),
        ("ncfix-chain = 1", "", "NCF303", "ncfix-chain"),
        ('name = "arm"', 'nane = "arm"', "NCF302", "nane"),
        ('name = "arm"', "tool_axis = [0, 0, 2]", "NCF313", "unit vector"),
        ("[variable]", "[variable", "NCF301", "not TOML"),
    ],
)
def test_every_mistake_has_its_message(old: str, new: str, code: str, said: str) -> None:
    assert old in GOOD
    with pytest.raises(ConfigError) as caught:
        loads_chain(GOOD.replace(old, new, 1))
    assert code in str(caught.value)
    assert said in str(caught.value)


def test_all_mistakes_at_once_with_their_lines() -> None:
    text = GOOD.replace('"Rz(q)"', '"Rz(p)", "T(0, 0, L*dLL)"').replace("value = 100", 'value = "100"')
    with pytest.raises(ConfigError) as caught:
        loads_chain(text, "arm.toml")
    assert len(caught.value.messages) == 3
    assert all(message.place and message.place.path == "arm.toml" for message in caught.value.messages)
    assert "did you mean 'dL'?" in str(caught.value)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="NCF300"):
        load_chain(tmp_path / "none.toml")
    (tmp_path / "latin.toml").write_bytes(b'name = "\xe4"')
    with pytest.raises(ConfigError, match="NCF301"):
        load_chain(tmp_path / "latin.toml")


def test_without_sympy_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sympy", None)
    monkeypatch.setattr("ncfix.machine.symbolic.find_spec", lambda name: None)
    with pytest.raises(UsageError, match="NCF390") as caught:
        require_sympy()
    assert 'pip install "ncfix[symbolic]"' in str(caught.value)


def test_the_chain_file_and_the_python_of_the_document(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (root / "docs/derive.md").read_text()
    (toml,) = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    assert derive(loads_chain(toml)).error["dx"].has(sp.Symbol("a", real=True))
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    monkeypatch.chdir(root)
    exec(code, {})
