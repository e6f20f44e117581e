"""What is in force while a SINUMERIK program is followed, besides the modal state that all controls have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ncfix.control.frames import ZEROS

if TYPE_CHECKING:
    from ncfix_siemens.sinumerik.cycles import Drilling

NO_SYSTEM = "G500"
"""The name under which the setup may give what is in force while no settable frame is."""


@dataclass(slots=True)
class Modes:
    """What is in force besides the modal state that all controls have.

    added        what of the shift of the programmable frame is the additive part (ATRANS, G59), mm and rad; None where
                 nobody can say
    fine         G59 has set that part
    diameter     "", "DIAMON" or "DIAM90"
    said         the program or the setup has said whether X is a diameter
    pole         of polar coordinates in the frame of the program, mm; None until one is programmed
    carried      TRAORI or TRAFOOF, if one came after the settable frame and no motion has come since
    in_plane     the plane has not changed since the start: a pole that nobody has set is the zero point
    polar        the last AP and RP
    transformed  TRAORI is on
    swivelled    CYCLE800 has tilted the plane
    modal_cycle  what MCALL calls after each block with a motion
    orientation  ORIAXES, ORIVECT or another way in which the tool turns, lower case
    orientation_in_machine  ORIMKS
    rounds       RNDM rounds all corners
    angles       ORIEULER, ORIRPY or ORIRPY2, lower case: what A2 B2 C2 are
    """

    added: Sequence[float] | None = ZEROS
    fine: bool = False
    diameter: str = ""
    said: bool = False
    pole: tuple[float, float] | None = None
    carried: str = ""
    in_plane: bool = True
    polar: tuple[float | None, float | None] = (None, None)
    transformed: bool = False
    swivelled: bool = False
    modal_cycle: Drilling | None = None
    orientation: str = ""
    orientation_in_machine: bool = False
    rounds: bool = False
    angles: str = ""


@dataclass(slots=True)
class Named:
    """Tools that are called by name: numbers that stand for them here, beyond those that a magazine has."""

    numbers: dict[str, int] = field(default_factory=dict)

    def number(self, name: str) -> int:
        """The number of a name."""
        return self.numbers.setdefault(name, 1_000_000 + len(self.numbers))

    def name(self, number: int) -> str:
        """How people call a tool."""
        return next((name for name, known in self.numbers.items() if known == number), str(number))
