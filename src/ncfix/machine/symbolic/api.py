"""The one entrance: derive the formulas of a machine or of a chain."""

from __future__ import annotations

from collections.abc import Iterable
from fnmatch import fnmatchcase

from ncfix.diagnostics import UsageError
from ncfix.machine.machine import Machine
from ncfix.machine.symbolic.chain import Chain
from ncfix.machine.symbolic.derivation import Derivation, derive_chain
from ncfix.machine.symbolic.errors import DEFAULT
from ncfix.machine.symbolic.from_machine import from_machine


def derive(
    source: Machine | Chain,
    order: int = 1,
    include: str | Iterable[str] | None = None,
    lettered: bool = False,
    linear_trig: bool = False,
) -> Derivation:
    """Nominal formulas, and error formulas to an order, of a machine or of a chain of elementary transformations.

    order        1, 2, ...: products of more errors than this are left out
    include      which errors: names or patterns such as "E?C"; for a machine also the groups "motions", "locations",
                 "spindle" and "machine" (what its file has). None: all motions and locations; all errors of a chain
    lettered     of a machine: fixed angles of axes become variables instead of exact constants
    linear_trig  sin t = t and cos t = 1 for errors, as Freeman and Ford have it: not true from second order on

    Raises `UsageError` NCF392 (order) and NCF393 (an error that is not there).
    """
    if isinstance(source, Machine):
        source = from_machine(source, DEFAULT if include is None else include, lettered)
    elif include is not None:
        source = _only(source, [include] if isinstance(include, str) else list(include))
    return derive_chain(source, order, linear_trig)


def _only(chain: Chain, patterns: list[str]) -> Chain:
    names = [variable.name for variable in chain.smalls]
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            raise UsageError.of("NCF393", f"{pattern!r} names no error of this chain", hint=" ".join(names))
    return chain.without(name for name in names if not any(fnmatchcase(name, pattern) for pattern in patterns))
