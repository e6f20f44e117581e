"""A second model of a machine with error motions, for judging: written from the machine file's contract, and slow.

It shares nothing with the product: it reads the TOML file itself and follows the chain joint by joint with plain 3x3
matrices. Positions are arrays (n, 9) in the order of the canonical calls, X Y Z A B C U V W, in mm and degrees; a
machine without an axis ignores its column. What this model does not know it refuses, so nothing is judged by half.

A joint with nominal motion M, error motion E and location L moves its body by L E M inverse(L) (by L E M where the
location is `carried`). E turns about M(reference) because the reference point is carried along, and about axes that
do not turn with the joint; in a moving frame E follows M instead.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
LETTERS = "XYZABCUVW"
COMPONENTS = "XYZABC"
EYE = np.eye(3)
CROSS = np.cross(np.eye(3)[:, None], np.eye(3)).swapaxes(1, 2).reshape(3, 9)
"""v @ CROSS, as a matrix, times another vector is v x that vector."""
EFFECT_KEYS = {"name", "basis", "degree", "order", "period", "positions", "knots", "center", "scale"}
EFFECT_KEYS |= {"coefficients", "covariance", "reference", "carried"}


@dataclass(frozen=True, slots=True)
class Motion:
    """A rigid motion per row: p -> turn @ p + shift; turn is (n, 3, 3), or (1, 3, 3) for all rows."""

    turn: Floats
    shift: Floats

    def __matmul__(self, other: Motion) -> Motion:
        turn = self.turn @ other.turn
        return Motion(turn, (self.turn @ other.shift[..., None])[..., 0] + self.shift)

    def of(self, point: Floats) -> Floats:
        """Where a point (3,) or points (n, 3) go."""
        return (self.turn @ np.broadcast_to(point, self.shift.shape)[..., None])[..., 0] + self.shift

    def inverse(self) -> Motion:
        back = np.swapaxes(self.turn, -1, -2)
        return Motion(back, -(back @ self.shift[..., None])[..., 0])


def turned(vector: Floats) -> Floats:
    """Rotation matrices (n, 3, 3) of rotation vectors (n, 3), rad (Rodrigues)."""
    angle = np.sqrt((vector * vector).sum(axis=-1))[..., None, None]
    skew = (vector @ CROSS).reshape(*vector.shape, 3)
    square = vector[..., :, None] * vector[..., None, :]
    return np.cos(angle) * EYE + np.sinc(angle / np.pi) * skew + np.sinc(angle / (2 * np.pi)) ** 2 / 2 * square


def about(point: Floats, rotation: Floats, translation: Floats) -> Motion:
    """Turn by a rotation vector about a point, then shift."""
    turn = turned(rotation)
    shift = point - (turn @ np.broadcast_to(point, rotation.shape)[..., None])[..., 0] + translation
    return Motion(turn, shift)


@dataclass(frozen=True, slots=True)
class Effect:
    """One entry of `[[effect]]`: the component (0..5) of a joint that it adds to."""

    component: int
    joint: str
    location: bool
    carried: bool
    reference: Floats
    basis: Mapping[str, Any]

    def value(self, position: Floats, direction: Floats) -> Floats:
        """The error (mm or rad) at the joint's positions (mm or degree), approached in `direction` (-1, 0, 1)."""
        basis, coefficients = self.basis, np.asarray(self.basis["coefficients"], dtype=float)
        u = (position - basis.get("center", 0.0)) / basis.get("scale", 1.0)
        match basis.get("basis", "constant"):
            case "constant":
                return np.full_like(position, coefficients[0])
            case "polynomial":
                return sum(c * u**power for c, power in zip(coefficients, basis["degree"], strict=True))
            case "fourier":
                return _waves(coefficients, basis["order"], np.radians(position))
            case "periodic":
                return _waves(coefficients, basis["order"], 2 * np.pi * position / basis["period"])
            case "table":
                return np.interp(position, basis["positions"], coefficients)
            case "spline":
                return _spline(np.asarray(basis["knots"], float), int(basis["degree"]), coefficients, position)
            case "backlash":
                powers = basis.get("degree", [0])
                return direction / 2 * sum(c * u**power for c, power in zip(coefficients, powers, strict=True))
            case other:
                raise NotImplementedError(f"basis {other}")


def _waves(coefficients: Floats, orders: list[int], phase: Floats) -> Floats:
    cosines, sines = coefficients[0::2], coefficients[1::2]
    waves = zip(cosines, sines, orders, strict=True)
    return sum((c * np.cos(k * phase) + s * np.sin(k * phase) for c, s, k in waves), start=np.zeros_like(phase))


