"""Fixtures of the tests that ask the control: its interpreter, and the machines it is used with."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from conftest import missing
from differential import canon, errors


@pytest.fixture(scope="session")
def rs274() -> Callable[..., canon.Canon]:
    """LinuxCNC's interpreter (`canon.interpret`); skips without it, fails without it if `NCFIX_REQUIRE_TOOLS=1`."""
    if not canon.available():
        missing("linuxcnc-uspace (rs274 and the gcode extension) is not installed", "NCFIX_REQUIRE_TOOLS")
    return canon.interpret


@pytest.fixture(scope="session")
def machine_file() -> Callable[[str], Path]:
    """The path of a test machine by name."""
    folder = Path(__file__).with_name("machines")
    return lambda name: folder / f"{name}.toml"


@pytest.fixture(scope="session")
def machine(machine_file: Callable[[str], Path]) -> Callable[[str], errors.Machine]:
    """A test machine in the judge's own model."""
    return lambda name: errors.load(machine_file(name))
