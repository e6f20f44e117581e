"""Fixtures for all floors: the shared data beside the project, and whether what is missing may be skipped."""

from __future__ import annotations

import gc
import os
import time
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path

import hypothesis
import pytest

from ncfix import core
from ncfix.__main__ import YOUNG

gc.set_threshold(YOUNG)


def pytest_collection_finish() -> None:
    """What the tests are made of stays: it need not be gone through for cycles."""
    gc.freeze()


FULL = os.environ.get("NCFIX_FULL", "") not in ("", "0")
"""Whether grids of cases are taken whole (`make full`): where cases prove one rule, a usual run takes some of them."""


def some(cases: int) -> int:
    """Of so many cases that are drawn at random to prove one rule: how many this run takes, a fifth or all."""
    return cases if FULL else -(-cases // 5)


hypothesis.settings.register_profile(
    "same every time", deadline=None, derandomize=True, max_examples=some(hypothesis.settings.default.max_examples)
)
hypothesis.settings.register_profile("searching", deadline=None)
hypothesis.settings.register_profile(  # that a test fails is enough: no smaller example is looked for
    "mutant", deadline=None, derandomize=True, phases=(hypothesis.Phase.explicit, hypothesis.Phase.generate)
)
PROFILES = {"NCFIX_SEARCH": "searching", "NCFIX_MUTANT": "mutant"}
hypothesis.settings.load_profile(
    next((profile for name, profile in PROFILES.items() if os.environ.get(name)), "same every time")
)

ROOT = Path(__file__).resolve().parents[1]
FIGURES = "figures"
PATIENCE_S = 60.0
"""How long something is waited for that takes a second or two, on a computer that does much else."""


@pytest.fixture(scope="session")
def root() -> Path:
    """The project's root: where pyproject.toml is."""
    return ROOT


@pytest.fixture(scope="session")
def shared() -> Callable[[str], Path]:
    """`shared("corpus")`: that folder of the shared data, beside the project root or where `NCFIX_SHARED` says.

    Where it is missing the test is skipped, or fails if `NCFIX_REQUIRE_SHARED=1`.
    """
    base = Path(os.environ.get("NCFIX_SHARED") or ROOT.parent / "shared")

    def find(subdir: str) -> Path:
        folder = base / subdir
        if not folder.exists():
            missing(f"shared data {folder} is not here (NCFIX_SHARED says where)", "NCFIX_REQUIRE_SHARED")
        return folder

    return find


@pytest.fixture
def figures(record_property: Callable[[str, object], None]) -> Callable[[str], None]:
    """`figures("140 files compared")`: printed at the end of the run, also where tests run in worker processes."""
    return lambda text: record_property(FIGURES, text)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print what the tests have measured."""
    reports = [report for outcome in ("passed", "failed") for report in terminalreporter.getreports(outcome)]
    for report in reports:
        for name, text in report.user_properties:
            if name == FIGURES:
                terminalreporter.write_line(str(text))


@pytest.fixture(autouse=True)
def _own_form() -> Iterator[None]:
    """After each test the core is used as the environment says."""
    yield
    core.use(None)


@pytest.fixture
def plain_form() -> None:
    """The plain form of the core, for tests that compare it with the compiled one; `missing` without that."""
    require_core()


def require_core() -> None:
    """Take the plain form of the core; `missing` if there is no compiled one to compare it with."""
    if core.fault():
        missing(f"the core is {core.fault()}", "NCFIX_REQUIRE_TOOLS")
    core.use("plain")


def use_form(compiled: bool) -> None:
    """Take the compiled form of the core, or skip the test if there is none; or the plain form."""
    if compiled:
        require_core()
    core.use("compiled" if compiled else "plain")


def require_module(name: str) -> None:
    """`missing` if an optional package is not installed."""
    if not find_spec(name):
        missing(f"{name} is not installed", "NCFIX_REQUIRE_TOOLS")


def until(condition: Callable[[], object]) -> None:
    """Wait for something; fails after `PATIENCE_S`."""
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end, "it did not come"
        time.sleep(0.02)


def missing(reason: str, variable: str) -> None:
    """Skip the test for want of something, or fail if the environment variable says that it must be here."""
    if os.environ.get(variable, "") not in ("", "0"):
        pytest.fail(reason)
    pytest.skip(reason)
