"""Poses from which a plan chooses: spread over the travels without a common step, and their ends.

Positions come from Halton's sequence with the digits of every place shuffled (Owen 2017), so no axis is sampled at even
distances: an error that repeats with a screw's pitch cannot hide (Soons, section 2.3).
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
"""Share of candidates of which each axis stands near one of its ends or the middle."""
NEAR = 0.03
"""How near, as a share of the travel: not at the same place each time, or the places would have a common step."""
APPROACH = {"linear": 2.0, "rotary": 1.0}
"""mm and degree: how far an axis goes back before it comes from the wanted side."""
TRIES = 20
"""How often more poses are drawn where few of them are within reach."""
BALLS = 4
"""Of an R-test, sets with a ball each, if there are poses enough."""
FEW = 10
"""Poses that a ball is worth."""
CHOICE = 3
"""Candidates for each pose of a plan, at least."""
LOOKED_AT = 120
"""Places at which a ball might stand, and positions of the rotary axes at which it is seen whether it is reached."""
APART = 60.0
"""mm: between balls."""
ROUNDING = 1e-9
"""mm or degree: no way beyond the travel."""
UNLIMITED_MM = 100.0
"""Half the travel that is taken for a linear axis without a range."""
FINEST = 2.0**-54
"""Digits count down to this: below it a number next to one cannot be told from one."""


@frozen(slots=False)
class Room:
    """Where measuring is possible.

    ranges        axis -> (low, high) mm or degree; those of the machine where not given
    tool_lengths  mm, the tools that there are
    balls         ball -> place in the workpiece frame, mm (kind probe)
    reach         x, y or z -> (low, high) mm between which the tip stays, workpiece frame
    inputs        state column, such as load_kg -> (low, high) between which it can be set
    """

    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    tool_lengths: Sequence[float] = (100.0,)
    balls: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    reach: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    inputs: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def of(self, axis: Axis) -> tuple[float, float]:
        """The range of an axis, mm or degree."""
        if axis.name in self.ranges:
            return self.ranges[axis.name]
        low, high = (limit / axis.unit for limit in axis.range)
        if np.isfinite([low, high]).all():
            return low, high
        return (0.0, 360.0) if axis.rotary else (-UNLIMITED_MM, UNLIMITED_MM)

    def check(self, machine: Machine) -> None:
        """Refuse what this machine cannot measure in: `UsageError` NCF636, or NCF025 for a length that no tool has."""
        for text, hint in self._faults(machine):
            raise UsageError.of("NCF636", text, hint=hint)
        for length in self.tool_lengths:
            TOOL_LENGTH.check("tool_length", length)

    def _faults(self, machine: Machine) -> Iterator[tuple[str, str]]:
        """What is the matter, with what to do about it."""
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
                yield f"{name} goes from {lowest:g} to {highest:g} only", f"--range {name}={lowest:g},{highest:g}"
        for name in self.reach:
            if name not in ("x", "y", "z"):
                yield f"{name} is none of x, y and z of the workpiece", "--reach x=LOW,HIGH"
        for name, at in self.balls.items():
            if not np.isfinite(at).all():
                yield f"the ball {name} stands nowhere", f"--ball {name}=X,Y,Z"
        if not len(self.tool_lengths):
            yield "there is no tool to measure with", "--tool-length MM"

    def _miscounted(self) -> Iterator[tuple[str, str]]:
        """Ranges that are not two numbers, and balls without three coordinates."""
        for option, given in (("--range", self.ranges), ("--reach", self.reach), ("--input", self.inputs)):
            for name, limits in given.items():
                if len(limits) != 2:
                    yield f"the range of {name} is not two numbers", f"{option} {name}=LOW,HIGH"
        for name, at in self.balls.items():
            if len(at) != 3:
                yield f"the place of the ball {name} is not three numbers", f"--ball {name}=X,Y,Z"


def offered(machine: Machine, kind: str, count: int, room: Room, seed: int = 0) -> Measurement:
    """Poses of this kind, for `tcp` those of an R-test where the machine can run one. Raises `UsageError` NCF636."""
    ball = kind == "tcp" and has_r_test(machine)
    return r_test(machine, count, room, seed) if ball else candidates(machine, kind, count, room, seed)


def candidates(machine: Machine, kind: str, count: int, room: Room, seed: int = 0) -> Measurement:
    """A plan of so many poses of this kind; fewer where probing cannot reach. Raises `UsageError` NCF636."""
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
    """Columns of poses whose tip stays where it may; of probed balls the balls say where the tip is."""
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
    text = f"{kept} of {TRIES * count} poses tried have their tip within {limits}"
    raise UsageError.of("NCF636", text, hint="wider --reach, or --range of axes that lead there")


def _poses(machine: Machine, columns: Mapping[str, Array]) -> Array:
    """Positions of all axes, (n, n_axes), mm and rad."""
    return np.stack([columns[axis.name] * axis.unit for axis in machine.axes], axis=-1)


def _drawn(machine: Machine, count: int, room: Room, random: np.random.Generator) -> dict[str, Array]:
    """Positions all over the ranges, sides, tools and what else can be set."""
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
    """From which side the axis comes: as wanted, but from the inside where there is no room beyond."""
    low, high = room.of(axis)
    step = APPROACH["rotary" if axis.rotary else "linear"]
    return np.where(position - low < step, -1.0, np.where(high - position < step, 1.0, wanted))


def _inside(tip: Array, room: Room) -> Mask:
    """Which places of the tip (n, 3) are within reach."""
    inside = np.ones(len(tip), dtype=bool)
    for name, (low, high) in room.reach.items():
        place = tip[:, "xyz".index(name)]
        inside &= (place >= low) & (place <= high)
    return inside


def _spread(axes: int, count: int, random: np.random.Generator) -> Array:
    """Shares of the ranges, (count, axes)."""
    unit = halton(count, axes, random)
    ends = random.random(count) < CORNERS
    near = random.choice([0.0, 0.5, 1.0], (int(ends.sum()), axes)) + NEAR * random.uniform(-1, 1, (ends.sum(), axes))
    unit[ends] = 1 - np.abs(1 - np.abs(near))
    return unit


def r_test(machine: Machine, count: int, room: Room, seed: int = 0) -> Measurement:
    """A plan of kind `tcp` as it is measured: a ball stands on the table, and the tip stays at it while axes turn.

    Every set has one ball. The rotary axes are drawn, the linear ones follow from them; what the travels do not allow
    is drawn again. Balls stand where `room` says, or where most positions of the rotary axes reach them, with the tip
    within its reach. Raises `UsageError` NCF636 where no ball can be reached, or one is to stand beyond the reach.
    """
    random = np.random.default_rng(seed)
    balls = room.balls or _reachable_balls(machine, room, random, max(1, min(BALLS, count // (CHOICE * FEW))))
    beyond = [name for name, place in balls.items() if not _inside(np.array([place]), room).all()]
    if beyond:
        text = f"the ball {beyond[0]} stands where the tip may not go"
        raise UsageError.of("NCF636", text, hint="wider --reach, or another place")
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
    """Whether a ball tells anything: there are axes that turn about it, and X, Y and Z that follow."""
    return bool(machine.rotary.any()) and {"X", "Y", "Z"} <= {axis.name for axis in machine.axes if not axis.rotary}


def _moved_to(
    machine: Machine, columns: Mapping[str, Array], places: Array, room: Room
) -> tuple[dict[str, Array], Mask]:
    """The columns with X, Y and Z where the tip is at the places (n, 3), and which of these the travels allow."""
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
    """The columns of X, Y and Z, and where these bring the tip of poses q (n, n_axes) to the places (n, 3): (n, 3)."""
    linear = [list(machine.axis_names).index(axis) for axis in "XYZ"]
    by_axes = np.linalg.inv(machine.axis_jacobian(q, tool_length)[:, :3, linear])
    gap = machine.tip(q, tool_length) - places
    moved: Array = q[:, linear] - np.einsum("nij,nj->ni", by_axes, gap)
    return linear, moved


def _reachable_balls(
    machine: Machine, room: Room, random: np.random.Generator, most: int
) -> dict[str, tuple[float, float, float]]:
    """Places within reach, apart from each other, that most positions of the rotary axes can bring to the tip."""
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
    """Poses with the stylus in one of the balls at random, those that the travels allow."""
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
    """Four balls of different height round the point where the tip is in the middle of the travels."""
    middle = [sum(room.of(axis)) / 2 * axis.unit if not axis.rotary else 0.0 for axis in machine.axes]
    x, y, z = machine.tip(np.array([middle]), float(np.mean(room.tool_lengths)))[0].tolist()
    arms = ((60, 0, -20), (0, 60, 20), (-60, 0, 40), (0, -60, 0))
    return {str(k + 1): (x + a, y + b, z + c) for k, (a, b, c) in enumerate(arms)}


def _lengths(columns: Mapping[str, Array]) -> Measurement:
    """Distances between two places, the second taken from another row."""
    found = {name: values for name, values in columns.items() if name not in "XYZ"}
    found |= {f"a{axis.lower()}": columns[axis] for axis in "XYZ"}
    found |= {f"b{axis.lower()}": np.roll(columns[axis], 1) for axis in "XYZ"}
    return Measurement("length", (), found, {"set": ("1",) * len(columns["X"])})


def halton(count: int, sides: int, random: np.random.Generator) -> Array:
    """So many points of the unit cube, (count, sides). `random` itself is drawn no number from.

    The n-th point has, along each side, the digits of n to a prime base, mirrored behind the point; shuffling the
    digits of each place takes away the stripes that the larger primes have.
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
    """The numbers 0 ... count - 1 as digits of this base behind the point, until one no longer counts: (count,)."""
    places = int(np.ceil(-np.log2(FINEST) / np.log2(base))) - 1
    rest, place, found = np.arange(count), 1.0 / base, np.zeros(count)
    for digits in np.tile(np.arange(base), (places, 1)):
        random.shuffle(digits)
        found += digits[rest % base] * place
        rest, place = rest // base, place / base
    return found