def _spline(knots: Floats, degree: int, coefficients: Floats, position: Floats) -> Floats:
    """B-spline by the recursion of Cox and de Boor, end values held outside."""
    x = np.clip(position, knots[degree], knots[-degree - 1])
    last = np.nextafter(knots[-degree - 1], -np.inf)
    x = np.minimum(x, last)
    base = [np.where((a <= x) & (x < b), 1.0, 0.0) for a, b in pairwise(knots)]
    for k in range(1, degree + 1):
        rise = [_share(x - knots[i], knots[i + k] - knots[i]) * base[i] for i in range(len(base) - 1)]
        fall = [
            _share(knots[i + k + 1] - x, knots[i + k + 1] - knots[i + 1]) * base[i + 1] for i in range(len(base) - 1)
        ]
        base = [up + down for up, down in zip(rise, fall, strict=True)]
    return sum((c * b for c, b in zip(coefficients, base, strict=True)), start=np.zeros_like(x))


def _share(part: Floats, whole: float) -> Floats:
    """A fraction, zero over an empty knot interval."""
    return part / whole if whole else np.zeros_like(part)


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint of the chain; `S` is one that does not move."""

    name: str
    rotary: bool
    direction: Floats
    point: Floats
    moving: bool
    triad: Floats
    effects: tuple[Effect, ...]

    def nominal(self, position: Floats) -> Motion:
        """What the joint does at positions (n,), mm or degree."""
        n = len(position)
        if self.rotary:
            return about(self.point, np.radians(position)[:, None] * self.direction, np.zeros((n, 3)))
        return Motion(EYE[None], position[:, None] * self.direction)

    def actual(self, position: Floats, direction: Floats) -> Motion:
        """What it really does: L E M inverse(L), or L E M for carried locations, outermost."""
        m = self.nominal(position + self._zero_offset(position, direction))
        e = self._errors(position, direction, m)
        own = m @ e if self.moving else e @ m
        if not any(effect.location for effect in self.effects):
            return own
        place = self._location(position, direction, carried=False)
        return self._location(position, direction, carried=True) @ place @ own @ place.inverse()

    def _is_zero_offset(self, effect: Effect) -> bool:
        """The location component along (linear) or about (rotary) the axis itself is its zero offset."""
        return effect.location and COMPONENTS[effect.component] == self.name and (effect.component >= 3) == self.rotary

    def _zero_offset(self, position: Floats, direction: Floats) -> Floats:
        values = [effect.value(position, direction) for effect in self.effects if self._is_zero_offset(effect)]
        total = sum(values, start=np.zeros_like(position))
        return np.degrees(total) if self.rotary else total

    def _errors(self, position: Floats, direction: Floats, m: Motion) -> Motion:
        """E: about the reference points, which ride on the joint, unless E follows M and finds them at rest."""
        effects = [effect for effect in self.effects if not effect.location]
        return self._small(effects, position, direction, None if self.moving else m)

    def _location(self, position: Floats, direction: Floats, carried: bool) -> Motion:
        effects = [e for e in self.effects if e.location and e.carried == carried and not self._is_zero_offset(e)]
        return self._small(effects, position, direction, None)

    def _small(self, effects: list[Effect], position: Floats, direction: Floats, carrier: Motion | None) -> Motion:
        """All the effects as one small motion: rotations add as vectors, each turning about its own reference."""
        rotation, shift = np.zeros((len(position), 3)), np.zeros((len(position), 3))
        if not effects:
            return Motion(EYE[None], shift)
        for effect in effects:
            vector = effect.value(position, direction)[:, None] * self.triad[effect.component % 3]
            if effect.component < 3:
                shift += vector
                continue
            point = effect.reference if carrier is None else carrier.of(effect.reference)
            rotation += vector
            shift += point - (turned(vector) @ np.broadcast_to(point, vector.shape)[..., None])[..., 0]
        return Motion(turned(rotation), shift)


@dataclass(frozen=True, slots=True)
class Machine:
    """A chain of joints; each branch in order from the foundation outwards, the spindle last on the tool's."""

    name: str
    workpiece: tuple[Joint, ...]
    tool: tuple[Joint, ...]
    tool_direction: Floats
    tool_point: Floats
    linear_step: float
    rotary_step: float

    @property
    def linear(self) -> list[int]:
        """Columns of the linear axes."""
        return [LETTERS.index(j.name) for j in (*self.workpiece, *self.tool) if j.name in LETTERS and not j.rotary]

    @property
    def rotary(self) -> list[int]:
        """Columns of the rotary axes."""
        return [LETTERS.index(j.name) for j in (*self.workpiece, *self.tool) if j.rotary]

    def tip(self, q: Floats, length: Floats | float = 0.0) -> Floats:
        """(n, 3) tip in the workpiece frame of the perfect machine."""
        return self._frame(q, None).of(self._tip_at_zero(length))

    def actual_tip(self, q: Floats, length: Floats | float = 0.0, direction: Floats | None = None) -> Floats:
        """(n, 3) where the tip really is."""
        way = np.zeros_like(q) if direction is None else direction
        return self._frame(q, way).of(self._tip_at_zero(length))

    def pose(self, q: Floats, actual: bool, direction: Floats | None = None) -> Motion:
        """workpiece_from_tool at the gauge line, nominal or actual."""
        way = np.zeros_like(q) if direction is None else direction
        return self._frame(q, way if actual else None)

    def corrected(self, q: Floats, length: Floats | float = 0.0, direction: Floats | None = None) -> Floats:
        """(n, 9) commands that bring the real tip to where the perfect machine has it; rotary axes stay."""
        wanted, command, slopes = self.tip(q, length), np.array(q, dtype=np.float64), self._slopes(q)
        for _ in range(4):
            miss = wanted - self.actual_tip(command, length, direction)
            command[:, self.linear] += np.linalg.solve(slopes, miss[..., None])[..., 0]
        return command

    def embedded(self, q: Floats, length: Floats | float = 0.0, direction: Floats | None = None) -> Floats:
        """(n, 9) commands with which the perfect machine has its tip where the real one has it under `q`.

        The inverse of `corrected`, and exact: with the rotary axes at rest the nominal tip is affine in the others.
        """
        error = self.actual_tip(q, length, direction) - self.tip(q, length)
        seen = np.array(q, dtype=np.float64)
        seen[:, self.linear] += np.linalg.solve(self._slopes(q), error[..., None])[..., 0]
        return seen

    def _slopes(self, q: Floats) -> Floats:
        """(n, 3, 3) d tip / d linear axes: the nominal tip is affine in them, so a difference is exact."""
        here = self.tip(q)
        return np.stack([self.tip(q + np.eye(9)[axis]) - here for axis in self.linear], axis=-1)

    def _tip_at_zero(self, length: Floats | float) -> Floats:
        return self.tool_point - np.atleast_1d(length)[:, None] * self.tool_direction

    def _frame(self, q: Floats, direction: Floats | None) -> Motion:
        return self._branch(self.workpiece, q, direction).inverse() @ self._branch(self.tool, q, direction)

    def _branch(self, joints: tuple[Joint, ...], q: Floats, direction: Floats | None) -> Motion:
        n = len(q)
        moved = Motion(EYE[None], np.zeros((n, 3)))
        for joint in joints:
            column = LETTERS.find(joint.name)
            position = q[:, column] if column >= 0 else np.zeros(n)
            if direction is None:
                moved = moved @ joint.nominal(position)
            else:
                moved = moved @ joint.actual(position, direction[:, column] if column >= 0 else np.zeros(n))
        return moved


