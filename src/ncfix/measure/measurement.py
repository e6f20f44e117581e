"""A measurement: columns of measured values and commanded states; its kinds and its text (docs/formats.md, 3)."""

from __future__ import annotations

import re
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from ncfix.arrays import Array, Ints, Mask
from ncfix.diagnostics import Message, Place
from ncfix.machine import Machine, State
from ncfix.machine.axes import COMPONENTS, NAME
from ncfix.values import frozen

Label = TypeVar("Label", bound=Hashable)
DIGITS = 9
"""Decimals of mm, degree and rad in files: beyond the resolution of any instrument."""
STATES = re.compile(
    r"time_s|load_kgm?|feed_mm_min|spindle_rpm|tool_length|spindle_deg|temp_[a-z0-9_]+"
    r"|(?:spike|sticking|settling)_[a-z]|(?:speed|accel|slave)_[a-z]_[a-z]"
)
"""Names of optional numeric state columns, without directions of approach."""
NOTES = ("instrument", "date", "origin", "operator", "note")
"""Header keys for people."""
COMMON = ("ncfix-measurement", "kind", "noise_um", "noise_urad", *NOTES)


@frozen
class MeasurementKind:
    """A kind of measurement and its columns besides axes and state.

    required  columns that must be present
    measured  columns of measured values, empty in a plan
    optional  further columns
    labels    columns of names, not numbers
    headers   header keys besides the common ones
    any_of    one of `measured` is sufficient
    """

    name: str
    title: str
    required: tuple[str, ...]
    measured: tuple[str, ...]
    optional: tuple[str, ...] = ()
    labels: tuple[str, ...] = ()
    headers: tuple[str, ...] = ()
    any_of: bool = False

    @property
    def columns(self) -> tuple[str, ...]:
        """All columns of the kind, besides axes and state."""
        return (*self.required, *self.measured, *self.optional)


SHIFTS, TURNS = ("dx", "dy", "dz"), ("rx", "ry", "rz")
CENTRE, ENDS = ("cx", "cy", "cz"), ("ax", "ay", "az", "bx", "by", "bz")

KINDS = {
    kind.name: kind
    for kind in (
        MeasurementKind("tcp", "position error of the tool point", (), SHIFTS, headers=("frame", "setup"), any_of=True),
        MeasurementKind(
            "tcp6", "position and orientation error", (), SHIFTS + TURNS, headers=("frame", "setup"), any_of=True
        ),
        MeasurementKind(
            "probe",
            "axis positions with the stylus in a ball's centre",
            ("ball",),
            ("mx", "my", "mz"),
            labels=("ball",),
            headers=("distance",),
        ),
        MeasurementKind(
            "axis",
            "one error motion of one axis",
            ("axis", "component", "position"),
            ("value",),
            optional=("run", "direction"),
            labels=("axis", "component"),
            headers=("point", "setup", "sense"),
        ),
        MeasurementKind(
            "points",
            "targets in the frame of an instrument that stands on the foundation",
            ("target",),
            ("x", "y", "z"),
            labels=("target",),
            headers=("carried_by", "target", "frame"),
        ),
        MeasurementKind(
            "length",
            "distances: a gauge between two positions, or a ball-bar",
            (),
            ("length",),
            optional=("nominal", "radius", *ENDS, *CENTRE),
            headers=("setup",),
        ),
    )
}
CHOICES: dict[str, dict[str, tuple[str, ...]]] = {
    "setup": {
        "tcp": ("ball", "none", "rigid"),
        "tcp6": ("ball", "none", "rigid"),
        "axis": ("line", "none"),
        "length": ("known", "unknown", "none"),
    },
    "sense": {"axis": ("body", "axis")},
    "frame": {"tcp": ("workpiece", "base"), "tcp6": ("workpiece", "base"), "points": ("instrument", "base")},
    "carried_by": {"points": ("tool", "spindle", "workpiece")},
}
"""Header key -> kind -> allowed values; the first is the default."""


