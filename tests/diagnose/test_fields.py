"""What has no name moves the tip along the tool, the base or the workpiece: all three are looked at."""

from __future__ import annotations

import numpy as np
import pytest

from machine.chains import four_kinds
from measure.poses import plan
from ncfix.diagnosis.forms import tip_frames
from ncfix.diagnosis.residual_data import residual_data
from ncfix.machine import Effect
from ncfix.machine.axes import SPINDLE
from ncfix.measure.instruments import Faults, simulate

ROUNDING = 1e-9


FRAMES = {"w Y X F Z t": 1, "w C B F X Y Z t": 2, "w X F Y Z C A t": 2, "w C F X Y Z B t": 3}


@pytest.mark.parametrize(("name", "count"), FRAMES.items())
def test_a_shift_of_the_whole_frame_is_among_them(name: str, count: int) -> None:
    """Whatever turns: where it is the tool, the base's axes are not those that the spindle carries."""
    known = four_kinds()[name]
    seen = residual_data([simulate(plan(known, "tcp", 40), known, Faults(1.0), 1)], known)
    tip = seen.design([Effect(f"E{letter}{SPINDLE}", (0.0,)) for letter in "XYZ"]) / 1e3
    frames = tip_frames(seen, tip)
    held = next(axis.name for axis in known.axes if not axis.workpiece_side)
    shifted = seen.design([Effect(f"E{letter}0{held}", (0.0,), carried=True) for letter in "XYZ"]) / 1e3
    own = seen.design([Effect(f"E{letter}{SPINDLE}", (0.0,)) for letter in "XYZ"]) / 1e3
    assert len(frames) == count
    assert any(np.allclose(frame, shifted, atol=ROUNDING) for frame in frames)
    assert any(np.allclose(frame, own, atol=ROUNDING) for frame in frames)
    # of a tcp measurement the values are along the workpiece's axes
    assert any(np.allclose(frame, np.tile(np.eye(3), (40, 1)), atol=ROUNDING) for frame in frames)