def load(path: Path) -> Machine:
    """Read a machine file."""
    return from_dict(tomllib.loads(path.read_text()))


def from_dict(table: Mapping[str, Any]) -> Machine:
    """A machine from the contents of its file."""
    names = table["topology"].split()
    middle = names.index("F")
    spindle = table["tool"]["point"]
    joints = {name: _joint(name, table["axis"][name], table, spindle) for name in names[1:-1] if name not in ("F", "S")}
    joints["S"] = _joint("S", {"type": "linear", "direction": [0, 0, 0]}, table, spindle)
    outward = [name for name in names[middle + 1 : -1] if name != "S"]
    step = table.get("least_increment", {})
    return Machine(
        name=table["name"],
        workpiece=tuple(joints[name] for name in reversed(names[1:middle])),
        tool=tuple(joints[name] for name in [*outward, "S"]),
        tool_direction=_unit(table["tool"]["direction"]),
        tool_point=np.array(spindle, dtype=np.float64),
        linear_step=step.get("linear", 0.001),
        rotary_step=step.get("rotary", 0.001),
    )


def _joint(name: str, axis: Mapping[str, Any], table: Mapping[str, Any], spindle: list[float]) -> Joint:
    rotary = axis["type"] == "rotary"
    point = np.array(axis.get("point", [0, 0, 0]), dtype=np.float64)
    default = np.array(spindle, dtype=np.float64) if name == "S" else point if rotary else np.zeros(3)
    effects = [_effect(entry, default) for entry in table.get("effect", []) if entry["name"].endswith(name)]
    direction = np.array(axis["direction"], dtype=np.float64)
    return Joint(
        name=name,
        rotary=rotary,
        direction=direction / (np.linalg.norm(direction) or 1.0),
        point=point,
        moving=axis.get("error_frame", "") == "moving",
        triad=np.array(axis.get("error_axes", np.eye(3)), dtype=np.float64),
        effects=tuple(effects),
    )


def _effect(entry: Mapping[str, Any], reference: Floats) -> Effect:
    unknown = set(entry) - EFFECT_KEYS
    if unknown or len(entry["name"].replace("0", "")) != 3 or entry["name"][0] != "E":
        raise NotImplementedError(f"effect {entry['name']}: {sorted(unknown)}")
    return Effect(
        component=COMPONENTS.index(entry["name"][1]),
        joint=entry["name"][-1],
        location=entry["name"][2] == "0",
        carried=bool(entry.get("carried", False)) or entry["name"][-1] == "S",
        reference=np.array(entry["reference"], dtype=np.float64) if "reference" in entry else reference,
        basis=entry,
    )


def _unit(vector: list[float]) -> Floats:
    array = np.array(vector, dtype=np.float64)
    return array / np.linalg.norm(array)
