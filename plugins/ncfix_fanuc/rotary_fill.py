"""What the two lattices hold: corrections with rotary axes at rest, and what a table adds at other angles.

The error of a table at some angle shifts and turns the workpiece. What the linear axes have to follow is that shift,
and the turn times the distance from where it is said to be about: six numbers for all positions of X, Y and Z.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ncfix.machine import Machine, State
from ncfix.tables.control import Request
from ncfix.tables.correction import exact_correction, linear_axes
from ncfix.tables.grid import Array, Grid
from ncfix.tables.volume import AIM, Mesh, Volume, inputs_that_matter, search
from ncfix_fanuc.backlash import Backlash
from ncfix_fanuc.filling import LEVEL
from ncfix_fanuc.placing import anchors
from ncfix_fanuc.rotary_records import ANGLES, LINEAR, SIDE, Lattice

LENGTH = 100.0
"""mm: the tool with which angles are worked out."""
PART = 0.6
"""Share of the target for either lattice, if there are two."""
TRIES = ((False, False), (True, True))
"""How a lattice is filled, until it will do: fitted to what is around points, with points only where it bends."""


@dataclass(frozen=True, slots=True)
class LatticeFilling:
    """How lattices are filled, under these settings."""

    request: Request
    sign: str
    units: tuple[float, float]
    backlash: Backlash
    settings: Mapping[str, str]

    @property
    def machine(self) -> Machine:
        """The machine."""
        return self.request.machine

    def linear(self, share: float) -> tuple[Lattice, Mesh]:
        """The lattice over X, Y and Z: exact at its points if that will do, or fitted to what is around them."""
        target = share * AIM * self.request.target
        found: list[tuple[Lattice, Mesh]] = []
        for area, trimmed in TRIES:
            volume = self._volume(self.request.tool_length, area)
            for index in range(len(LINEAR)) if trimmed else ():
                volume = volume.trimmed(index, LEVEL * self.request.target)
            volume.written = partial(self._as_written, area=area, covered=volume.covered)
            mesh = search(volume, target, [SIDE] * 3, SIDE**3)
            found.append((self._lattice(mesh.grid.counts, area, volume.covered), mesh))
            if mesh.reached:
                break
        return min(found, key=lambda each: each[1].left)

    def _volume(self, length: float, area: bool) -> Volume:
        volume = Volume.of(self.machine, LINEAR, self.request.space, length, area)
        shift = self.backlash.shift(self.units[0])[[LINEAR.index(axis) for axis in volume.outputs]]
        exact = volume.exact
        return replace(volume, exact=lambda places: exact(places) + shift, anchors=self._anchors(LINEAR))

    def _anchors(self, inputs: Sequence[str]) -> tuple[float, ...]:
        return anchors(self.request, self.settings, inputs)

    def _lattice(self, counts: Sequence[int], area: bool, covered: Array) -> Lattice:
        """Tools of two lengths tell lengths from angles."""
        volumes = (replace(self._volume(length, area), covered=covered) for length in (0.0, LENGTH))
        bare, long = (volume.grid(counts) for volume in volumes)
        order = [bare.outputs.index(axis) for axis in LINEAR]
        lever = (long.values - bare.values)[..., order] / LENGTH
        angles = np.stack([lever[..., 1], -lever[..., 0], np.zeros(lever.shape[:-1])], axis=-1)
        lengths = replace(bare, outputs=LINEAR, values=bare.values[..., order])
        grids = lengths, replace(bare, outputs=ANGLES, values=angles)
        found = Lattice.of(grids, self.sign, self.units, self._anchors(LINEAR))
        return replace(found, home_minus=self.backlash.home_minus)

    def _as_written(self, grid: Grid, area: bool, covered: Array) -> Grid:
        """What whole numbers make of the grid with that many points."""
        lengths, angles = self._lattice(grid.counts, area, covered).grids()
        total = lengths.values + np.cross(angles.values, (0.0, 0.0, -self.request.tool_length))
        return replace(grid, values=total[..., [LINEAR.index(axis) for axis in grid.outputs]])

    def rotary(self, share: float, most: int) -> tuple[Lattice, Mesh] | None:
        """The lattice over the rotary axes, if the machine has tables that turn and their angles matter."""
        inputs = table_axes(self.request)
        if not inputs:
            return None
        table = Table.of(self.request, inputs)
        reach = np.linalg.norm(table.levers, axis=1).max()
        space = self.request.space[list(table.columns)]
        units = tuple(self.machine.axes[column].unit for column in table.columns)
        names = (*LINEAR, *ANGLES)
        volume = Volume(inputs, space, units, names, lambda places: table.six(places) * ([1.0] * 3 + [reach] * 3))
        volume.anchors = self._anchors(inputs)
        mesh = search(volume, share * AIM * self.request.target, [most] * len(inputs), most ** len(inputs))
        lengths, angles = mesh.grid.values[..., :3], mesh.grid.values[..., 3:] / reach
        grids = (
            replace(mesh.grid, outputs=LINEAR, values=lengths),
            replace(mesh.grid, outputs=ANGLES, values=angles),
        )
        return Lattice.of(grids, self.sign, self.units, volume.anchors, table.centre), mesh


def table_axes(request: Request) -> tuple[str, ...]:
    """The rotary axes that matter, if all of them turn the workpiece; else none."""
    machine = request.machine
    found = [name for name in inputs_that_matter(machine, request.space, request.tool_length) if name not in LINEAR]
    on_table = machine.topology.upper().split("F")[0]
    return tuple(sorted(found)) if found and all(name in on_table for name in found) else ()


@dataclass(frozen=True, slots=True)
class Table:
    """What the rotary axes of a table add to the correction.

    columns  of the rotary axes
    centre   where angles turn about: a point of the table's outer axis, as X, Y and Z of the tip, mm
    places   positions of all axes at which it is looked at, the rotary ones at rest, (m, n_axes)
    levers   from the centre to the tip there, (m, 3) mm
    """

    machine: Machine
    columns: tuple[int, ...]
    state: State
    centre: Array
    places: Array
    levers: Array

    @classmethod
    def of(cls, request: Request, inputs: Sequence[str]) -> Table:
        """Looked at in the corners of the space of X, Y and Z, and in its middle."""
        machine, space = request.machine, request.space
        columns = tuple(machine.axis_names.index(name) for name in inputs)
        outer = max(columns)
        centre = np.asarray(machine.axes[outer].point) - np.asarray(machine.tool.point)
        linear = [machine.axis_names.index(name) for name in LINEAR]
        corners = np.stack(np.meshgrid(*space[linear], indexing="ij"), axis=-1).reshape(-1, 3)
        corners = np.concatenate([corners, space[linear].mean(axis=1)[None]])
        places = np.tile(np.clip(np.zeros(len(space)), space[:, 0], space[:, 1]), (len(corners), 1))
        places[:, linear] = corners
        levers = corners - [0.0, 0.0, request.tool_length] - centre
        return cls(machine, columns, State(request.tool_length), np.round(centre, 4), places, levers)

    def six(self, positions: Array) -> Array:
        """Three lengths and three angles at positions of the rotary axes (n, n_rotary), (n, 6) mm and rad."""
        q = np.repeat(self.places[None], len(positions), axis=0)
        q[:, :, list(self.columns)] = positions[:, None]
        added = self._correction(q.reshape(-1, q.shape[-1])).reshape(len(positions), -1)
        added = added - self._correction(self.places).reshape(-1)
        turning = np.stack([np.cross(axis, self.levers) for axis in np.eye(3)], axis=-1)
        shifting = np.broadcast_to(np.eye(3), turning.shape)
        design = np.concatenate([shifting, turning], axis=-1).reshape(-1, 6)
        found: Array = np.linalg.lstsq(design, added.T, rcond=None)[0].T
        return found

    def _correction(self, q: Array) -> Array:
        linear = [self.machine.axis_names.index(name) for name in LINEAR]
        assert sorted(linear) == linear_axes(self.machine)
        return exact_correction(self.machine, q, self.state)[:, linear]