@frozen(eq=False, slots=False)
class Measurement:
    """One measurement file.

    kind      see `KINDS`
    headers   header lines in their order: (key, text)
    columns   name -> (n,) numbers as in the file: mm, degree, s
    labels    name -> n texts (ball, target, axis, component, set)
    lines     (n,) line number of each row in the file, 0 if unknown
    path      path of the file
    remarks   remarks of the reader
    """

    kind: str
    headers: tuple[tuple[str, str], ...]
    columns: Mapping[str, Array]
    labels: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    lines: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    path: str = "<measurement>"
    remarks: tuple[Message, ...] = ()

    def __len__(self) -> int:
        """The number of rows."""
        sizes = [len(values) for values in self.columns.values()] + [len(texts) for texts in self.labels.values()]
        return sizes[0] if sizes else 0

    @property
    def form(self) -> MeasurementKind:
        """The definition of this kind."""
        return KINDS[self.kind]

    def header(self, key: str) -> str:
        """The value of a header line; if it is missing, the default of its choices, or ""."""
        default = CHOICES.get(key, {}).get(self.kind, ("",))[0]
        return next((text for name, text in self.headers if name == key), default)

    def all_headers(self, key: str) -> list[str]:
        """All values of a repeated header line."""
        return [text for name, text in self.headers if name == key]

    @property
    def noise(self) -> tuple[float | None, float | None]:
        """Stated standard deviation of a length, mm, and of an angle, rad; None if not stated."""
        lengths, angles = self.header("noise_um"), self.header("noise_urad")
        return float(lengths) * 1e-3 if lengths else None, float(angles) * 1e-6 if angles else None

    @property
    def measured(self) -> tuple[str, ...]:
        """The columns that hold measured values."""
        return tuple(name for name in self.form.measured if name in self.columns)

    @property
    def sets(self) -> tuple[str, ...]:
        """The set of each row: rows of one set share their unknown set-up."""
        return self.labels.get("set", ("1",) * len(self))

    @cached_property
    def stays(self) -> bool:
        """Whether only time and temperatures vary, as in a test of drift; its rows are then no repeats."""
        labels = [texts for name, texts in self.labels.items() if name not in ("set", "repeat")]
        held = all(len(set(texts)) < 2 for texts in labels)
        changing = [n for n, each in self.columns.items() if n not in (*self.measured, "run") and np.ptp(each) > 0]
        return held and bool(changing) and all(name == "time_s" or name.startswith("temp_") for name in changing)

    def column(self, name: str, default: float = 0.0) -> Array:
        """A column of numbers (n,), in the units of the file; the default in every row if it is missing."""
        return self.columns.get(name, np.full(len(self), default))

    def stacked(self, *names: str) -> Array:
        """Several columns as one array, (n, k)."""
        return np.stack([self.columns[name] for name in names], axis=-1)

    def columns_of(self, axis: str, right: Sequence[str] = ()) -> dict[str, Mask]:
        """The columns that hold positions of an axis, and in which rows (n,): commanded, probed, of both ends of a
        length, of a bar's centre, of direct readings; but for those that are `right`.
        """
        everywhere, low = np.ones(len(self), dtype=bool), axis.lower()
        own = {f"{where}{low}" for where in "mabc"} & {*self.form.columns} - {*right}
        found = {name: everywhere for name in self.columns if name == axis or name in own}
        if self.kind == "axis":
            found["position"] = np.array([name == axis for name in self.labels["axis"]], dtype=bool)
        return {name: rows for name, rows in found.items() if rows.any()}

    def times(self, axes: Sequence[str], factor: float, right: Sequence[str] = ()) -> Measurement:
        """These rows with all positions of some axes, or other columns, times a factor."""
        found = dict(self.columns)
        for axis in axes:
            own = self.columns_of(axis, right)
            found |= {name: np.where(rows, factor, 1.0) * found[name] for name, rows in own.items()}
        return replace(self, columns=found)

    def exchanged(self, first: str, second: str, right: Sequence[str] = ()) -> Measurement | None:
        """These rows with the positions of two axes exchanged; None if they are not in the same kinds of columns."""
        if self.kind == "axis":
            return None
        mine, other = self.columns_of(first, right), self.columns_of(second, right)
        names = {name: name.replace(first, second).replace(first.lower(), second.lower()) for name in mine}
        if not names or {*names.values()} != {*other}:
            return None
        pairs = {**names, **{there: here for here, there in names.items()}}
        return self.with_columns({name: self.columns[source] for name, source in pairs.items()})

    def positions(self, machine: Machine) -> Array:
        """The commanded axis positions, (n, n_axes), mm and rad; an axis without a column is at zero."""
        return np.stack([self.column(axis.name) * axis.unit for axis in machine.axes], axis=-1)

    def state(self, machine: Machine) -> State:
        """The state of each row besides positions: tool length, directions of approach, inputs."""
        direction = np.stack([self.column(f"dir_{axis.name}") for axis in machine.axes], axis=-1)
        names = [name for name in self.columns if name in machine.inputs or STATES.fullmatch(name)]
        inputs = {name: self.columns[name] for name in names if name != "tool_length"}
        return State(self.column("tool_length"), direction, inputs)

    def place(self, row: int) -> Place:
        """The place of a row in its file."""
        return Place(self.path, int(self.lines[row]) if len(self.lines) else row + 1)

    def with_columns(self, values: Mapping[str, Array]) -> Measurement:
        """These rows with some columns new or replaced."""
        return replace(self, columns={**self.columns, **values})

    def with_header(self, key: str, text: str) -> Measurement:
        """These rows with one header line set."""
        rest = tuple(pair for pair in self.headers if pair[0] != key)
        return replace(self, headers=(*rest, (key, text)))

    def rows(self, keep: Sequence[int] | Ints | Mask) -> Measurement:
        """The measurement with some of the rows, by index or mask."""
        index = np.arange(len(self))[keep]
        return replace(
            self,
            columns={name: values[index] for name, values in self.columns.items()},
            labels={name: tuple(values[i] for i in index) for name, values in self.labels.items()},
            lines=self.lines[index] if len(self.lines) else self.lines,
        )


