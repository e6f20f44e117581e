"""The model that is handed over: known errors of the machine, as the machine file states them.

Own evaluation of three of the file's bases (constant, polynomial, table); nothing else is needed for a base model.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from .chain import COMPONENTS, Errors, Machine
from .motion import Array

_NAME = re.compile(r"E(?P<component>[XYZABC])(?P<located>0?)(?P<axis>[A-Z])")


@dataclass(frozen=True, slots=True)
class Term:
    """One `[[effect]]` of the file: a location error (`EC0Y`), or an error motion (`EXX`) with its basis."""

    name: str
    coefficients: tuple[float, ...]
    basis: str = "constant"
    degree: tuple[int, ...] = ()
    center: float = 0.0
    scale: float = 1.0
    positions: tuple[float, ...] = ()

    @property
    def located(self) -> bool:
        """Whether it is an error of the axis line."""
        return bool(self._parts()["located"])

    @property
    def axis(self) -> str:
        """The axis it belongs to."""
        return self._parts()["axis"]

    @property
    def component(self) -> int:
        """0..5 for ex ey ez ea eb ec."""
        return COMPONENTS.index(self._parts()["component"])

    def _parts(self) -> dict[str, str]:
        match = _NAME.fullmatch(self.name)
        if match is None:
            raise ValueError(self.name)
        return match.groupdict()

    def value(self, position: Array) -> Array:
        """The error at axis positions in the file's unit, mm or rad; end values held outside a table."""
        if self.basis == "table":
            result: Array = np.interp(position, self.positions, self.coefficients)
            return result
        if self.basis == "constant":
            return np.full_like(position, self.coefficients[0])
        u = (position - self.center) / self.scale
        powers: Array = np.power.outer(u, np.asarray(self.degree, dtype=np.float64))
        total: Array = powers @ np.asarray(self.coefficients)
        return total

    def shape(self, position: Array, index: int) -> Array:
        """What one unit of one coefficient adds."""
        return replace(self, coefficients=tuple(float(i == index) for i in range(len(self.coefficients)))).value(
            position
        )


@dataclass(frozen=True, slots=True)
class Model:
    """All known errors of a machine."""

    terms: tuple[Term, ...] = ()

    def errors(self, machine: Machine, q: Array) -> Errors:
        """The motions of all bodies at poses (n, n_axes), mm and rad."""
        errors = machine.no_errors(len(q))
        for term in self.terms:
            index = machine.axes.index(term.axis)
            if term.located:
                errors.located[index, term.component] += term.coefficients[0]
            else:
                errors.twists[:, index, term.component] += term.value(q[:, index] / machine.units[index])
        return errors

    def displacement(self, machine: Machine, q: Array, length: Array) -> Array:
        """Tip error of the erroneous machine, actual minus nominal, workpiece frame (n, 3), exact."""
        return machine.tips(q, length, self.errors(machine, q))[0] - machine.nominal_tip(q, length)

    def with_coefficient(self, term: int, index: int, value: float) -> Model:
        """The same with one coefficient changed."""
        old = self.terms[term]
        values = tuple(value if i == index else c for i, c in enumerate(old.coefficients))
        return Model((*self.terms[:term], replace(old, coefficients=values), *self.terms[term + 1 :]))

    def scaled(self, factor: float) -> Model:
        """All coefficients times a factor."""
        return Model(tuple(replace(t, coefficients=tuple(factor * c for c in t.coefficients)) for t in self.terms))

    def without(self, name: str) -> Model:
        """The same without the terms of that name."""
        return Model(tuple(term for term in self.terms if term.name != name))


def machine_toml(machine: Machine, model: Model) -> str:
    """The machine file of docs/formats.md."""
    lines = ["ncfix = 1", f'name = "{machine.name}"', f'topology = "{machine.topology}"', ""]
    for joint in machine.joints:
        lines += [f"[axis.{joint.name}]", f'type = "{"rotary" if joint.rotary else "linear"}"']
        lines += [f"direction = {_list(joint.direction)}", f"range = {_list((joint.low, joint.high))}"]
        if joint.rotary:
            lines += [f"point = {_list(joint.point)}"]
        if joint.pitch:
            lines += [f"pitch = {joint.pitch!r}"]
        if np.any(np.asarray(joint.triad) != np.eye(3)):
            lines += [f"error_axes = [{', '.join(_list(row) for row in joint.triad)}]"]
        lines += [""]
    lines += ["[tool]", f"direction = {_list(machine.tool_direction)}", f"point = {_list(machine.tool_point)}", ""]
    for term in model.terms:
        lines += _effect(term)
    return "\n".join(lines)


def _effect(term: Term) -> list[str]:
    lines = ["[[effect]]", f'name = "{term.name}"']
    if term.basis != "constant":
        lines += [f'basis = "{term.basis}"']
    if term.basis == "polynomial":
        lines += [f"degree = {list(term.degree)}", f"center = {term.center!r}", f"scale = {term.scale!r}"]
    if term.basis == "table":
        lines += [f"positions = {_list(term.positions)}"]
    return [*lines, f"coefficients = {_list(term.coefficients)}", ""]


def _list(values: tuple[float, ...]) -> str:
    return "[" + ", ".join(repr(float(v)) for v in values) + "]"
