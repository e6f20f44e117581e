"""Candidate poses of a measurement plan: spread over the travels, without a common step, and near the ends.

Positions are a Halton sequence with shuffled digits (Owen 2017). No axis is sampled at equal distances, so an error
periodic with the pitch of a screw cannot be missed (Soons, section 2.3).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field

import numpy as np

from ncfix.arguments import PLANS, TOOL_LENGTH
from ncfix.arrays import Array, Mask
from ncfix.diagnostics import UsageError
from ncfix.machine import Machine
from ncfix.machine.axes import Axis
from ncfix.measure.measurement import Measurement
from ncfix.values import frozen

DECIMALS = 3
CORNERS = 0.4
"""Share of candidates with every axis near an end or the middle of its travel."""
CORNER_WIDTH = 0.03
"""Largest distance from that end or middle, as a share of the travel; random, to avoid a common step."""
APPROACH = {"linear": 2.0, "rotary": 1.0}
"""Distance, mm and degree, from which an axis approaches a position from the wanted side."""
TRIES = 20
"""Number of draws if few poses are within reach."""
BALLS = 4
"""Largest number of balls of an R-test; each is a set."""
FEW = 10
"""Smallest number of poses of a plan for each ball."""
CHOICE = 3
"""Smallest number of candidates for each pose of a plan."""
LOOKED_AT = 120
"""Number of places that are tried for a ball, and of rotary positions at which each is tried."""
APART = 60.0
"""Smallest distance between balls, mm."""
ROUNDING = 1e-9
"""Tolerance of a travel limit, mm or degree."""
UNLIMITED_MM = 100.0
"""Half the assumed travel of a linear axis without a range, mm."""
FINEST = 2.0**-54
"""Smallest digit of a Halton number: half an ulp below one."""


@frozen(slots=False)
class Room:
    """The space and the tools with which can be measured.

    ranges        axis -> (low, high), mm or degree; default: the travel of the machine
    tool_lengths  lengths of the available tools, mm
    balls         ball -> position in the workpiece frame, mm (kind probe)
    reach         x, y or z -> (low, high) limits of the tool tip in the workpiece frame, mm
    inputs        state column such as load_kg -> (low, high) between which it can be set
    """

    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    tool_lengths: Sequence[float] = (100.0,)
    balls: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    reach: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    inputs: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def of(self, axis: Axis) -> tuple[float, float]:
        """The usable range of an axis, mm or degree."""
        if axis.name in self.ranges:
            return self.ranges[axis.name]
        low, high = (limit / axis.unit for limit in axis.range)
        if np.isfinite([low, high]).all():
            return low, high
        return (0.0, 360.0) if axis.rotary else (-UNLIMITED_MM, UNLIMITED_MM)

    def check(self, machine: Machine) -> None:
        """Refuse a space that is impossible on this machine: `UsageError` NCF636, or NCF025 for a tool length."""
        for text, hint in self._faults(machine):
            raise UsageError.of("NCF636", text, hint=hint)
        for length in self.tool_lengths:
            TOOL_LENGTH.check("tool_length", length)

    def _faults(self, machine: Machine) -> Iterator[tuple[str, str]]:
        """Faults as (text, hint)."""
        if faults := list(self._miscounted()):
            yield from faults
            return
        for option, given in (("--range", self.ranges), ("--reach", self.reach), ("--input", self.inputs)):
            for name, (low, high) in given.items():
                if not -np.inf < low < high < np.inf:
                    yield f"{name}={low:g},{high:g} is an empty range", f"{option} {name}=LOW,HIGH"
        travels = {axis.name: [limit / axis.unit for limit in axis.range] for axis in machine.axes}
        for name, (low, high) in self.ranges.items():
            if name not in travels:
                yield f"the machine has no axis {name}, only {' '.join(travels)}", "--range AXIS=LOW,HIGH"
            elif low < travels[name][0] - ROUNDING or high > travels[name][1] + ROUNDING:
                lowest, highest = travels[name]
                yield (
                    f"the travel of {name} is only {lowest:g} to {highest:g}",
                    f"--range {name}={lowest:g},{highest:g}",
                )
        for name in self.reach:
            if name not in ("x", "y", "z"):
                yield f"{name} is none of x, y and z of the workpiece", "--reach x=LOW,HIGH"
        for name, at in self.balls.items():
            if not np.isfinite(at).all():
                yield f"the position of the ball {name} is not finite", f"--ball {name}=X,Y,Z"
        if not len(self.tool_lengths):
            yield "no tool length is given", "--tool-length MM"

    def _miscounted(self) -> Iterator[tuple[str, str]]:
        """Faults of ranges that are not two numbers, and of balls without three coordinates."""
        for option, given in (("--range", self.ranges), ("--reach", self.reach), ("--input", self.inputs)):
            for name, limits in given.items():
                if len(limits) != 2:
                    yield f"the range of {name} is not two numbers", f"{option} {name}=LOW,HIGH"
        for name, at in self.balls.items():
            if len(at) != 3:
                yield f"the position of the ball {name} is not three numbers", f"--ball {name}=X,Y,Z"


def offered(machine: Machine, kind: str, count: int, room: Room, seed: int = 0) -> Measurement:
    """Candidate poses; for kind `tcp` of an R-test if the machine can run one. Raises `UsageError` NCF636."""
    ball = kind == "tcp" and has_r_test(machine)
    return r_test(machine, count, room, seed) if ball else candidates(machine, kind, count, room, seed)


def candidates(machine: Machine, kind: str, count: int, room: Room, seed: int = 0) -> Measurement:
    """`count` random poses of a kind; fewer if probing cannot reach all balls. Raises `UsageError` NCF636."""
    if kind not in PLANS:
        raise UsageError.of("NCF636", f"there are no plans of kind {kind!r}", hint="tcp, tcp6, probe or length")
    random = np.random.default_rng(seed)
    columns = _within_reach(machine, kind, count, room, random)
    if kind in ("tcp", "tcp6"):
        return Measurement(kind, (), columns, {"set": ("1",) * count})
    if kind == "probe":
        return at_balls(machine, columns, room, random)
    return _lengths(columns)


def _within_reach(machine: Machine, kind: str, count: int, room: Room, random: np.random.Generator) -> dict[str, Array]:
    """Columns of poses with the tip within `room.reach` (not for kind probe, whose balls determine the tip)."""
    found = _drawn(machine, count, room, random)
    if not room.reach or kind == "probe":
        return found
    parts, kept = [], 0
    for _ in range(TRIES):
        inside = _inside(machine.tip(_poses(machine, found), found["tool_length"]), room)
        parts.append({name: values[inside] for name, values in found.items()})
        kept += int(inside.sum())
        if kept >= count:
            return {name: np.concatenate([part[name] for part in parts])[:count] for name in found}
        found = _drawn(machine, count, room, random)
    limits = ", ".join(f"{low:g} < {name} < {high:g}" for name, (low, high) in room.reach.items())
    text = f"only {kept} of {TRIES * count} poses that were tried have their tip within {limits}"
    raise UsageError.of("NCF636", text, hint="give a wider --reach, or a --range of the axes that leads there")


def _poses(machine: Machine, columns: Mapping[str, Array]) -> Array:
    """Positions of all axes, (n, n_axes), mm and rad."""
    return np.stack([columns[axis.name] * axis.unit for axis in machine.axes], axis=-1)


def _drawn(machine: Machine, count: int, room: Room, random: np.random.Generator) -> dict[str, Array]:
    """Random positions over the ranges, directions of approach, tools and inputs."""
    columns = {}
    for axis, share in zip(machine.axes, _spread(len(machine.axes), count, random).T, strict=True):
        low, high = room.of(axis)
        columns[axis.name] = np.round(low + (high - low) * share, DECIMALS)
    for axis in machine.axes:
        columns[f"dir_{axis.name}"] = _sides(axis, columns[axis.name], random.choice([-1.0, 1.0], count), room)
    columns["tool_length"] = random.choice(np.asarray(room.tool_lengths, dtype=np.float64), count)
    for name, (low, high) in room.inputs.items():
        columns[name] = np.round(low + (high - low) * _spread(1, count, random)[:, 0], DECIMALS)
    return columns


def _sides(axis: Axis, position: Array, wanted: Array, room: Room) -> Array:
    """The wanted directions of approach, 1 or -1; near an end of the range that from the inside."""
    low, high = room.of(axis)
    step = APPROACH["rotary" if axis.rotary else "linear"]
    return np.where(position - low < step, -1.0, np.where(high - position < step, 1.0, wanted))


def _inside(tip: Array, room: Room) -> Mask:
    """Mask of the tip positions (n, 3) within reach."""
    inside = np.ones(len(tip), dtype=bool)
    for name, (low, high) in room.reach.items():
        place = tip[:, "xyz".index(name)]
        inside &= (place >= low) & (place <= high)
    return inside


def _spread(axes: int, count: int, random: np.random.Generator) -> Array:
    """Positions as shares 0 ... 1 of the ranges, (count, axes)."""
    unit = halton(count, axes, random)
    ends = random.random(count) < CORNERS
    corners = random.choice([0.0, 0.5, 1.0], (int(ends.sum()), axes))
    near = corners + CORNER_WIDTH * random.uniform(-1, 1, (ends.sum(), axes))
    unit[ends] = 1 - np.abs(1 - np.abs(near))
    return unit


def r_test(machine: Machine, count: int, room: Room, seed: int = 0) -> Measurement:
    """Poses of an R-test, kind `tcp`: a ball stands on the table, and the tip stays at it while rotary axes turn.

    Every set has one ball. Rotary positions are random, the linear ones follow; poses outside the travels are drawn
    again. Balls stand where `room` says, or where most rotary positions reach them with the tip within its limits.
    Raises `UsageError` NCF636 if no ball can be reached, or a given ball is out of reach.
    """
    random = np.random.default_rng(seed)
    balls = room.balls or _reachable_balls(machine, room, random, max(1, min(BALLS, count // (CHOICE * FEW))))
    beyond = [name for name, place in balls.items() if not _inside(np.array([place]), room).all()]
    if beyond:
        text = f"the ball {beyond[0]} is outside the --reach of the tip"
        raise UsageError.of("NCF636", text, hint="give a wider --reach, or another position of the ball")
    keys, places = list(balls), np.array(list(balls.values()))
    parts: list[dict[str, Array]] = []
    sets: list[str] = []
    for _ in range(TRIES):
        columns = _drawn(machine, count, room, random)
        which = random.integers(len(keys), size=count)
        found, inside = _moved_to(machine, columns, places[which], room)
        parts.append({name: values[inside] for name, values in found.items()})
        sets += [keys[k] for k in which[inside]]
        if len(sets) >= count:
            break
    if len(sets) < 2:
        raise UsageError.of("NCF636", "no ball can be reached within the travels", hint="--ball NAME=X,Y,Z, --range")
    whole = {name: np.concatenate([part[name] for part in parts])[:count] for name in parts[0]}
    return Measurement("tcp", (), whole, {"set": tuple(sets[:count])})


def has_r_test(machine: Machine) -> bool:
    """Whether the machine can run an R-test: it has rotary axes, and X, Y and Z to follow the ball."""
    return bool(machine.rotary.any()) and {"X", "Y", "Z"} <= {axis.name for axis in machine.axes if not axis.rotary}


def _moved_to(
    machine: Machine, columns: Mapping[str, Array], places: Array, room: Room
) -> tuple[dict[str, Array], Mask]:
    """The columns with X, Y and Z such that the tip is at the places (n, 3); and a mask of those within the travels."""
    q = _poses(machine, columns)
    linear, moved = _towards(machine, q, columns["tool_length"], places)
    limits = np.array([room.of(machine.axes[k]) for k in linear])
    found = dict(columns)
    inside = np.ones(len(q), dtype=bool)
    for k, (low, high), position in zip(linear, limits.tolist(), np.round(moved, DECIMALS).T, strict=True):
        axis = machine.axes[k]
        found[axis.name] = position
        found[f"dir_{axis.name}"] = _sides(axis, position, columns[f"dir_{axis.name}"], room)
        inside &= (position >= low) & (position <= high)
    return found, inside


def _towards(machine: Machine, q: Array, tool_length: Array, places: Array) -> tuple[list[int], Array]:
    """Indices of the axes X, Y, Z, and their positions (n, 3), mm, that bring the tip of poses q to places (n, 3)."""
    linear = [list(machine.axis_names).index(axis) for axis in "XYZ"]
    by_axes = np.linalg.inv(machine.axis_jacobian(q, tool_length)[:, :3, linear])
    gap = machine.tip(q, tool_length) - places
    moved: Array = q[:, linear] - np.einsum("nij,nj->ni", by_axes, gap)
    return linear, moved


def _reachable_balls(
    machine: Machine, room: Room, random: np.random.Generator, most: int
) -> dict[str, tuple[float, float, float]]:
    """Up to `most` ball positions, mm, that most rotary positions reach, at least `APART` from each other."""
    columns = _within_reach(machine, "tcp", LOOKED_AT, room, random)
    q = _poses(machine, columns)
    tips = machine.tip(q, columns["tool_length"])
    if not room.reach:
        tips = np.concatenate([np.array(list(_default_balls(machine, room).values())), tips])
    drawn = _drawn(machine, LOOKED_AT, room, random)
    shares = [float(_moved_to(machine, drawn, np.tile(tip, (LOOKED_AT, 1)), room)[1].mean()) for tip in tips]
    chosen: list[Array] = []
    for index in np.argsort(-np.array(shares), kind="stable").tolist():
        apart = all(np.linalg.norm(tips[index] - other) >= APART for other in chosen)
        if len(chosen) < most and apart and shares[index] > 0:
            chosen.append(np.round(tips[index], DECIMALS))
    if not chosen:
        raise UsageError.of("NCF636", "no ball can be reached within the travels", hint="--ball NAME=X,Y,Z, --range")
    return {f"ball{k}": (float(x), float(y), float(z)) for k, (x, y, z) in enumerate(chosen, 1)}


def at_balls(machine: Machine, columns: dict[str, Array], room: Room, random: np.random.Generator) -> Measurement:
    """Poses of kind `probe`, with the stylus in a random ball; poses outside the travels are dropped."""
    balls = room.balls or _default_balls(machine, room)
    keys = list(balls)
    which = random.integers(len(keys), size=len(columns["X"]))
    q = _poses(machine, columns)
    places = np.array([balls[key] for key in keys])[which]
    linear, moved = _towards(machine, q, columns["tool_length"], places)
    q[:, linear] = moved
    limits = np.array([room.of(machine.axes[k]) for k in linear])
    inside = ((q[:, linear] >= limits[:, 0]) & (q[:, linear] <= limits[:, 1])).all(axis=1)
    if inside.sum() < 2:
        raise UsageError.of("NCF636", "no ball can be reached within the travels", hint="--ball NAME=X,Y,Z, --range")
    columns |= dict(zip(("mx", "my", "mz"), np.round(q[:, linear], DECIMALS).T, strict=True))
    for k, read in zip(linear, ("mx", "my", "mz"), strict=True):
        axis = machine.axes[k]
        columns[f"dir_{axis.name}"] = _sides(axis, columns[read], columns[f"dir_{axis.name}"], room)
    kept = {name: values[inside] for name, values in columns.items() if name not in "XYZ"}
    return Measurement("probe", (), kept, {"ball": tuple(keys[k] for k in which[inside])})


def _default_balls(machine: Machine, room: Room) -> dict[str, tuple[float, float, float]]:
    """Four balls of different height around the tip in the middle of the travels, mm, workpiece frame."""
    middle = [sum(room.of(axis)) / 2 * axis.unit if not axis.rotary else 0.0 for axis in machine.axes]
    x, y, z = machine.tip(np.array([middle]), float(np.mean(room.tool_lengths)))[0].tolist()
    arms = ((60, 0, -20), (0, 60, 20), (-60, 0, 40), (0, -60, 0))
    return {str(k + 1): (x + a, y + b, z + c) for k, (a, b, c) in enumerate(arms)}


def _lengths(columns: Mapping[str, Array]) -> Measurement:
    """Poses of kind `length`: from the position of each row to that of the row before it."""
    found = {name: values for name, values in columns.items() if name not in "XYZ"}
    found |= {f"a{axis.lower()}": columns[axis] for axis in "XYZ"}
    found |= {f"b{axis.lower()}": np.roll(columns[axis], 1) for axis in "XYZ"}
    return Measurement("length", (), found, {"set": ("1",) * len(columns["X"])})


def halton(count: int, sides: int, random: np.random.Generator) -> Array:
    """Points of a scrambled Halton sequence in the unit cube, (count, sides). No number is drawn from `random` itself.

    Each coordinate of point n is the radical inverse of n in a prime base: its digits mirrored behind the point. A
    random permutation of the digits at each place removes the stripes of larger bases.
    """
    own = random.spawn(1)[0]
    primes: list[int] = []
    number = 2
    while len(primes) < sides:
        if all(number % each for each in primes):
            primes.append(number)
        number += 1
    return np.stack([_mirrored(count, base, own) for base in primes], axis=-1)


def _mirrored(count: int, base: int, random: np.random.Generator) -> Array:
    """Radical inverses of 0 ... count - 1 in this base, with permuted digits down to `FINEST`, (count,)."""
    places = int(np.ceil(-np.log2(FINEST) / np.log2(base))) - 1
    rest, place, found = np.arange(count), 1.0 / base, np.zeros(count)
    for digits in np.tile(np.arange(base), (places, 1)):
        random.shuffle(digits)
        found += digits[rest % base] * place
        rest, place = rest // base, place / base
    return found
