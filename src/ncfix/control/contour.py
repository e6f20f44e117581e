"""What may not move beside a contour that the control changes by itself.

Motions that make no way in the plane while the control offsets the contour (cutter radius compensation).

The least way in the plane would be offset by the radius, in whatever direction it leads. So a motion that makes none
must make none when it is corrected: axes of the plane that it does not name get no word, and those that it names, as
`X40` where X stands at 40, stay where they stand.

Motions that meet at a corner which the control rounds or breaks: it puts in nothing where a motion leaves the plane, so
that one which does not must not when it is corrected.
Source: Siemens, "SINUMERIK 840D sl, NC programming, fundamentals": chamfer, rounding (CHF, CHR, RND, RNDM).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ncfix.control.coordinates import rotated
from ncfix.control.places import mask_of

if TYPE_CHECKING:
    from ncfix.control.control import Control
    from ncfix.control.motion import Motion

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
NO_WAY = 1e-9
"""mm"""


def plane_of(control: Control) -> int:
    """The axes of the plane that the machine has, as bits."""
    return mask_of((control.modal.plane.first, control.modal.plane.second)) & mask_of(control.machine)


def resting(control: Control, motion: Motion) -> int:
    """Axes that must stay where they stand in a motion.

    Those of the plane, if it names some of them without any way in it; at a corner all others that make no way.
    """
    plane = plane_of(control)
    beside = motion.arc is None and bool(control.modal.compensated and motion.axes & plane)
    if not (beside or control.at_corner):
        return 0
    way = [there - here for there, here in zip(motion.target, control.position, strict=True)]
    way = rotated(control.inverse, way) if control.is_rotated else way
    lacking = {*motion.unknown, *control.unknown}
    still = mask_of(index for index in control.machine if abs(way[index]) <= NO_WAY and index not in lacking)
    across = still & ~plane if control.at_corner else 0
    return across | (plane if beside and plane & ~still == 0 else 0)


def resting_of_many(control: Control, mask: IntArray, starts: FloatArray, ends: FloatArray) -> IntArray:
    """The same of motions with words `mask` (n,) from `starts` to `ends` (n, 9), in coordinates that are not turned."""
    columns = [control.modal.plane.first, control.modal.plane.second]
    still = (np.abs(ends[:, columns] - starts[:, columns]) <= NO_WAY).all(axis=1)
    plane = plane_of(control)
    return np.where(still & (mask & plane != 0), plane, 0)
