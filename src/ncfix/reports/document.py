"""What a report says, whatever it looks like: sections of text, tables and plots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ncfix.arrays import Array
from ncfix.values import frozen


@frozen
class Paragraph:
    """A paragraph."""

    words: str


@frozen
class Table:
    """Rows of cells under a header; a header of no names has none."""

    header: Sequence[str]
    rows: Sequence[Sequence[str]]


@frozen
class Line:
    """A curve of a plot.

    x, y    (n,)
    spread  (n,) half the width of the band around it; None: no band
    label   what it is, empty if there is only one
    """

    x: Array
    y: Array
    spread: Array | None = None
    label: str = ""


@frozen
class Dots:
    """Single values in a plot: (n,) where, (n,) how much, and what they are."""

    x: Array
    y: Array
    label: str = ""


@frozen
class Plot:
    """Curves and single values over one axis; the caption says what is up and what is across, with the units."""

    caption: str
    drawn: Sequence[Line | Dots]


@frozen
class Bars:
    """Values that are compared, a horizontal bar each: their names, and the caption with their unit."""

    caption: str
    names: Sequence[str]
    values: Sequence[float]


@frozen
class ArrowMap:
    """Small shifts at places of a plane, a panel for each title, all to one scale.

    across, up  names of the two axes, with their units
    x, y        (n,) places
    shifts      title -> (n, 2), in the unit that `unit` names
    """

    caption: str
    across: str
    up: str
    x: Array
    y: Array
    shifts: Mapping[str, Array]
    unit: str


Part = Paragraph | Table | Plot | Bars | ArrowMap


@frozen
class ReportSection:
    """A heading and what belongs to it."""

    heading: str
    parts: Sequence[Part]


@frozen
class Document:
    """A report."""

    title: str
    sections: Sequence[ReportSection]
