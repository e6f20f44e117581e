"""A machine as a chain of elementary transformations.

Joint by joint it is what the fast engine composes, B = Lc L E M(q + offset) inverse(L): M nominal motion, E error
motion about its reference point, L location errors of the axis line, Lc location errors that carry the body.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import sympy as sp

from ncfix.machine.axes import SPINDLE, Axis
from ncfix.machine.axes import Vector as Numbers
from ncfix.machine.chain import columns, lies_on_axis
from ncfix.machine.machine import Machine
from ncfix.machine.symbolic.chain import Chain
from ncfix.machine.symbolic.errors import DEFAULT, ErrorSymbol, chosen
from ncfix.machine.symbolic.exact import Constants
from ncfix.machine.symbolic.steps import (
    UNITS,
    ZERO,
    Rotation,
    Screw,
    Step,
    Translation,
    Vector,
    added,
    cross,
    dot,
    inverse,
    negated,
    rodrigues,
    scaled,
)
from ncfix.machine.symbolic.variables import Size, Variable

Carry = Callable[[Numbers, Vector], Vector]
"""Takes a reference point (numbers and symbols, all axes at zero) to where the joint has carried it."""

Vectors = Sequence[Vector]
BASE: Vectors = tuple(UNITS.values())
LENGTH = Variable("tool_length", Size.LARGE, "from the gauge line to the tip, mm", value=0.0)


def from_machine(machine: Machine, include: str | Iterable[str] = DEFAULT, lettered: bool = False) -> Chain:
    """The chain of a machine with the chosen errors; raises `UsageError` NCF393.

    include   groups (motions, locations, spindle, machine), names or patterns of errors
    lettered  fixed angles of the axes become variables instead of exact constants
    """
    constants = Constants(lettered)
    errors = chosen(machine, include)
    offset = constants.point(machine.workpiece_offset, "W", "the workpiece offset")
    steps: list[Step] = [Translation(negated(offset))]
    for axis in machine.axes:
        own = [error for error in errors if error.joint == axis.name]
        body = _AxisSteps(axis, constants).steps(own)
        steps += inverse(body) if axis.workpiece_side else body
    tool_axis = constants.direction(machine.tool.direction, "T", "the tool's direction")
    steps += _spindle(machine, [error for error in errors if error.joint == SPINDLE], constants)
    steps.append(Translation(added(_gauge(machine, constants), scaled(-LENGTH.symbol, tool_axis))))
    axes = [Variable(a.name, definition=_title(a), axis=True, rotary=a.rotary) for a in machine.axes]
    variables = (*axes, LENGTH, *constants.variables.values(), *(error.variable for error in errors))
    return Chain(machine.name, variables, tuple(_telling(steps)), tool_axis)


def _title(axis: Axis) -> str:
    return f"position of the {'rotary' if axis.rotary else 'linear'} axis {axis.name}, {'rad' if axis.rotary else 'mm'}"


def _telling(steps: Iterable[Step]) -> list[Step]:
    """Without the translations by nothing."""
    return [step for step in steps if not (isinstance(step, Translation) and step.vector == ZERO)]


def _gauge(machine: Machine, constants: Constants) -> Vector:
    return constants.point(machine.tool.point, "T", "the gauge line")


def _spindle(machine: Machine, errors: Sequence[ErrorSymbol], constants: Constants) -> list[Step]:
    references = _References(machine.tool.point, _gauge(machine, constants), constants)
    kinds = ([e for e in errors if e.location], [e for e in errors if not e.location])
    return [step for own in kinds for step in _small_motion(own, BASE, BASE, references)]


class _References:
    """Reference points of a joint as vectors of symbols, carried along by the joint: its own, and those of effects."""

    def __init__(self, numbers: Numbers, symbols: Vector, constants: Constants, carry: Carry | None = None) -> None:
        self._default = numbers
        self._constants = constants
        self._carry = carry
        self.center = self._carried(numbers, symbols)

    def of(self, error: ErrorSymbol) -> Vector:
        """Where this error's rotation causes no translation."""
        if error.reference is None or tuple(error.reference) == tuple(self._default):
            return self.center
        name = f"_{error.variable.name}"
        symbols = self._constants.point(error.reference, name, f"the reference point of {error.variable.name}")
        return self._carried(error.reference, symbols)

    def _carried(self, numbers: Numbers, symbols: Vector) -> Vector:
        return symbols if self._carry is None else self._carry(numbers, symbols)