def perhaps_right(measurements: Sequence[Measurement]) -> Sequence[tuple[str, ...]]:
    """Which columns may be right where the positions of an axis are not: none, or where the centre of a bar is."""
    return ((), CENTRE) if any(CENTRE[0] in each.columns for each in measurements) else ((),)


def groups(labels: Sequence[Label]) -> tuple[tuple[Label, ...], Ints]:
    """The distinct labels in order of appearance, and for each row the index of its label among these."""
    names = tuple(dict.fromkeys(labels))
    places = {name: index for index, name in enumerate(names)}
    return names, np.array([places[label] for label in labels], dtype=np.int64)


def component_of(axis: str, component: str) -> str | None:
    """The ISO 230-1 name of an error motion given as `EYX` or as component `Y`; None if it is not one of this axis."""
    name = f"E{component}{axis}" if component in tuple(COMPONENTS) else component
    match = NAME.fullmatch(name)
    return name if match and match[3] == axis and not match[2] else None


def dumps(measurement: Measurement, empty: tuple[str, ...] = ()) -> str:
    """The text of a measurement file; columns `empty` are written without values, to be filled in."""
    heads = {"ncfix-measurement": "1", "kind": measurement.kind}
    lines = [f"# {key}: {value}" for key, value in heads.items()]
    lines += [f"# {key}: {value}" for key, value in measurement.headers if key not in heads]
    texts = {name: list(values) for name, values in measurement.labels.items()}
    texts |= {name: [number(value) for value in values] for name, values in measurement.columns.items()}
    texts |= {name: [""] * len(measurement) for name in empty}
    lines.append(",".join(texts))
    lines += [",".join(row) for row in zip(*texts.values(), strict=True)]
    return "\n".join(lines) + "\n"


def number(value: float) -> str:
    """A number as text with at most `DIGITS` decimals, without trailing zeros."""
    text = f"{value:.{DIGITS}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text
