"""The state of a control of the Fanuc family while it follows a program, in addition to that of RS274."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable

from ncfix.control.coordinates import INDEX, Vector
from ncfix.control.setup import POINTLESS, Run
from ncfix.diagnostics import Message
from ncfix.text.dialect import Dialect
from ncfix.text.tree import Template
from ncfix.values import frozen
from ncfix_fanuc.macro.variables import MacroVariables
from ncfix_iso.rs274.control import Block, RS274Control
from ncfix_iso.rs274.groups import Rules

NO_POINT = "NCF240"
DEFAULT_SYSTEM = "IS-B"
ANGLE = ",A"
"""The address of the angle of a line."""


COMPONENTS = "IJK"
"""The words of the direction of the tool (G43.5)."""


@frozen
class Scaling:
    """A scaling in force: its centre by letter index, mm in the program's frame, and its factor."""

    centre: Vector
    factor: float


class MacroControl(RS274Control):
    """`RS274Control` with the decimal-point rule, polar coordinates and the variables of Macro B.

    polar          last commanded radius and angle while G16 is in force, program units and degrees, NaN before the
                   program has named them; None otherwise
    scaling        the scaling in force (G51); None without it
    mirrored       letter index -> position at which the axis is mirrored (G51.1), mm in the program's frame
    length_code    code of the tool length offset in force (G43, G43.4, G44), 0 without
    length_number  the last H; None if the program has named none
    coming         returns the shapes of the blocks that follow in the text
    defining, definition  P of the tilted plane that is being defined, and its blocks so far by their Q
    dynamic        the work offset turns with the tables (G254 of Haas)
    posture_control  the tool turns in a plane (G43.4 P1), instead of the rotary axes evenly
    vectors        the direction of the tool is given by I J K (G43.5)
    entering       the following blocks are tool data (G10 L3)
    outside        number of the program that the block has called, if it is in the control and its text is not given
    """

    def __init__(self, run: Run, dialect: Dialect, rules: Rules) -> None:
        super().__init__(run, dialect, rules)
        self.parameters: MacroVariables = MacroVariables()
        self.polar: tuple[float, float] | None = None
        self.scaling: Scaling | None = None
        self.mirrored: dict[int, float] = {}
        self.length_code = 0
        self.length_number: int | None = None
        self.coming: Callable[[], Iterable[Template]] = lambda: ()
        self.defining = 0
        self.definition: dict[int, Block] = {}
        self.dynamic = False
        self.vectors = self.posture_control = False
        self.entering = False
        self.outside = ""

    def lasting(self) -> None:
        """None: not available for these controls; see `RS274Control`."""

    def path_word(self, words: Collection[str]) -> str:
        """See `RS274Control`; also the angle of a line, and the direction of the tool (G43.5)."""
        own = (ANGLE, *COMPONENTS) if self.vectors else (ANGLE,)
        return next((word for word in own if word in words), super().path_word(words))

    @property
    def turns_in_plane(self) -> bool:
        """See `Control`: whether the tool turns in a plane under tool-centre-point control."""
        return self.tcp and self.posture_control

    @property
    def probes_nominally(self) -> bool:
        """Always False: variables hold the machine's position, besides the result of a probe."""
        return False

    def stands_square(self) -> bool:
        """Whether the tool is known to lie along Z of a tilted plane that is in force."""
        return self.tilted and bool(self.square_to(self.rotation))

    def refresh(self) -> None:
        """Compose the offsets; a number without a point counts increments of the unit in force."""
        steps = POINTLESS.get(self.setup.no_point)
        if steps is not None:
            self.increments = (steps.mm if self.modal.unit == 1.0 else steps.inch, steps.degree)
        super().refresh()

    def least_increment(self, address: str) -> float:
        """The least increment of an address in its own unit; of the usual increment system if none is given."""
        steps = POINTLESS.get(self.setup.no_point) or POINTLESS[DEFAULT_SYSTEM]
        if address in INDEX and self.rotary[INDEX[address]]:
            return steps.degree
        return steps.mm if self.modal.unit == 1.0 else steps.inch

    def without_point(self, address: str, value: float, *, angle: bool = False) -> float:
        """The value of a number without a decimal point, by the setup: the program does not show its meaning."""
        if value == 0.0 or self.setup.no_point == "calculator":
            return value
        if self.setup.no_point in POINTLESS:
            turning = angle or (address in INDEX and self.rotary[INDEX[address]])
            return value * self.increments[1 if turning else 0]
        text = (
            f"{address}{value:g} has no decimal point, and the setup does not say whether it counts units or least "
            "increments"
        )
        hint = "--no-point IS-B: X50 is 0.050 mm; --no-point calculator: X50 is 50 mm"
        self.knowledge.missing.setdefault(NO_POINT, Message(NO_POINT, text, self.place(), hint))
        return value
