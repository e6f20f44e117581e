"""Which parts of the corrections are worth a table: all that matter, or those that matter most if tables are few."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ncfix.tables.scheme_layout import Layout, absorbed, arranged, tables_of
from ncfix.tables.separable import Part, Parts

Face = tuple[int, int | None]
"""(output, way): the correction of an axis, and the axis with whose direction it changes sign, or None."""


@dataclass(slots=True)
class Selection:
    """The parts that are kept of each face, and the layouts that say them.

    faces      what each face consists of
    tolerance  rms that a layout may be off by when it merges tables
    free       axes whose sum over themselves takes no table of this kind (it goes into another one)
    kept       what is kept of each face
    silent     faces of which not even the constant is kept
    """

    faces: Mapping[Face, Parts]
    tolerance: float
    free: frozenset[int] = frozenset()
    kept: dict[Face, tuple[Part, ...]] = field(default_factory=dict)
    silent: set[Face] = field(default_factory=set)
    _known: dict[tuple[Face, float, tuple[int, ...]], Layout] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.kept = {face: parts.parts for face, parts in self.faces.items()}

    @property
    def outputs(self) -> list[int]:
        """The axes that are corrected."""
        return list(dict.fromkeys(output for output, _ in self.faces))

    def layouts(self, output: int) -> list[Layout]:
        """The layouts of an axis, not absorbed, that without direction first; empty ones left out."""
        found = [self._layout(face) for face in self.faces if face[0] == output]
        return [layout for layout in found if layout.axes or layout.constant]

    def tables(self, output: int) -> int:
        """How many tables that takes."""
        return needed(output, [absorbed(layout, self.tolerance) for layout in self.layouts(output)], self.free)

    @property
    def lost(self) -> float:
        """Rms of the parts that were left out."""
        kept = {id(part) for parts in self.kept.values() for part in parts}
        gone = (part for parts in self.faces.values() for part in parts.parts if id(part) not in kept)
        constants = sum(self.faces[face].constant ** 2 for face in self.silent)
        return float((sum(part.size**2 for part in gone) + constants) ** 0.5)

    @property
    def rest(self) -> float:
        """Rms of what no sums and products of pairs can say."""
        return float(sum(parts.rest**2 for parts in self.faces.values()) ** 0.5)

    def drop_small(self, budget: float) -> None:
        """Leave out the smallest parts as long as they are below `budget` (rms) together."""
        sizes = sorted(
            (part.size, face, index) for face, parts in self.kept.items() for index, part in _numbered(parts)
        )
        total, gone = 0.0, set()
        for size, face, index in sorted(sizes, key=lambda entry: entry[0]):
            total += size**2
            if total > budget**2:
                break
            gone.add((face, index))
        for face, parts in self.kept.items():
            self.kept[face] = tuple(part for index, part in _numbered(parts) if (face, index) not in gone)

    def fit_into(self, tables: int) -> None:
        """Leave out what costs least for the tables that it frees, until no more than `tables` are taken."""
        while sum(self.tables(output) for output in self.outputs) > max(tables, 0):
            choices = [(face, index) for face, parts in self.kept.items() for index in range(len(parts))]
            if not choices:
                self._leave_out_constant(tables)
                return
            self._leave_out(*min(choices, key=lambda choice: self._price(*choice)))

    def _leave_out_constant(self, tables: int) -> None:
        """Keep the largest constants only: nothing else is left."""
        order = sorted(self.faces, key=lambda face: -abs(self.faces[face].constant))
        self.silent.update(order[max(tables, 0) :])

    def _price(self, face: Face, index: int) -> tuple[bool, float]:
        before = self.tables(face[0])
        size = self.kept[face][index].size
        whole = self.kept[face]
        self._leave_out(face, index)
        saved = before - self.tables(face[0])
        self.kept[face] = whole
        return saved <= 0, size**2 / max(saved, 1)

    def _leave_out(self, face: Face, index: int) -> None:
        parts = self.kept[face]
        self.kept[face] = parts[:index] + parts[index + 1 :]

    def _layout(self, face: Face) -> Layout:
        parts = self.kept[face]
        constant = 0.0 if face in self.silent else self.faces[face].constant
        key = (face, constant, tuple(id(part) for part in parts))
        if key not in self._known:
            self._known[key] = arranged(parts, constant, face[1], self.tolerance)
        return self._known[key]


def needed(output: int, layouts: Sequence[Layout], free: frozenset[int]) -> int:
    """How many tables these layouts of an axis take, without that over the axis itself if that is free."""
    ways = {layout.way for layout in layouts if output in layout.sums or layout.constant}
    return tables_of(layouts) - int(output in free and ways == {None})


def _numbered(parts: Sequence[Part]) -> list[tuple[int, Part]]:
    return list(enumerate(parts))
