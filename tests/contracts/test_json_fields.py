"""What `--json` prints: the fields that are promised are there, and what is there is in docs/formats.md."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cli.conftest import Ncfix, Shop

NO_SETUP = ("--offset", "G54=0,0,0", "--tool", "0=0")
FIGURES = {"max": float, "rms": float}
WHERE = {**FIGURES, "where": int}

PROMISED: dict[str, dict[str, Any]] = {
    "fix": {
        "files": [
            {
                "path": str,
                "dialect": str,
                "output": str,
                "blocks": int,
                "moves": int,
                "inserted_blocks": int,
                "max_correction_um": float,
                "error_before_um": FIGURES,
                "error_after_um": WHERE,
                "refused": list,
                "warnings": list,
            }
        ]
    },
    "check": {"files": [{"path": str, "dialect": str, "blocks": int, "moves": int, "findings": list}]},
    "trace": {"path": str, "columns": list, "rows": list},
    "verify": {"original": str, "fixed": str, "error_before_um": WHERE, "error_after_um": WHERE, "within": bool},
    "simulate": {"path": str, "error_um": WHERE},
    "machine check": {"path": str, "ok": bool, "name": str, "hash": str},
    "plan": {"kind": str, "count": int, "worst_um": float, "mean_um": float, "determined": int, "unseen": list},
    "export": {
        "control": str,
        "files": list,
        "class": str,
        "assumptions": list,
        "residual_um": {"before": FIGURES, "after": {**FIGURES, "at": dict}},
        "limits": dict,
    },
    "emulate": {"control": str, "files": list, "class": str, "residual_um": {"before": FIGURES, "after": FIGURES}},
    "dialects": {"dialects": [{"name": str, "title": str, "suffixes": list}]},
}


def lines(shop: Shop) -> dict[str, tuple[object, ...]]:
    """A command line of each verb."""
    out = shop.folder / "fixed.ngc"
    return {
        "fix": ("fix", shop.program, "-m", shop.machine, "-o", out, *NO_SETUP),
        "check": ("check", shop.program),
        "trace": ("trace", shop.program),
        "verify": ("verify", shop.program, shop.program, "-m", shop.perfect),
        "simulate": ("simulate", "--program", shop.program, "-m", shop.machine, *NO_SETUP),
        "machine check": ("machine", "check", shop.machine),
        "plan": ("plan", "-m", shop.machine, "--effects", "EXX", "-n", "6", "-o", shop.folder / "plan.csv"),
        "export": ("export", "linuxcnc", "-m", shop.machine, "-o", shop.folder / "tables"),
        "emulate": ("emulate", "linuxcnc", shop.folder / "tables", "-m", shop.machine),
        "dialects": ("dialects",),
    }


def assert_has(found: Any, promised: Any, where: str = "") -> None:
    """Every promised field is there, of its type."""
    if isinstance(promised, dict):
        assert isinstance(found, dict), where
        for name, wanted in promised.items():
            assert name in found, f"{where}.{name}"
            assert_has(found[name], wanted, f"{where}.{name}")
    elif isinstance(promised, list):
        assert found, where
        for each in found:
            assert_has(each, promised[0], where)
    else:
        assert isinstance(found, (int, float) if promised is float else promised), where


def names(found: Any) -> Iterator[str]:
    """The fields of an object and of the objects that it lists, not of those deeper down."""
    for name, value in found.items():
        yield name
        if isinstance(value, list) and value and isinstance(value[0], dict):
            yield from value[0]


def section(root: Path, verb: str) -> str:
    """What docs/formats.md says of a verb."""
    found = re.search(
        rf"^### `ncfix {verb}\b.*?(?=^##|\Z)", (root / "docs/formats.md").read_text(), re.MULTILINE | re.DOTALL
    )
    assert found
    return found[0]


DESCRIBED_ELSEWHERE = {"id", "text", "source", "default", "verify"}
"""Of assumptions, which `export` describes."""


@pytest.mark.parametrize("verb", PROMISED)
def test_the_promised_fields_are_there_and_all_fields_are_documented(
    root: Path, shop: Shop, ncfix: Ncfix, verb: str
) -> None:
    commands = lines(shop)
    if verb == "emulate":
        assert ncfix(*commands["export"]).code == 0
    result = ncfix(*commands[verb], "--json")
    assert result.code == 0, result.err
    found = json.loads(result.out)
    assert found["schema"] == 1
    assert_has(found, PROMISED[verb])
    said = section(root, verb) + (section(root, "export") if verb == "emulate" else "")
    undocumented = {name for name in names(found) if not re.search(rf"\b{name}\b", said)}
    assert undocumented <= DESCRIBED_ELSEWHERE


@pytest.mark.parametrize("verb", PROMISED)
def test_what_fails_says_so_in_json(shop: Shop, ncfix: Ncfix, verb: str) -> None:
    shop.machine.write_text("nonsense")
    shop.perfect.write_text("nonsense")
    shop.program.write_bytes(b"\0")
    result = ncfix(*lines(shop)[verb], "--json")
    found = json.loads(result.out)
    assert result.code == (0 if verb == "dialects" else 3)
    if verb != "dialects":
        errors = found["errors"] if "errors" in found else found["files"][0]["errors"]
        assert all(error["code"].startswith("NCF") and error["text"] and error["hint"] for error in errors)
