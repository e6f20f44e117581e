"""The sign, there and back: for every control and each single error of each axis, better with the tables than without.

A wrong sign would double the error. What a format cannot say is left as it is, or refused (NCF490), and never made
worse. `NCFIX_SIGNS=all` takes all axes and locations, otherwise X, C and some locations.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from ncfix.diagnostics import RefusedError
from ncfix.machine import Machine, loads
from ncfix.tables.control import Control, Request, get_control
from ncfix.tables.export import export
from ncfix.tables.neutral import Compensation
from ncfix.tables.poses import ranges_of
from ncfix.tables.residual import residual

TARGET = 0.005
"""mm: coarse, so that the tables are small; errors up to twice as large may be left."""
POSES, LENGTH = 300, 80.0
NOTHING = 1e-5
"""mm, at the worst: an error that is none."""
SETTINGS = {
    "fanuc": {"sign": "error"},
    "fanuc-pitch": {"sign": "error"},
    "fanuc-rotary": {"sign": "error"},
    "gcode": {},
    "heidenhain": {"sign": "error"},
    "heidenhain-kinematics": {"sign": "error", "angle_unit": "deg"},
    "isg": {},
    "linuxcnc": {},
    "siemens": {"value_sign": "error", "product_terms": "only"},
}
POSITIONING = {"fanuc-pitch", "linuxcnc"}
SUMS = {"heidenhain"}
MOST = 0.7
"""Share of a single error that may be left where a format reaches it; pairs of tables cannot follow EBC of a table on a
tilting axis wholly, since that takes products of three."""
LINEAR_GRIDS = {"fanuc", "fanuc-rotary"}
AXES = """
ncfix = 1
name = "single"
topology = "w C A F X Y Z t"
axis.X = {{ type = "linear", direction = [1, 0, 0], range = [-200, 300] }}
axis.Y = {{ type = "linear", direction = [0, 1, 0], range = [-150, 250] }}
axis.Z = {{ type = "linear", direction = [0, 0, 1], range = [-300, 0] }}
axis.A = {{ type = "rotary", direction = [-1, 0, 0], point = [0, 0, -350], range = [-60, 90] }}
axis.C = {{ type = "rotary", direction = [0, 0, -1], point = [0, 0, -350] }}

[[effect]]
name = "{name}"
{basis}
coefficients = {coefficients}
"""


def machine(name: str) -> Machine:
    """A five-axis machine with one error: a line and a parabola over its axis, a turn's harmonics over C."""
    size = 50e-6 if name[1] in "ABC" else 0.02
    if len(name) == 4:
        return loads(AXES.format(name=name, basis="", coefficients=[size]))
    if name[2] == "C":
        basis, coefficients = 'basis = "fourier"\norder = [1]', [size, size / 2]
    else:
        scale = 60 if name[2] == "A" else 200
        basis, coefficients = f'basis = "polynomial"\ndegree = [1, 2]\nscale = {scale}', [size, size / 2]
    return loads(AXES.format(name=name, basis=basis, coefficients=coefficients))


def errors() -> Iterator[str]:
    """Every error motion of every axis, and the locations of those axes that can be wrongly placed."""
    everything = os.environ.get("NCFIX_SIGNS") == "all"
    yield from (f"E{component}{axis}" for axis in ("XYZAC" if everything else "XC") for component in "XYZABC")
    yield from ("EC0Y", "EX0C", "EA0S")
    yield from ("EB0Z", "EA0Z", "EY0A", "EB0A", "EA0C", "EY0S") if everything else ()


def reached(control: str, name: str) -> bool:
    """Whether the format can say what this error does, for the most part."""
    own, linear = name[1] == name[2] or name == "EAA", name[2] in "XYZ"
    if control in POSITIONING:
        return own and len(name) == 3 and name != "ECC"
    if control in SUMS:
        return linear and len(name) == 3 and name[1] in "XYZ"
    if control in LINEAR_GRIDS:
        return linear and len(name) == 3
    return len(name) == 3 or name[-1] != "S"


def left_of(control: Control, request: Request) -> float:
    """The share of the rms error that is left; 1 where the tables are refused."""
    try:
        left = export(control, request, POSES).left
    except RefusedError as refused:
        if refused.code != "NCF490":
            raise
        return 1.0
    before, after = (float(np.sqrt(np.mean(values**2))) for values in (left.before, left.after))
    return after / before


@pytest.mark.parametrize("control", SETTINGS)
def test_every_single_error_of_every_axis(control: str, figures: Callable[[str], None]) -> None:
    chosen = get_control(control)
    options = chosen.settings(SETTINGS[control])
    shares: dict[str, float] = {}
    large: set[str] = set()
    for name in errors():
        single = machine(name)
        space = ranges_of(single)
        error = float(residual(single, Compensation(()), space, LENGTH, POSES).before.max())
        if error > NOTHING:
            shares[name] = left_of(chosen, Request(single, space, LENGTH, TARGET, options))
        large |= {name} if error > 2 * TARGET else set()
    assert len(shares) >= 12
    figures(f"{control}: " + " ".join(f"{name} {share:.2f}" for name, share in shares.items()))
    worse = {name: round(share, 3) for name, share in shares.items() if share > 1 + 1e-6}
    assert not worse, f"{control} makes worse: {worse}"
    late = {name: round(share, 3) for name, share in shares.items() if share > MOST and name in large}
    poor = {name: share for name, share in late.items() if reached(control, name)}
    assert not poor, f"{control} takes off too little: {poor}"
