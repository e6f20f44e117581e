"""Which parts of the corrections are worth a table: all that matter, or those that matter most if tables are few."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from ncfix.tables.scheme_layout import Layout, absorbed, arranged, tables_of
from ncfix.tables.separable import Part, Parts

MANY_MORE = 12
"""Tables than there are: down to so many, parts are left out by their size alone."""
TRIED = 12
"""Of the parts that are left out, how many are tried in place of others."""
Face = tuple[int, int | None]
"""(output, way): the correction of an axis, and the axis with whose direction it changes sign, or None."""
Key = tuple[Face, int]
"""A part: the face, and its number there, the largest first."""


@dataclass(slots=True)
class Selection:
    """The parts that are kept of each face, and the layouts that say them.

    faces      what each face consists of
    tolerance  rms that a layout may be off by when it merges tables
    free       axes whose sum over themselves takes no table of this kind (it goes into another one)
    kept       the parts that are kept
    silent     faces of which not even the constant is kept
    beside     tables more for each that multiplies others, and for each that is multiplied
    """

    faces: Mapping[Face, Parts]
    tolerance: float
    free: frozenset[int] = frozenset()
    kept: frozenset[Key] = frozenset()
    silent: frozenset[Face] = frozenset()
    beside: tuple[int, int] = (0, 0)
    _known: dict[tuple[Face, bool, tuple[int, ...]], tuple[Layout, Layout]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.kept = frozenset((face, n) for face, parts in self.faces.items() for n in range(len(parts.parts)))

    @property
    def outputs(self) -> list[int]:
        """The axes that are corrected."""
        return list(dict.fromkeys(output for output, _ in self.faces))

    def part(self, key: Key) -> Part:
        """The part with this key."""
        face, number = key
        return self.faces[face].parts[number]

    def layouts(self, output: int) -> list[Layout]:
        """The layouts of an axis, not absorbed, that without direction first; empty ones left out."""
        found = [self._layouts(face)[0] for face in self.faces if face[0] == output]
        return [layout for layout in found if layout.axes or layout.constant]

    def tables(self, output: int) -> int:
        """How many tables an axis takes."""
        layouts = [self._layouts(face)[1] for face in self.faces if face[0] == output]
        return needed(output, layouts, self.free, self.beside)

    @property
    def total(self) -> int:
        """How many tables all of it takes."""
        return sum(self.tables(output) for output in self.outputs)

    @property
    def lost(self) -> float:
        """Rms of the parts that were left out."""
        gone = (part.size**2 for face in self.faces for n, part in self._numbered(face) if (face, n) not in self.kept)
        return float((sum(gone) + sum(self.faces[face].constant ** 2 for face in self.silent)) ** 0.5)

    @property
    def rest(self) -> float:
        """Rms of what no sums and products of pairs can say."""
        return float(sum(parts.rest**2 for parts in self.faces.values()) ** 0.5)

    def drop_small(self, budget: float) -> None:
        """Leave out the smallest parts as long as they are below `budget` (rms) together."""
        total = 0.0
        for key in sorted(self.kept, key=lambda key: self.part(key).size):
            total += self.part(key).size ** 2
            if total > budget**2:
                return
            self.kept -= {key}

    def fit_into(self, tables: int) -> None:
        """Keep what takes off most with no more than `tables`.

        Parts are taken away, cheapest first, and put together, most worth first; then the largest that are left out are
        tried in the better of the two, in place of others.
        """
        self._leave_smallest(tables + MANY_MORE)
        whole = self.kept
        self._thin(tables)
        best = self.kept, self.silent, self.lost
        if best[0] == whole:
            return
        self._grow(whole, tables)
        best = min(best, (self.kept, self.silent, self.lost), key=lambda found: found[2])
        for key in sorted(whole - best[0], key=lambda key: -self.part(key).size)[:TRIED]:
            self.kept, self.silent = best[0] | {key}, best[1]
            self._thin(tables)
            best = min(best, (self.kept, self.silent, self.lost), key=lambda found: found[2])
        self.kept, self.silent, _ = best

    def _leave_smallest(self, tables: int) -> None:
        """Leave out the smallest parts until no more than `tables` are taken: they will not come back."""
        for key in sorted(self.kept, key=lambda key: self.part(key).size):
            if self.total <= tables:
                return
            self.kept -= {key}

    def _thin(self, tables: int) -> None:
        """Leave out what costs least for the tables that it frees, until no more than `tables` are taken."""
        while self.total > max(tables, 0):
            if not self.kept:
                order = sorted(self.faces, key=lambda face: -abs(self.faces[face].constant))
                self.silent = frozenset(order[max(tables, 0) :])
                return
            self.kept -= {min(sorted(self.kept, key=str), key=self._price)}

    def _price(self, key: Key) -> tuple[bool, float]:
        """What a part costs for each table that it frees; parts that free none come last."""
        saved = self._change(key, self.kept - {key})
        return saved >= 0, self.part(key).size ** 2 / max(-saved, 1)

    def _grow(self, whole: frozenset[Key], tables: int) -> None:
        """Begin with nothing, and add what takes off most for the tables that it takes."""
        self.kept = frozenset()
        self._thin(tables)
        room = tables - self.total
        while True:
            costs = {key: self._change(key, self.kept | {key}) for key in sorted(whole - self.kept, key=str)}
            allowed = [key for key, cost in costs.items() if cost <= room]
            if not allowed:
                return
            best = max(allowed, key=lambda key: self.part(key).size ** 2 / max(costs[key], 0.1))
            self.kept |= {best}
            room -= costs[best]

    def _change(self, key: Key, kept: frozenset[Key]) -> int:
        """How many tables more the axis takes if other parts are kept."""
        output, before = key[0][0], self.kept
        now = self.tables(output)
        self.kept = kept
        then = self.tables(output)
        self.kept = before
        return then - now

    def _layouts(self, face: Face) -> tuple[Layout, Layout]:
        """The layout of a face, and the same absorbed."""
        numbers = tuple(n for n, _ in self._numbered(face) if (face, n) in self.kept)
        key = (face, face in self.silent, numbers)
        if key not in self._known:
            constant = 0.0 if face in self.silent else self.faces[face].constant
            parts = [self.part((face, n)) for n in numbers]
            layout = arranged(parts, constant, face[1], self.tolerance)
            self._known[key] = layout, absorbed(layout, self.tolerance)
        return self._known[key]

    def _numbered(self, face: Face) -> Iterator[tuple[int, Part]]:
        return iter(enumerate(self.faces[face].parts))


def needed(output: int, layouts: Sequence[Layout], free: frozenset[int], beside: tuple[int, int] = (0, 0)) -> int:
    """How many tables these layouts of an axis take, without that over the axis itself if that is free."""
    ways = {layout.way for layout in layouts if output in layout.sums or layout.constant}
    return tables_of(layouts, beside) - int(output in free and ways == {None})
