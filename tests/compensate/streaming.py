"""Programs of any dialect corrected part by part and as a whole, and the comparison of both."""

from __future__ import annotations

from collections.abc import Mapping
from tempfile import TemporaryFile
from typing import Any

import pytest

from ncfix.cli.streams import Outlet
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import Stream, Streamed, fix_program
from ncfix.compensate.following import Task
from ncfix.compensate.workers import OpenFiles
from ncfix.control.setup import Setup
from ncfix.control.trace import NotInPartsError
from ncfix.machine import Machine
from ncfix.text.dialect import get
from ncfix.text.reader import read

OPTIONS = FixOptions(tolerance_um=5.0, allow_refused=True)
SETUP = Setup(assume_zero=True)
FIGURES = ("error_before_um", "error_after_um", "max_correction_um")

Found = tuple[bytes, dict[str, Any]]


def streamed(
    source: bytes,
    machine: Machine,
    dialect: str,
    size: int,
    jobs: int = 1,
    setup: Setup = SETUP,
    files: Mapping[str, bytes] | None = None,
) -> Found:
    """Text and report of a program that is corrected in parts of so many bytes; raises `NotInPartsError`."""
    task = Task(machine, setup, OPTIONS, (files or {}).get, "p.nc", get(dialect), size, source[: 1 << 16])
    text, done = run(task, source, jobs)
    stamp = done.stamp
    assert text[stamp.at : stamp.at + len(stamp.written)] == stamp.written
    return text[: stamp.at] + stamp.wanted + text[stamp.at + len(stamp.written) :], done.report.as_dict()


def run(task: Task, source: bytes, jobs: int) -> tuple[bytes, Streamed]:
    """What is written, with its stamp as it was first, and what is said; all processes read the text from a file."""
    with TemporaryFile(buffering=0) as given, TemporaryFile(buffering=0) as out:
        given.write(source)
        given.seek(0)
        outlet = Outlet(out, direct=False, stamped=lambda: False)
        done = Stream(task, given.read, outlet.put, jobs, OpenFiles(given.fileno(), True, out.fileno())).run()
        return out.read(), done


def whole(
    source: bytes,
    machine: Machine,
    dialect: str,
    setup: Setup = SETUP,
    files: Mapping[str, bytes] | None = None,
) -> Found:
    """The same as a whole."""
    fixed = fix_program(read(source, "p.nc", dialect), machine, setup, OPTIONS, (files or {}).get)
    return fixed.text, fixed.report.as_dict()


def assert_alike(found: Found, expected: Found) -> None:
    """The same bytes, and the same report but for the last digit of figures."""
    assert found[0].decode("latin-1") == expected[0].decode("latin-1")
    for name, value in expected[1].items():
        if name in FIGURES:
            assert found[1][name] == pytest.approx(value, abs=2e-4), name
        else:
            assert found[1][name] == value, name


def compared(
    source: bytes,
    machine: Machine,
    dialect: str,
    size: int,
    jobs: int = 1,
    setup: Setup = SETUP,
    files: Mapping[str, bytes] | None = None,
    expected: Found | None = None,
) -> str:
    """Why a program was not corrected in parts; empty if it was, and came out as it does as a whole (`expected`)."""
    try:
        found = streamed(source, machine, dialect, size, jobs, setup, files)
    except NotInPartsError as error:
        return str(error)
    assert_alike(found, expected or whole(source, machine, dialect, setup, files))
    return ""
