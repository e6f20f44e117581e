"""The variables of Macro B: local to a call level, common, and those that the control keeps.

`NaN` is vacant. What exists only at run time is marked, as in RS274; so is the machine's position: compensation
changes what a program reads there, so nothing that is computed from it can be corrected.
Source: Fanuc 30i operator's manual, "Custom macro", "System variables".
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ncfix.control.expressions import Fault, Unknown, Value, nominal
from ncfix_fanuc.macro.expressions import VACANT
from ncfix_iso.rs274.parameters import OUT_OF_RANGE, READ_ONLY_FAULT, Key, NumberedParameters, Store

LOCAL = range(1, 34)
"""#1 to #33 belong to the call level."""

LASTING = (range(400, 1000), range(900_000, 907_400))
"""Common variables that other programs find as this one has left them; #400 and #900000 on are Mitsubishi's."""

COMMON = (range(100, 200), *LASTING, range(98000, 98500))
LAST = 149_999
"""The control's own variables end here."""

POSITIONS = (range(5001, 5021), range(5021, 5041), range(5041, 5061))
"""End of the block before, machine position, present position."""

POSITION_READ = "NCF241"


@dataclass(slots=True)
class MacroVariables(NumberedParameters):
    """All variables.

    scopes    the local variables of each call level, the main program's first
    position  called when the program reads where the machine stands
    unset     called with the number of a common variable, or one that a caller gives, that is read and was never set
    inherits  the program is called by another one: so are its local variables set
    """

    position: Callable[[int], None] = lambda index: None
    unset: Callable[[int], None] = lambda index: None
    inherits: bool = False

    def numbered(self, index: int) -> Value:
        """The value of `#index`, vacant if it has none; raises `Fault`."""
        if index == 0:
            return VACANT
        if not exists(index):
            raise Fault(OUT_OF_RANGE, f"there is no variable #{index}")
        store = self.store_of(index)
        if index in self.live:
            return self.from_control(index)
        if index not in store and self.is_left_over(index):
            self.unset(index)
            return Unknown(f"#{index}")
        return store.get(index, Unknown(f"#{index}") if is_system(index) else VACANT)

    def is_left_over(self, index: int) -> bool:
        """Whether a variable that the program has not set may have a value from another program."""
        return is_common(index) or (self.inherits and len(self.scopes) == 1)

    def from_control(self, index: int) -> Value:
        """A value that the control computes; a position is not what it will be when the program is corrected."""
        self.changes += 1
        value = self.live[index]()
        if any(index in positions for positions in POSITIONS):
            self.position(index)
            return Unknown(f"#{index}", nominal(value))
        return value

    def store_of(self, index: Key) -> Store:
        """Where a variable is kept."""
        return self.scopes[-1] if index in LOCAL else self.numbers

    def check_writable(self, key: Key) -> None:
        """Raise `Fault` if the program may not assign to the variable."""
        if key == 0 or not isinstance(key, int):
            raise Fault(READ_ONLY_FAULT, "#0 is always vacant and cannot be assigned to")
        if not exists(key):
            raise Fault(OUT_OF_RANGE, f"there is no variable #{key}")
        if any(key in positions for positions in POSITIONS):
            raise Fault(READ_ONLY_FAULT, f"#{key} cannot be assigned to: it is where the machine stands")


def is_common(index: int) -> bool:
    """Whether all programs share a variable."""
    return any(index in numbers for numbers in COMMON)


def is_lasting(index: int) -> bool:
    """Whether other programs find a variable as this one has left it."""
    return any(index in numbers for numbers in LASTING)


def exists(index: int) -> bool:
    """Whether some control of the family has a variable."""
    return 0 < index <= LAST or is_common(index)


def is_system(index: Key) -> bool:
    """Whether a variable is one of the control's own."""
    return isinstance(index, int) and index not in LOCAL and not is_common(index)
