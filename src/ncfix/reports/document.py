"""The content of a report, independent of its form: sections of text, tables and plots."""

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
    """Rows of cells under a header; an empty header is not shown."""

    header: Sequence[str]
    rows: Sequence[Sequence[str]]


@frozen
class Line:
    """A curve of a plot.

    x, y    (n,)
    spread  (n,) half width of the band around it; None: no band
    label   its name; empty if there is only one
    """

    x: Array
    y: Array
    spread: Array | None = None
    label: str = ""


@frozen
class Dots:
    """Single values of a plot: x (n,), y (n,), and their name."""

    x: Array
    y: Array
    label: str = ""


@frozen
class Plot:
    """Curves and single values over one axis; the caption names both quantities with their units."""

    caption: str
    drawn: Sequence[Line | Dots]


@frozen
class Bars:
    """Values to compare as horizontal bars, with their names; the caption has the unit."""

    caption: str
    names: Sequence[str]
    values: Sequence[float]


@frozen
class ArrowMap:
    """Small displacements at points of a plane; one panel for each title, all at the same scale.

    across, up  names of the two axes, with their units
    x, y        (n,) points
    shifts      title -> (n, 2) displacements in `unit`
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
    """A heading and its parts."""

    heading: str
    parts: Sequence[Part]


@frozen
class Document:
    """A report."""

    title: str
    sections: Sequence[ReportSection]
