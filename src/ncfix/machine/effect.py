"""One effect: a named error component of one joint, as a sum of known functions. ISO 230-1 names.

`EYX` is the motion of axis X along Y, `EAC` its tilt about X of axis C: they change with the axis position.
`EC0Y`, `EX0C` are location errors: where and how the axis line lies. `S` is the spindle, the end of the tool branch.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from ncfix.machine.axis import Vector
from ncfix.machine.basis import Basis
from ncfix.machine.smooth import Constant

COMPONENTS = "XYZABC"
"""X Y Z: translations along the error axes, mm. A B C: rotations about them, rad."""
SPINDLE = "S"
NAME = re.compile(r"E([XYZABC])(0?)([A-Z])")

Matrix = tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True)
class Effect:
    """A component of the error of one joint: `sum coefficients * basis(u)`, u = (x - center) / scale.

    name             ISO 230-1 component
    coefficients     mm (translations) or rad (rotations)
    basis            the functions
    center, scale    of u, in the unit of the machine file
    covariance       of the coefficients
    reference        the point at which rotations cause no translation, base frame with all axes at zero, mm;
                     None: the axis point of a rotary axis, the base origin for a linear one
    range            of x: outside it the end values hold; None: the range of the axis
    input            the signal x if it is not the axis position: another axis, or a name in `State.inputs`
    times            a second signal whose u multiplies the sum
    times_center, times_scale   of that u; None: those of `center` and `scale`
    time_constant_s  the input acts through a first-order lag
    carried          a location error that carries the whole body with it, rather than the axis line only
    """

    name: str
    coefficients: tuple[float, ...]
    basis: Basis = Constant()  # noqa: RUF009
    center: float = 0.0
    scale: float = 1.0
    covariance: Matrix | None = None
    reference: Vector | None = None
    range: tuple[float, float] | None = None
    input: str | None = None
    times: str | None = None
    times_center: float | None = None
    times_scale: float | None = None
    time_constant_s: float | None = None
    carried: bool = False

    @property
    def component(self) -> int:
        """0..5 for X Y Z A B C."""
        return COMPONENTS.index(self.name[1])

    @property
    def joint(self) -> str:
        """The axis that it belongs to, or `S`."""
        return self.name[-1]

    @property
    def rotational(self) -> bool:
        """Whether it is an angle."""
        return self.component >= 3

    @property
    def location(self) -> bool:
        """Whether it tells where the axis lies, not how it moves."""
        return len(self.name) == 4

    @property
    def signal(self) -> str | None:
        """The name of the signal that its basis sees; None if it sees none."""
        if self.input is not None:
            return self.input
        return self.joint if self.basis.needs_signal else None

    @property
    def active(self) -> bool:
        """Whether any coefficient is not zero."""
        return any(self.coefficients)
