"""The plugin of the documents with tables of its own: short, as it is shown, and true to the contract."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import pytest

from ncfix.machine import load
from ncfix.tables.control import Control, Request
from ncfix.tables.correction import ranges_of
from ncfix.tables.export import export
from ncfix.testing import check_control


@pytest.fixture
def source(root: Path) -> Path:
    return root / "examples" / "third_party_tables" / "ncfix_weihong.py"


@pytest.fixture
def weihong(source: Path) -> Control:
    spec = importlib.util.spec_from_file_location("ncfix_weihong_example", source)
    assert spec is not None
    assert spec.loader is not None
    module: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    control: Control = module.Weihong()
    return control


def test_the_contract(weihong: Control) -> None:
    check_control(weihong)


def test_a_shipped_machine(weihong: Control, root: Path) -> None:
    machine = load(root / "examples" / "machines" / "three_axis.toml")
    made = export(weihong, Request(machine, ranges_of(machine), 120.0, 0.001), 500)
    assert made.left.figures()["after"]["rms"] < 0.8 * made.left.figures()["before"]["rms"]


def test_it_is_short(source: Path) -> None:
    assert 15 <= len(source.read_text().splitlines()) <= 50
