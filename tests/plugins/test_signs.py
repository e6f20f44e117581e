"""The sign, there and back: for every control and each single error of each axis, better with the tables than without.

A wrong sign would double the error. What a format cannot say is left as it is, or refused (NCF490), and never made
worse; what it can say goes. How much a format can say is worked out apart from the tables: the correction is taken
apart into what each set of axes changes together, and the sets that the format has no table for are what must be left.
Each component once, in turn of X and C, and some locations; `NCFIX_FULL=1`: all components of X and C;
`NCFIX_SIGNS=all`: of all axes, and all locations.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from functools import cache

import numpy as np
import pytest

from conftest import FULL
from ncfix.diagnostics import RefusedError
from ncfix.machine import Machine, State, loads
from ncfix.tables.compensation import Compensation
from ncfix.tables.control import Control, Request, get_control
from ncfix.tables.correction import exact_correction, random_poses, ranges_of, residual, rotary_correction
from ncfix.tables.export import export
from ncfix.tables.grid_sums import interactions

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
FROM_ZERO = {"fanuc-pitch"}
"""What they say is zero at the reference position, whatever the error is there (ECC is not zero)."""
SUMS = {"heidenhain"}
PAIRS = {"siemens"}
AT_REST = {"fanuc"}
"""Everything that the linear axes are corrected by with rotary axes at zero, and nothing of the rest."""
ABOVE = 1.2
"""Of the least that a format can leave (rms), what may be left: tables also look at the worst, and at their number."""
WITHIN = 0.6
"""Of the target, rms, that may be lost between nodes."""
NODES = 6
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
    if not everything and not FULL:
        yield from ("EXX", "EYC", "EZX", "EAC", "EBX", "ECC")
    else:
        yield from (f"E{component}{axis}" for axis in ("XYZAC" if everything else "XC") for component in "XYZABC")
    yield from ("EC0Y", "EX0C", "EA0S")
    yield from ("EB0Z", "EA0Z", "EY0A", "EB0A", "EA0C", "EY0S") if everything else ()


@cache
def parts(name: str, turned: bool = False) -> dict[frozenset[int], np.ndarray]:
    """What each set of axes changes together in the corrections of X, Y and Z, rms; rotary axes corrected or not."""
    single = machine(name)
    space = ranges_of(single)
    lines = [low + (high - low) * (np.arange(NODES) + 0.5) / NODES for low, high in space]
    q = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(lines))
    start = np.zeros_like(q)
    if turned:
        start[:, single.rotary] = rotary_correction(single, q, State(LENGTH))
    values = exact_correction(single, q, State(LENGTH), start)[:, ~single.rotary]
    return interactions(values.reshape(*[NODES] * len(lines), 3), len(lines))


def least(control: str, name: str) -> float:
    """The rms error that the format must leave of a single error, mm: what it has no tables for."""
    if control in AT_REST:
        return at_other_angles(name)
    if control in FROM_ZERO and (not own(name) or name == "ECC"):
        return np.inf
    names = machine(name).axis_names
    linear = [index for index, axis in enumerate(names) if axis in "XYZ"]
    found = []
    for turned in (False, True):
        total = 0.0
        for axes, sizes in parts(name, turned).items():
            for column, size in zip(linear, sizes, strict=True):
                total += 0.0 if said(control, axes, column) else float(size) ** 2
        found.append(total**0.5)
    return min(found) if control in PAIRS or own(name) else found[0]


def own(name: str) -> bool:
    """Whether it is the positioning error of an axis."""
    return len(name) == 3 and (name[1] == name[2] or name in ("EAA", "ECC"))


def said(control: str, axes: frozenset[int], output: int) -> bool:
    """Whether the format has a table for what these axes change together in that one."""
    if control in POSITIONING:
        return axes <= {output}
    return len(axes) <= (1 if control in SUMS else 2 if control in PAIRS else 5)


def at_other_angles(name: str) -> float:
    """What the correction is off by, rms, if it is that of rotary axes at zero."""
    single = machine(name)
    q = random_poses(ranges_of(single), 1000, seed=31)
    rest = np.where(single.rotary, 0.0, q)
    one, other = (exact_correction(single, each, State(LENGTH)) for each in (q, rest))
    return float(np.sqrt(((one - other) ** 2).sum(axis=1).mean()))


def left_of(control: Control, request: Request) -> tuple[float, float]:
    """The rms error before and after; the same where the tables are refused."""
    try:
        left = export(control, request, POSES).left
    except RefusedError as refused:
        if refused.code != "NCF490":
            raise
        left = residual(request.machine, Compensation(()), request.space, LENGTH, POSES)
    before, after = (float(np.sqrt(np.mean(values**2))) for values in (left.before, left.after))
    return before, after


@pytest.mark.parametrize("control", SETTINGS)
def test_every_single_error_of_every_axis(control: str, figures: Callable[[str], None]) -> None:
    chosen = get_control(control)
    options = chosen.settings(SETTINGS[control])
    shares: dict[str, str] = {}
    worse: dict[str, float] = {}
    late: dict[str, str] = {}
    for name in errors():
        single = machine(name)
        space = ranges_of(single)
        error = float(residual(single, Compensation(()), space, LENGTH, POSES).before.max())
        if error <= NOTHING:
            continue
        before, after = left_of(chosen, Request(single, space, LENGTH, TARGET, options))
        possible = min(least(control, name), before)
        shares[name] = f"{after / before:.2f} of {possible / before:.2f}"
        if after > before * (1 + 1e-6):
            worse[name] = after / before
        if after > ABOVE * possible + WITHIN * TARGET:
            late[name] = f"{1e3 * after:.2f} um rms, {1e3 * possible:.2f} must be left"
    assert len(shares) >= (12 if FULL else 7)
    figures(f"{control}, left of what must be: " + ", ".join(f"{name} {share}" for name, share in shares.items()))
    assert not worse, f"{control} makes worse: {worse}"
    assert not late, f"{control} takes off too little: {late}"
