"""Measured rows with their commanded state, column by column."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ncfix.diagnostics import Message, Place
from ncfix.machine import Machine, State
from ncfix.measure.kinds import CHOICES, KINDS, STATES, Kind

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class Measurement:
    """One measurement file.

    kind      see `ncfix.measure.kinds`
    headers   header lines in their order: (key, text)
    columns   name -> (n,) numbers as in the file: mm, degree, s
    labels    name -> n texts (ball, target, axis, component, set)
    lines     (n,) line of each row in the file, 0 if there is none
    path      where it came from
    remarks   what looked odd while it was read
    """

    kind: str
    headers: tuple[tuple[str, str], ...]
    columns: Mapping[str, Array]
    labels: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    lines: Index = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    path: str = "<measurement>"
    remarks: tuple[Message, ...] = ()

    def __len__(self) -> int:
        """The number of rows."""
        sizes = [len(values) for values in self.columns.values()] + [len(texts) for texts in self.labels.values()]
        return sizes[0] if sizes else 0

    @property
    def form(self) -> Kind:
        """What this kind has for columns."""
        return KINDS[self.kind]

    def header(self, key: str) -> str:
        """A header line's value; of those with choices the default, of others nothing, if it is not there."""
        default = CHOICES.get(key, {}).get(self.kind, ("",))[0]
        return next((text for name, text in self.headers if name == key), default)

    def all_headers(self, key: str) -> list[str]:
        """The values of a header line that may come more than once."""
        return [text for name, text in self.headers if name == key]

    @property
    def noise(self) -> tuple[float | None, float | None]:
        """Standard deviation of one value, (mm, rad); None where the header does not say."""
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

    def column(self, name: str, default: float = 0.0) -> Array:
        """A column of numbers (n,), in the units of the file, or the default in every row."""
        return self.columns.get(name, np.full(len(self), default))

    def stacked(self, *names: str) -> Array:
        """Columns beside each other, (n, k)."""
        return np.stack([self.columns[name] for name in names], axis=-1)

    def positions(self, machine: Machine) -> Array:
        """The commanded axis positions, (n, n_axes), mm and rad; an axis without a column is at zero."""
        return np.stack([self.column(axis.name) * axis.unit for axis in machine.axes], axis=-1)

    def state(self, machine: Machine) -> State:
        """The rest of the state of each row."""
        direction = np.stack([self.column(f"dir_{axis.name}") for axis in machine.axes], axis=-1)
        names = [name for name in self.columns if name in machine.inputs or STATES.fullmatch(name)]
        inputs = {name: self.columns[name] for name in names if name != "tool_length"}
        return State(self.column("tool_length"), direction, inputs)

    def place(self, row: int) -> Place:
        """Where a row stands in its file."""
        return Place(self.path, int(self.lines[row]) if len(self.lines) else row + 1)

    def with_columns(self, values: Mapping[str, Array]) -> Measurement:
        """The same rows with some columns new or replaced."""
        return replace(self, columns={**self.columns, **values})

    def with_header(self, key: str, text: str) -> Measurement:
        """The same rows with one header line set."""
        rest = tuple(pair for pair in self.headers if pair[0] != key)
        return replace(self, headers=(*rest, (key, text)))

    def rows(self, keep: Sequence[int] | Index | NDArray[np.bool_]) -> Measurement:
        """Some of the rows."""
        index = np.arange(len(self))[keep]
        return replace(
            self,
            columns={name: values[index] for name, values in self.columns.items()},
            labels={name: tuple(values[i] for i in index) for name, values in self.labels.items()},
            lines=self.lines[index] if len(self.lines) else self.lines,
        )


def groups(labels: Sequence[str]) -> tuple[tuple[str, ...], Index]:
    """The distinct labels in their order of appearance, and the number of each row's label."""
    names = tuple(dict.fromkeys(labels))
    places = {name: index for index, name in enumerate(names)}
    return names, np.array([places[label] for label in labels], dtype=np.int64)
