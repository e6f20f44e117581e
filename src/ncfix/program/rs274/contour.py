"""Motions that make no way in the plane while the control offsets the contour (cutter radius compensation).

The least way in the plane would be offset by the radius, in whatever direction it leads. So a motion that makes none
must make none when it is corrected: axes of the plane that it does not name get no word, and those that it names, as
`X40` where X stands at 40, stay where they stand.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ncfix.program.rs274.coordinates import Vector, rotated
from ncfix.program.rs274.places import mask_of

if TYPE_CHECKING:
    from ncfix.program.rs274.control import Control, Unknown

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
NO_WAY = 1e-9
"""mm"""


def plane_of(control: Control) -> int:
    """The axes of the plane that the machine has, as bits."""
    return mask_of((control.modal.plane.first, control.modal.plane.second)) & mask_of(control.machine)


def resting(control: Control, axes: int, target: Vector, unknown: Unknown) -> int:
    """The axes of the plane if a straight motion to a command names some of them (`axes`) without any way in it."""
    plane = plane_of(control) if control.modal.compensated else 0
    if not axes & plane or any((plane >> index) & 1 for index in (*unknown, *control.unknown)):
        return 0
    way = [there - here for there, here in zip(target, control.position, strict=True)]
    way = rotated(control.inverse, way) if control.is_rotated else way
    moved = any(abs(way[index]) > NO_WAY for index in (control.modal.plane.first, control.modal.plane.second))
    return 0 if moved else plane


def resting_of_many(control: Control, mask: IntArray, starts: FloatArray, ends: FloatArray) -> IntArray:
    """The same of motions with words `mask` (n,) from `starts` to `ends` (n, 9), in coordinates that are not turned."""
    columns = [control.modal.plane.first, control.modal.plane.second]
    still = (np.abs(ends[:, columns] - starts[:, columns]) <= NO_WAY).all(axis=1)
    plane = plane_of(control)
    return np.where(still & (mask & plane != 0), plane, 0)
