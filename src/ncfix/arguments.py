"""Ranges and choices of arguments, common to the functions of the API and the options of the command line."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from numbers import Integral, Real
from typing import Any

from ncfix.diagnostics import UsageError
from ncfix.values import frozen


@frozen
class NumberRange:
    """The finite numbers from `low` to `high`.

    inside  whether `low` and `high` themselves are excluded
    whole   whether only integers are allowed
    """

    low: float
    high: float = math.inf
    inside: bool = False
    whole: bool = False

    def has(self, value: object) -> bool:
        """Whether a value is in the range; NaN is not."""
        if not isinstance(value, (Integral if self.whole else Real)):
            return False
        number: Any = value
        within = self.low < number < self.high if self.inside else self.low <= number <= self.high
        return bool(within and number < math.inf)

    def check(self, name: str, value: object) -> None:
        """Refuse a value outside the range, given for the argument `name`: `UsageError` NCF025."""
        if not self.has(value):
            number = "an integer" if self.whole else "a number"
            if self.low == -math.inf:
                raise UsageError.of("NCF025", f"{name}={value!r}", hint=f"{number} that is finite")
            low = f"above {self.low:g}" if self.inside else f"from {self.low:g}"
            high = "" if self.high == math.inf else f"{' and below' if self.inside else ' to'} {self.high:g}"
            raise UsageError.of("NCF025", f"{name}={value!r}", hint=f"{number} {low}{high}")


def check_choice(name: str, value: object, known: Sequence[str]) -> None:
    """Refuse a value that is not one of the choices: `UsageError` NCF025."""
    if value not in known:
        raise UsageError.of("NCF025", f"{name}={value!r}", hint=f"one of {', '.join(known)}")


OFFSET_AXES = tuple("XYZABCUVW")
"""Axes that a setup may name."""
WORK_OFFSET = re.compile(r"G5[4-9]|G59\.[1-3]|G54\.1P[1-9]\d*|G500|G5(?:0[5-9]|[1-9]\d)|PRESET\d*")
"""Names of work offsets: G54 to G59.3, G54.1P1 and so on; of SINUMERIK G500, G505 to G599; of the TNC PRESET (the one
active when the program starts), PRESET1 and so on."""
FINITE = NumberRange(-math.inf, inside=True)
"""Any finite number."""
TOLERANCE_UM = NumberRange(0.01)
"""Tolerance, um. Controls have no digits for a finer one, and motions would be split into very many pieces."""
TARGET_UM = NumberRange(0.0, inside=True)
"""Largest correction, um, that may be lost between the points of a table."""
TOOL_LENGTH = NumberRange(0.0, 5000.0)
"""Tool length, mm."""
FAULT = NumberRange(0.0, 1e6)
"""Size of an assumed fault of a measurement."""
PRUNE = NumberRange(0.5, 1.0, inside=True)
"""Significance that a coefficient needs in order to be kept."""
KNOTS = NumberRange(0, whole=True)
SEED = NumberRange(0, whole=True)
POSES = NumberRange(1, whole=True)
"""Number of poses of a plan."""
BLOCK_NUMBERS = ("same", "none", "renumber")
"""Treatment of block numbers; see `FixOptions`."""
LOSSES = ("auto", "none", "huber", "tukey")
"""Weighting of outlying values in a calibration."""
PLANS = ("tcp", "tcp6", "probe", "length")
"""Kinds of measurements that can be planned."""
