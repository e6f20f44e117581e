"""The arguments of macro calls: which local variable each address sets.

Source: Fanuc 30i operator's manual, "Custom macro", "Argument specification".
"""

from __future__ import annotations

from collections.abc import Iterable

from ncfix.control.faults import Fault
from ncfix_iso.rs274.parameters import Store

ONCE = dict(
    zip(
        "ABCIJKDEFHMQRSTUVWXYZ",
        (1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 13, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26),
        strict=True,
    )
)
"""Argument specification I: one variable for each address."""

SETS = 10
"""Argument specification II: I J K may stand so many times."""

LENGTHS = frozenset("ABCIJKQRUVWXYZ")
"""Arguments whose numbers count least increments of their address when they have no decimal point."""


def local_variables(arguments: Iterable[tuple[str, float, bool]]) -> Store:
    """The local variables that arguments (address, value, known only at run time) set, in the order written."""
    store = Store()
    count, last = 1, 0
    for address, value, runtime in arguments:
        if address not in ONCE:
            raise Fault("NCF221", f"{address} cannot be an argument of a macro")
        number = ONCE[address]
        if address in "IJK":
            position = "IJK".index(address) + 1
            count += position <= last
            last = position
            number = 3 * count + position
            if count > SETS:
                raise Fault("NCF221", f"I, J and K may stand {SETS} times in a macro call")
        store.assign(number, value, runtime)
    return store
