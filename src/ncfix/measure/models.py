"""Sets of effects with a name: the models of S. Esmaeili Marzdashti, PhD thesis, Polytechnique Montreal, 2021.

Location errors are inter-axis errors, carried by what follows (`carried`). Error motions are ordinary cubics in mm and
rad, Eq. 19; `b` is a backlash. The models of 10 and 12 have no length standard: EYY and EZZ are gains relative to X.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ncfix.diagnostics import UsageError
from ncfix.machine import Effect, Machine
from ncfix.machine.axes import SPINDLE
from ncfix.machine.basis import Backlash, Polynomial

TERM = re.compile(r"([XYZABC][A-Z])(\d|b)(?:-(\d))?")
RADIAN = 180 / np.pi
"""The file's unit of a rotary axis is the degree: this scale makes u radians."""


@dataclass(frozen=True, slots=True)
class Model:
    """A named set: location errors, and terms of error motions such as `YX2-3` or `BBb`."""

    name: str
    title: str
    located: tuple[str, ...]
    motions: str = ""

    def effects(self, machine: Machine) -> list[Effect]:
        """The effects with zero coefficients; raises `UsageError` NCF635 if the machine lacks an axis."""
        found = [Effect(name, (0.0,), carried=not name.endswith(SPINDLE)) for name in self.located]
        found += [effect for text in self.motions.split() for effect in _terms(machine, text)]
        missing = {effect.joint for effect in found} - {*machine.axis_names, SPINDLE}
        if missing:
            text = f"the model {self.name} is for machines with the axes {' '.join(sorted(missing))}"
            raise UsageError.of("NCF635", text, hint=f"this machine has {' '.join(machine.axis_names)}")
        return found


def _terms(machine: Machine, text: str) -> list[Effect]:
    match = TERM.fullmatch(text)
    assert match is not None, text
    name, first, last = f"E{match[1]}", match[2], match[3]
    if first == "b":
        return [Effect(name, (0.0,), Backlash())]
    rotary = next((axis.rotary for axis in machine.axes if axis.name == name[-1]), False)
    degree = tuple(range(int(first), int(last or first) + 1))
    return [Effect(name, (0.0,) * len(degree), Polynomial(degree=degree), scale=RADIAN if rotary else 1.0)]


def _named(models: Sequence[Model]) -> dict[str, Model]:
    return {model.name: model for model in models}


TEN = ("EB0A", "EC0A", "EY0C", "EA0C", "EB0C", "EC0X", "EA0Z", "EB0Z")
THIRTEEN_BC = ("EA0B", "EC0B", "EX0C", "EA0C", "EB0C", "EB0Z", "EA0Y", "EC0Y", "EY0S", "EX0S")
GAINS = "XX1 YY1 ZZ1"
MOTIONS_84 = (
    "XX1-3 YX2-3 ZX2-3 AX0-3 BX1-3 CX0-3 XY0 XY2-3 YY0-3 ZY2-3 XZ1-3 YZ2-3 ZZ1-3 AZ0-3 CZ0-3 XB0-3 YB1-3 ZB1-3 "
    "AB0-3 BB0-3 BBb CB1-3 XC1-3 YC1-3 ZC1-3 AC1-3 BC1-3 CC1-3 CCb"
)
MOTIONS_81 = (
    "XX2-3 YX1-3 ZX2-3 AX0-3 BX0-3 XY2-3 YY1-3 ZY2-3 AY1-3 BY0-3 CY0-3 XZ2-3 YZ2-3 ZZ1-3 XA1-3 YA0-3 ZA1-3 AA0-3 AAb "
    "BA0-3 CA1-3 XC1-3 YC1-3 ZC1-3 AC1-3 BC1-3 CC1-3 CCb"
)

MODELS = _named(
    [
        Model("esmaeili-10", "locations and relative gains of an AC table, chapter 6", TEN, "YY1 ZZ1"),
        Model("esmaeili-12", "the same with the backlash of A and C, chapter 5", TEN, "YY1 ZZ1 AAb CCb"),
        Model("esmaeili-13-bc", "locations, spindle and gains of a BC table, chapter 4", THIRTEEN_BC, GAINS),
        Model("esmaeili-13-ac", "the same of an AC table, chapter 7", (*TEN, "EX0S", "EZ0S"), GAINS),
        Model("esmaeili-81", "cubics of all axes of an AC table, chapter 5", (), MOTIONS_81),
        Model("esmaeili-84", "cubics of all axes of a BC table, chapter 4", (), MOTIONS_84),
    ]
)
