"""`ncfix derive` as it is called."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

HEAD = "examples/machines/angle_head.toml"
CHAIN = "examples/chains/angle_head.toml"


def test_the_errors_of_the_machine_file(ncfix: Any, root: Path) -> None:
    result = ncfix("derive", "-m", root / HEAD, "--effects", "machine")
    assert result.code == 0
    assert result.err == ""
    text = result.out.decode()
    assert "errors to first order" in text
    assert "+ EX0C*(1 - cos(C))" in text


def test_names_and_patterns(ncfix: Any, root: Path) -> None:
    text = ncfix("derive", "-m", root / HEAD, "--effects", "EXX,EC?", "--order", "2").out.decode()
    assert "errors to second order" in text
    assert "EXX(X)" in text
    assert "ECC(C)" in text
    assert "EYX" not in text


def test_latex(ncfix: Any, root: Path) -> None:
    assert rb"\begin{align*}" in ncfix("derive", "--chain", root / CHAIN, "--latex").out


def test_c(ncfix: Any, root: Path) -> None:
    assert b"void error(" in ncfix("derive", "--chain", root / CHAIN, "--c").out


def test_python_runs(ncfix: Any, root: Path, tmp_path: Path) -> None:
    path = tmp_path / "formulas.py"
    assert ncfix("derive", "-m", root / HEAD, "--effects", "machine", "--python", "-o", path).code == 0
    module: dict[str, Any] = {}
    exec(path.read_text(), module)
    tip = module["nominal"](0.0, 0.0, 0.0, np.deg2rad(40), np.deg2rad(30), tool_length=20.0)[:3]
    assert [f"{value:.6f}" for value in tip] == ["13.144206", "6.252881", "-18.427610"]
    assert ncfix("derive", "-m", root / HEAD, "--python", "-o", path).code == 2  # it exists
    assert ncfix("derive", "-m", root / HEAD, "--effects", "EXX", "-o", path, "--force").code == 0


def test_constant_angles_keep_their_letters_if_asked(ncfix: Any, root: Path) -> None:
    arguments = ("derive", "-m", root / HEAD, "--effects", "EXA")
    assert b"cos(5*pi/18)" in ncfix(*arguments).out
    text = ncfix(*arguments, "--letters").out
    assert b"cos(phiA)" in text
    assert b"pi/18" not in text


def test_protocol_of_the_chain(ncfix: Any, root: Path) -> None:
    text = ncfix("derive", "--chain", root / CHAIN, "--protocol", "--vary", "G").out.decode()
    assert "with Ap, Cp varied: rank 6 of 8" in text
    assert "with G varied, too: rank 7 of 8" in text
    assert "OCx\n       X(90, 0) - X(270, 180) = 2*OCx" in text


def test_protocol_of_a_machine_is_about_constants(ncfix: Any, root: Path) -> None:
    text = ncfix("derive", "-m", root / "examples/machines/three_axis.toml", "--protocol").out.decode()
    assert "with X, Y, Z varied: rank 9 of 24" in text
    assert "only in combination: EZ0S + EZ0Z\n" in text
    assert "Differences of readings" not in text  # nothing turns


def test_json(ncfix: Any, root: Path) -> None:
    found = ncfix("derive", "-m", root / HEAD, "--effects", "EXX,EZ0C", "--json").json()
    assert found["error"]["dx"] == "EXX(X)"
    assert found["without_effect"] == ["EZ0C"]
    assert found["inverse"]["A"].startswith("branch*acos(")
    assert {"name": "yC", "size": "large", "axis": False, "value": 10.0, "definition": "y of the C axis"} in found[
        "variables"
    ]


def test_json_beside_a_file(ncfix: Any, root: Path, tmp_path: Path) -> None:
    """The object goes to standard output and the formulas to the file, as each does alone."""
    call, path = ("derive", "-m", root / HEAD, "--effects", "EXX"), tmp_path / "formulas.tex"
    assert ncfix(*call, "--json", "--latex", "-o", path).out == ncfix(*call, "--json").out
    assert path.read_bytes() == ncfix(*call, "--latex").out
    refused = ncfix(*call, "--json", "--latex")
    assert refused.code == 2
    assert "--latex together with it needs -o FILE" in refused.err


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        ([], 2, "one of --machine and --chain"),
        (["-m", HEAD, "--chain", CHAIN], 2, "one of --machine and --chain"),
        (["-m", HEAD, "--order", "0"], 2, "--order"),
        (["-m", HEAD, "--effects", "EXQ"], 2, "NCF393"),
        (["-m", "none.toml"], 3, "NCF300"),
        (["--chain", "none.toml"], 3, "NCF300"),
        (["--chain", HEAD], 3, "NCF30"),
    ],
)
def test_wrong_use(
    ncfix: Any, root: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], code: int, said: str
) -> None:
    monkeypatch.chdir(root)
    result = ncfix("derive", *arguments)
    assert result.code == code
    assert said in result.err
    assert result.out == b""


def test_without_sympy_the_extra_is_named(ncfix: Any, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith("ncfix.machine.symbolic")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delattr("ncfix.machine.symbolic", raising=False)
    monkeypatch.setattr("importlib.util.find_spec", lambda name, package=None: None)
    result = ncfix("derive", "-m", root / HEAD)
    assert result.code == 2
    assert "NCF390" in result.err
    assert 'pip install "ncfix[symbolic]"' in result.err