def _small_motion(
    errors: Iterable[ErrorSymbol], shifts: Vectors, turns: Vectors, references: _References
) -> list[Step]:
    """Translation along `shifts` after rotation about `turns`: T(center) T(t) exp(m, w) T(-center)."""
    shift, turn, moment = ZERO, ZERO, ZERO
    for error in errors:
        if error.component < 3:
            shift = added(shift, scaled(error.variable.symbol, shifts[error.component]))
        else:
            part = scaled(error.variable.symbol, turns[error.component - 3])
            turn = added(turn, part)
            moment = added(moment, cross(added(references.of(error), negated(references.center)), part))
    if turn == ZERO:
        return [Translation(shift)]
    return [Translation(added(references.center, shift)), Screw(turn, moment), Translation(negated(references.center))]


class _AxisSteps:
    """The steps of one axis."""

    def __init__(self, axis: Axis, constants: Constants) -> None:
        self.axis = axis
        self.constants = constants
        self.position = sp.Symbol(axis.name, real=True)
        self.direction = constants.direction(axis.direction, axis.name, f"the {axis.name} axis")
        self.point = constants.point(axis.point, axis.name, f"the {axis.name} axis") if axis.rotary else ZERO
        self.triad = tuple(_triad_row(constants, row, f"{axis.name}{k}") for k, row in enumerate(axis.error_axes, 1))
        self.fixed = _References(axis.reference, self.point, constants)

    def steps(self, errors: Sequence[ErrorSymbol]) -> tuple[Step, ...]:
        """Lc L E M(q + offset) inverse(L)."""
        turned = self._turned_triad()
        moving = _References(self.axis.reference, self.point, self.constants, self._carried)
        motion = _small_motion((e for e in errors if not e.location), turned, turned, moving)
        line = self._line([e for e in errors if e.location and not e.carried])
        carried = _small_motion((e for e in errors if e.carried), self.triad, self.triad, self.fixed)
        return (*carried, *line, *motion, *self._nominal(errors), *inverse(line))

    def _nominal(self, errors: Sequence[ErrorSymbol]) -> list[Step]:
        """M(q + offset): the zero offset is the part of the location errors that is along or about the axis itself."""
        position = self.position
        for error in errors:
            if error.location and not error.carried and (error.component >= 3) == self.axis.rotary:
                share = dot(self.triad[error.component % 3], self.direction)
                position += error.variable.symbol * share * int(self.axis.zero_sense)
        if not self.axis.rotary:
            return [Translation(scaled(position, self.direction))]
        return [Translation(self.point), Rotation(self.direction, position), Translation(negated(self.point))]

    def _line(self, errors: Sequence[ErrorSymbol]) -> list[Step]:
        """L: the rest of the location errors."""
        along = [scaled(-dot(row, self.direction), self.direction) for row in self.triad]
        across = tuple(added(row, part) for row, part in zip(self.triad, along, strict=True))
        shifts, turns = (self.triad, across) if self.axis.rotary else (across, self.triad)
        return _small_motion(errors, shifts, turns, self.fixed)

    def _turned_triad(self) -> Vectors:
        if not (self.axis.moving_frame and self.axis.rotary):
            return self.triad
        rotation = rodrigues(self.direction, self.position)
        return tuple(_times(rotation, row) for row in self.triad)

    def _carried(self, numbers: Numbers, symbols: Vector) -> Vector:
        if not self.axis.rotary:
            return added(symbols, scaled(self.position, self.direction))
        if lies_on_axis(self.axis, columns(numbers)):
            return symbols
        arm = added(symbols, negated(self.point))
        return added(self.point, _times(rodrigues(self.direction, self.position), arm))


def _triad_row(constants: Constants, row: Numbers, suffix: str) -> Vector:
    return constants.direction(row, suffix, f"row {suffix[-1]} of the error axes of {suffix[:-1]}")


def _times(matrix: sp.Matrix, vector: Vector) -> Vector:
    x, y, z = matrix * sp.Matrix(vector)
    return x, y, z
