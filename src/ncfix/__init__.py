"""ncfix: knows how a particular machine tool is wrong, and makes it cut right.

    import ncfix

    machine = ncfix.load_machine("machine.toml")
    fixed = ncfix.fix("part.nc", machine, setup="part.setup.toml", output="part.fixed.nc")

docs/api.md goes through the functions; `ncfix.api` has them. Nothing is imported before one of them is asked for.
"""

from __future__ import annotations

from ncfix.version import __version__ as __version__

TYPE_CHECKING = False  # `typing` takes longer to import than all of this
if TYPE_CHECKING:
    from typing import Any

    from ncfix.api import calibrate as calibrate
    from ncfix.api import diagnose as diagnose
    from ncfix.api import emulate as emulate
    from ncfix.api import export as export
    from ncfix.api import fix as fix
    from ncfix.api import load_machine as load_machine
    from ncfix.api import plan as plan
    from ncfix.api import read_program as read_program
    from ncfix.api import report as report
    from ncfix.api import simulate as simulate
    from ncfix.api import verify as verify

FUNCTIONS = frozenset(
    ("load_machine", "read_program", "fix", "verify", "simulate", "plan", "calibrate", "diagnose", "export")
) | {"emulate", "report"}


def __getattr__(name: str) -> Any:
    """A function of `ncfix.api`."""
    if name not in FUNCTIONS:
        raise AttributeError(f"module 'ncfix' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module("ncfix.api"), name)


def __dir__() -> list[str]:
    return sorted((*FUNCTIONS, "__version__"))
