"""What a third party's plugin brings is used: readers of measurements, forms of reports, executors of batches."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest

from ncfix import hookspecs, plugins
from ncfix.diagnostics import ExitCode

PLUGIN = """
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ncfix.hookspecs import hookimpl
from ncfix.measure.measurement import Measurement

used = []


def read(text, path):
    if not text.startswith("LASER"):
        return None
    rows = [line.split() for line in text.splitlines()[1:]]
    columns = {"position": np.array([float(a) for a, _ in rows]), "value": np.array([float(b) for _, b in rows])}
    labels = {"axis": ("X",) * len(rows), "component": ("EXX",) * len(rows)}
    headers = (("ncfix-measurement", "1"), ("kind", "axis"), ("noise_um", "0.1"))
    return Measurement("axis", headers, columns, labels, np.arange(2, len(rows) + 2), path)


def form(document):
    return "\\n".join(section.heading for section in document.sections).encode()


def threads(workers):
    used.append(workers)
    return ThreadPoolExecutor(workers)


@hookimpl
def register_readers(register):
    register(read, name="laser")


@hookimpl
def register_reporters(register):
    register(form, name=".txt")


@hookimpl
def register_executors(register):
    register(threads, name="threads")
"""


@pytest.fixture(autouse=True)
def plugin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The plugin, installed beside the built-in ones."""
    (tmp_path / "third_party_of_a_test.py").write_text(PLUGIN)
    monkeypatch.syspath_prepend(tmp_path)
    found = plugins.collect([*plugins.installed(), EntryPoint("third", "third_party_of_a_test", hookspecs.GROUP)])
    monkeypatch.setattr(plugins, "load_plugins", lambda: found)
    yield
    sys.modules.pop("third_party_of_a_test", None)


def test_a_reader_knows_an_instruments_file(ncfix: Any, shop: Any) -> None:
    machine, data = shop.folder / "bare.toml", shop.folder / "x.las"
    machine.write_text(shop.perfect.read_text())
    data.write_text("LASER\n" + "".join(f"{x} {1e-4 * x:.6f}\n" for x in range(0, 501, 50)))
    out = shop.folder / "calibrated.toml"
    result = ncfix("calibrate", data, "-m", machine, "--effects", "EXX", "-o", out)
    assert result.code == ExitCode.DONE, result.err
    assert "EXX" in out.read_text()


def test_a_report_has_the_form_that_its_suffix_says(ncfix: Any, shop: Any) -> None:
    assert ncfix("report", shop.machine, "-o", shop.folder / "page.txt").code == ExitCode.DONE
    assert (shop.folder / "page.txt").read_text().startswith("three axes\n")


def test_a_batch_runs_where_it_is_told_to(ncfix: Any, shop: Any) -> None:
    other = shop.folder / "other.ngc"
    other.write_bytes(shop.program.read_bytes())
    command = ("fix", shop.program, other, "-m", shop.machine, "--assume-zero", "--jobs", 2)
    assert ncfix(*command, "-o", shop.folder / "here").code == ExitCode.DONE
    assert ncfix(*command, "-o", shop.folder / "there", "--executor", "threads").code == ExitCode.DONE
    assert sys.modules["third_party_of_a_test"].used == [2]
    for name in ("part.ngc", "other.ngc"):
        assert (shop.folder / "here" / name).read_bytes() == (shop.folder / "there" / name).read_bytes()
