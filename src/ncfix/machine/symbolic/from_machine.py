"""A machine as a chain of elementary transformations, with chosen errors.

Each joint is composed as in the numerical engine, B = Lc L E M(q + offset) inverse(L): M is the nominal motion, E the
error motion about its reference point, L the location errors of the axis line, Lc location errors that carry the body.

Numbers of a machine file become exact constants where they are recognised: 0.7071067811865476 is sqrt(2)/2, and 50
degrees of a head are exact. Other numbers, and those that the user wants as letters, become Large variables with a
value.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from difflib import get_close_matches
from fnmatch import fnmatchcase
from math import atan2, pi

import sympy as sp

from ncfix.diagnostics import UsageError
from ncfix.machine.axes import COMPONENTS, SPINDLE, Axis, Effect, component_names, component_title
from ncfix.machine.axes import Vector as Numbers
from ncfix.machine.chain import columns, lies_on_axis
from ncfix.machine.machine import Machine
from ncfix.machine.state import SUM
from ncfix.machine.symbolic.chain import (
    UNITS,
    ZERO,
    Chain,
    Expr,
    Rotation,
    Screw,
    Size,
    Step,
    Translation,
    Variable,
    Vector,
    added,
    cross,
    dot,
    inverse,
    negated,
    rodrigues,
    scaled,
)
from ncfix.values import frozen

CLOSE = 1e-14
"""Largest difference of a number from the exact constant that it is taken for."""
STEPS_PER_DEGREE = 60
"""Steps of angles that are taken as exact: whole minutes of arc."""
LARGEST_DENOMINATOR = 100
"""A number is taken as exact if its square is a fraction with a denominator up to this."""


class Constants:
    """Converts numbers to exact constants or to variables, and keeps these: name -> variable."""

    def __init__(self, lettered: bool = False) -> None:
        """`lettered`: fixed angles become variables even where they are recognised."""
        self.lettered = lettered
        self.variables: dict[str, Variable] = {}
        self._shared: dict[tuple[str, float], str] = {}

    def point(self, values: Sequence[float], suffix: str, definition: str) -> Vector:
        """A point, mm: each coordinate is 0 or a variable; points with an equal coordinate share its variable."""
        x, y, z = (self._length(value, c, suffix, definition) for c, value in zip("xyz", values, strict=True))
        return x, y, z

    def _length(self, value: float, coordinate: str, suffix: str, definition: str) -> Expr:
        if not value:
            return sp.Integer(0)
        name = self._shared.setdefault((coordinate, value), f"{coordinate}{suffix}")
        if name in self.variables:
            known = self.variables[name]
            meaning = known.definition if definition in known.definition else f"{known.definition}, {definition}"
            self.variables[name] = replace(known, definition=meaning)
            return known.symbol
        return self._variable(name, value, f"{coordinate} of {definition}")

    def direction(self, values: Sequence[float], suffix: str, definition: str) -> Vector:
        """A unit vector: exact along an axis, by one angle in a coordinate plane, else by roots or binary fractions."""
        inside = [k for k, value in enumerate(values) if abs(value) > CLOSE]
        if len(inside) == 1:
            return tuple(sp.Integer(round(value)) for value in values)
        if len(inside) == 2:
            return self._in_plane(values, inside, suffix, definition)
        x, y, z = (_root(value) or sp.Rational(value) for value in values)
        return x, y, z

    def _in_plane(self, values: Sequence[float], inside: list[int], suffix: str, definition: str) -> Vector:
        near, far = inside if 2 not in inside else reversed(inside)
        size = atan2(abs(values[far]), abs(values[near]))
        where = f"angle from {'xyz'[near]} towards {'xyz'[far]} of {definition}"
        exact = None if self.lettered else _degrees(size)
        angle = self._variable(f"phi{suffix}", size, where, rotary=True) if exact is None else exact
        found = list(ZERO)
        for k, size_k in ((near, sp.cos(angle)), (far, sp.sin(angle))):
            found[k] = size_k if values[k] > 0 else -size_k
        return found[0], found[1], found[2]

    def _variable(self, name: str, value: float, definition: str, rotary: bool = False) -> Expr:
        self.variables[name] = Variable(name, definition=definition, value=float(value), rotary=rotary)
        return self.variables[name].symbol


def _degrees(angle: float) -> Expr | None:
    """The angle as a fraction of pi if it is a whole number of minutes of arc; else None."""
    minutes = round(angle * 180 / pi * STEPS_PER_DEGREE)
    if abs(minutes / STEPS_PER_DEGREE * pi / 180 - angle) > CLOSE:
        return None
    return sp.pi * sp.Rational(minutes, 180 * STEPS_PER_DEGREE)


def _root(value: float) -> Expr | None:
    """The number as plus or minus the square root of a simple fraction; None if that is not exact."""
    square = sp.Rational(value * value).limit_denominator(LARGEST_DENOMINATOR)
    root = sp.sqrt(square) * (1 if value > 0 else -1)
    return root if abs(float(root) - value) < CLOSE else None


DEFAULT = ("motions", "locations", "spindle")
GROUPS = ("motions", "locations", "spindle", "machine")
"""Error motions of the axes; location errors of the axes; location errors of the spindle; all of the machine file."""


@frozen
class ErrorSymbol:
    """An error component of a joint as a variable, with its properties by the machine file.

    component  0 to 2 a translation, 3 to 5 a rotation
    location   it is a location error, else an error motion
    reference  point at which its rotation causes no translation, mm, base frame; None: the joint's reference point
    carried    it is a location error that carries the body
    """

    variable: Variable
    joint: str
    component: int
    location: bool
    reference: Numbers | None
    carried: bool


def chosen(machine: Machine, include: str | Iterable[str] = DEFAULT) -> list[ErrorSymbol]:
    """The errors that `include` chooses by groups, names, or patterns such as "E?C"; raises `UsageError` NCF393."""
    everything = component_names((*machine.axis_names, SPINDLE))
    wanted: set[str] = set()
    for item in [include] if isinstance(include, str) else include:
        found = _group(machine, item) if item in GROUPS else {n for n in everything if fnmatchcase(n, item)}
        if not found and item != "machine":
            close = get_close_matches(item, (*GROUPS, *everything), 1)
            hint = (
                f"{f'did you mean {close[0]}? ' if close else ''}{', '.join(GROUPS)}, a name or a pattern such as E?C"
            )
            raise UsageError.of("NCF393", f"{item!r} matches no error of this machine", hint=hint)
        wanted |= found
    return [_symbol(machine, name) for name in everything if name in wanted]


def _group(machine: Machine, group: str) -> set[str]:
    if group == "machine":
        return {effect.name for effect in machine.effects if effect.active}
    if group == "spindle":
        return {f"E{component}0{SPINDLE}" for component in COMPONENTS}
    zero = "0" if group == "locations" else ""
    return {f"E{component}{zero}{axis}" for axis in machine.axis_names for component in COMPONENTS}


def _symbol(machine: Machine, name: str) -> ErrorSymbol:
    same = [effect for effect in machine.effects if effect.name == name and effect.active] or [Effect(name, (0.0,))]
    effect = same[0]
    references = [each.reference if effect.rotational else None for each in same]  # only a rotation needs one
    if len({*zip(references, (each.carried for each in same), strict=True)}) > 1:
        text = (
            f"the effects {name} of this machine differ in `reference` or `carried`, so that one symbol cannot "
            "represent them"
        )
        raise UsageError.of("NCF393", text, hint="leave it out, or give the effects the same reference point")
    own = () if effect.location or effect.joint == SPINDLE else (effect.joint,)
    named = (signal for each in same for signal in (each.signal, each.times) if signal is not None)
    signals = (name for signal in named for name in signal.split(SUM))
    title, arguments = component_title(name, machine.axis(effect.joint)), tuple(dict.fromkeys((*own, *signals)))
    return ErrorSymbol(
        variable=Variable(name, Size.SMALL, title, rotary=effect.rotational, arguments=arguments),
        joint=effect.joint,
        component=effect.component,
        location=effect.location,
        reference=references[0],
        carried=effect.carried or (effect.location and effect.joint == SPINDLE),
    )


Carry = Callable[[Numbers, Vector], Vector]
"""Gives the place to which the joint has carried a reference point, which is given as numbers and as symbols."""

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
    gauge = constants.point(machine.tool.point, "T", "the gauge line")
    spindle, references = [e for e in errors if e.joint == SPINDLE], _References(machine.tool.point, gauge, constants)
    for location in (True, False):
        steps += _small_motion((e for e in spindle if e.location == location), BASE, BASE, references)
    steps.append(Translation(added(gauge, scaled(-LENGTH.symbol, tool_axis))))
    variables = [*(_position(axis) for axis in machine.axes), LENGTH, *constants.variables.values()]
    variables += [error.variable for error in errors]
    moving = tuple(step for step in steps if not (isinstance(step, Translation) and step.vector == ZERO))
    return Chain(machine.name, tuple(variables), moving, tool_axis)


def _position(axis: Axis) -> Variable:
    kind, unit = ("rotary", "rad") if axis.rotary else ("linear", "mm")
    title = f"position of the {kind} axis {axis.name}, {unit}"
    return Variable(axis.name, definition=title, axis=True, rotary=axis.rotary)


class _References:
    """Reference points of a joint and of its errors as vectors of symbols, carried along by the joint if it moves."""

    def __init__(self, numbers: Numbers, symbols: Vector, constants: Constants, carry: Carry | None = None) -> None:
        self._default = numbers
        self._constants = constants
        self._carry = carry
        self.center = self._carried(numbers, symbols)

    def of(self, error: ErrorSymbol) -> Vector:
        """The point at which this error's rotation causes no translation."""
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
    """The steps of a rotation about vectors `turns`, then a translation along `shifts`.

    They are T(center) T(t) exp(m, w) T(-center): t is the translation, w the rotation vector, and m the moments of
    rotations whose reference point is not the centre.
    """
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
    """Builds the steps of one axis."""

    def __init__(self, axis: Axis, constants: Constants) -> None:
        self.axis = axis
        self.constants = constants
        self.position = sp.Symbol(axis.name, real=True)
        self.direction = constants.direction(axis.direction, axis.name, f"the {axis.name} axis")
        self.point = constants.point(axis.point, axis.name, f"the {axis.name} axis") if axis.rotary else ZERO
        self.triad = tuple(
            constants.direction(row, f"{axis.name}{k}", f"row {k} of the error axes of {axis.name}")
            for k, row in enumerate(axis.error_axes, 1)
        )
        self.fixed = _References(axis.reference, self.point, constants)

    def steps(self, errors: Sequence[ErrorSymbol]) -> tuple[Step, ...]:
        """The steps Lc L E M(q + offset) inverse(L)."""
        turned: Vectors = self.triad
        if self.axis.moving_frame and self.axis.rotary:
            rotation = rodrigues(self.direction, self.position)
            turned = tuple(_times(rotation, row) for row in self.triad)
        moving = _References(self.axis.reference, self.point, self.constants, self._carried)
        motion = _small_motion((e for e in errors if not e.location), turned, turned, moving)
        line = self._line([e for e in errors if e.location and not e.carried])
        carried = _small_motion((e for e in errors if e.carried), self.triad, self.triad, self.fixed)
        return (*carried, *line, *motion, *self._nominal(errors), *inverse(line))

    def _nominal(self, errors: Sequence[ErrorSymbol]) -> list[Step]:
        """M(q + offset); the offset is the part of the location errors along (rotary: about) the axis itself."""
        position = self.position
        for error in errors:
            if error.location and not error.carried and (error.component >= 3) == self.axis.rotary:
                share = dot(self.triad[error.component % 3], self.direction)
                position += error.variable.symbol * share * int(self.axis.zero_sense)
        if not self.axis.rotary:
            return [Translation(scaled(position, self.direction))]
        return [Translation(self.point), Rotation(self.direction, position), Translation(negated(self.point))]

    def _line(self, errors: Sequence[ErrorSymbol]) -> list[Step]:
        """L: the location errors, without the part in the zero offset and those that carry the body."""
        along = [scaled(-dot(row, self.direction), self.direction) for row in self.triad]
        across = tuple(added(row, part) for row, part in zip(self.triad, along, strict=True))
        shifts, turns = (self.triad, across) if self.axis.rotary else (across, self.triad)
        return _small_motion(errors, shifts, turns, self.fixed)

    def _carried(self, numbers: Numbers, symbols: Vector) -> Vector:
        if not self.axis.rotary:
            return added(symbols, scaled(self.position, self.direction))
        if lies_on_axis(self.axis, columns(numbers)):
            return symbols
        arm = added(symbols, negated(self.point))
        return added(self.point, _times(rodrigues(self.direction, self.position), arm))


def _times(matrix: sp.Matrix, vector: Vector) -> Vector:
    x, y, z = matrix * sp.Matrix(vector)
    return x, y, z
