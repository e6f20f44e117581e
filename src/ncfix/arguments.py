"""The numbers and choices that functions take; the options of the command line take the same."""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Integral, Real
from typing import Any

from ncfix.diagnostics import UsageError
from ncfix.values import frozen


@frozen
class NumberRange:
    """The finite numbers from `low` to `high`.

    inside  neither end is one of them
    whole   only integers
    """

    low: float
    high: float = math.inf
    inside: bool = False
    whole: bool = False

    def has(self, value: object) -> bool:
        """Whether this is one of them; "not a number" is none."""
        if not isinstance(value, (Integral if self.whole else Real)):
            return False
        number: Any = value
        within = self.low < number < self.high if self.inside else self.low <= number <= self.high
        return bool(within and number < math.inf)

    def check(self, name: str, value: object) -> None:
        """Refuse another number, given under this name: `UsageError` NCF025."""
        if not self.has(value):
            number = "an integer" if self.whole else "a number"
            if self.low == -math.inf:
                raise UsageError.of("NCF025", f"{name}={value!r}", hint=f"{number} that is finite")
            low = f"above {self.low:g}" if self.inside else f"from {self.low:g}"
            high = "" if self.high == math.inf else f"{' and below' if self.inside else ' to'} {self.high:g}"
            raise UsageError.of("NCF025", f"{name}={value!r}", hint=f"{number} {low}{high}")


def check_choice(name: str, value: object, known: Sequence[str]) -> None:
    """Refuse what is none of the choices that there are: `UsageError` NCF025."""
    if value not in known:
        raise UsageError.of("NCF025", f"{name}={value!r}", hint=f"one of {', '.join(known)}")


OFFSET_AXES = tuple("XYZABCUVW")
"""The axes that a set-up may name."""
FINITE = NumberRange(-math.inf, inside=True)
"""Any number that is one."""
TOLERANCE_UM = NumberRange(0.01)
"""No control has digits for a finer tolerance, and pieces without number would be sought for it."""
TARGET_UM = NumberRange(0.0, inside=True)
"""How much correction may be lost between the points of a table."""
TOOL_LENGTH = NumberRange(0.0, 5000.0)
"""mm: no tool is longer."""
FAULT = NumberRange(0.0, 1e6)
"""How large each fault of a measurement is."""
PRUNE = NumberRange(0.5, 1.0, inside=True)
"""The significance that a coefficient must have to stay."""
KNOTS = NumberRange(0, whole=True)
SEED = NumberRange(0, whole=True)
POSES = NumberRange(1, whole=True)
"""How many poses a plan has."""
BLOCK_NUMBERS = ("same", "none", "renumber")
"""What becomes of block numbers; see `FixOptions`."""
LOSSES = ("auto", "none", "huber", "tukey")
"""What values far off count in a calibration."""
PLANS = ("tcp", "tcp6", "probe", "length")
"""The kinds of measurements that are planned."""
