"""ncfix as functions: what the verbs of the command line do, on values.

Programs, machines and measurements are values, or the paths of files with them. No file is touched unless its path is
given: `output=` writes the result, whole or not at all; never in the place of an input, and in that of another file
only if `force` says so. That is looked at before anything is computed. docs/api.md shows each function at work.

What is refused stands in the result; to write a result of which something is refused raises `RefusedError`, unless it
is allowed. All errors are `ncfix.diagnostics.NcfixError`, with codes; a function called as no function can be, with two
sources for one, say, raises TypeError.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ncfix.api.measurements import Calibrated as Calibrated
    from ncfix.api.measurements import calibrate as calibrate
    from ncfix.api.measurements import diagnose as diagnose
    from ncfix.api.measurements import plan as plan
    from ncfix.api.programs import PathErrors as PathErrors
    from ncfix.api.programs import fix as fix
    from ncfix.api.programs import fixed as fixed
    from ncfix.api.programs import simulate as simulate
    from ncfix.api.programs import verify as verify
    from ncfix.api.sources import load_machine as load_machine
    from ncfix.api.sources import read_program as read_program
    from ncfix.api.tables import emulate as emulate
    from ncfix.api.tables import export as export
    from ncfix.api.tables import report as report
    from ncfix.api.tables import table_request as table_request

TOPICS = {
    "sources": ("load_machine", "read_program"),
    "measurements": ("Calibrated", "calibrate", "diagnose", "plan"),
    "programs": ("PathErrors", "fix", "fixed", "simulate", "verify"),
    "tables": ("emulate", "export", "report", "table_request"),
}
"""Module -> its functions and values; it is imported when one of them is asked for."""

HOMES = {name: topic for topic, names in TOPICS.items() for name in names}


def __getattr__(name: str) -> Any:
    """A function, or the value that one gives."""
    if name not in HOMES:
        raise AttributeError(f"module 'ncfix.api' has no attribute {name!r}")
    found = globals()[name] = getattr(import_module(f"ncfix.api.{HOMES[name]}"), name)
    return found


def __dir__() -> list[str]:
    return sorted(HOMES)
