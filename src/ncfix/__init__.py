"""ncfix: corrects NC programs and compensation tables for the geometric errors of a machine tool.

    import ncfix

    machine = ncfix.load_machine("machine.toml")
    fixed = ncfix.fix("part.nc", machine, setup="part.setup.toml", output="part.fixed.nc")

docs/api.md describes the functions; `ncfix.api` states what holds for all of them. A function's module is imported when
it is first used.
"""

from __future__ import annotations

from ncfix.version import __version__ as __version__

TYPE_CHECKING = False  # `typing` takes longer to import than all of this
if TYPE_CHECKING:
    from typing import Any

    from ncfix.api.measurements import calibrate as calibrate
    from ncfix.api.measurements import diagnose as diagnose
    from ncfix.api.measurements import plan as plan
    from ncfix.api.programs import fix as fix
    from ncfix.api.programs import simulate as simulate
    from ncfix.api.programs import verify as verify
    from ncfix.api.sources import load_machine as load_machine
    from ncfix.api.sources import read_program as read_program
    from ncfix.api.tables import emulate as emulate
    from ncfix.api.tables import export as export
    from ncfix.api.tables import report as report

FUNCTIONS = {
    **dict.fromkeys(("load_machine", "read_program"), "sources"),
    **dict.fromkeys(("fix", "verify", "simulate"), "programs"),
    **dict.fromkeys(("plan", "calibrate", "diagnose"), "measurements"),
    **dict.fromkeys(("export", "emulate", "report"), "tables"),
}
"""Function -> the module of `ncfix.api` that defines it."""


def __getattr__(name: str) -> Any:
    """Import a function on first use."""
    if name not in FUNCTIONS:
        raise AttributeError(f"module 'ncfix' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"ncfix.api.{FUNCTIONS[name]}"), name)


def __dir__() -> list[str]:
    return sorted((*FUNCTIONS, "__version__"))
