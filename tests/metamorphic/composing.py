"""One path written plainly, and through a random stack of rewrites: what many features together make of it.

A composition is a list of items. Events (lines, arcs, holes, detours) are in both programs; rewrites (another frame,
another unit, a subprogram) are in one of them, and an item that does not apply where it stands does nothing. Each item
draws from a seed of its own, so that items can be left out one by one until only what makes the difference is left.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from metamorphic.harness import LENGTH, OPTIONS, SETUP, ends
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_flat, fix_program
from ncfix.compensate.following import kinematics_of, rotary_names, with_workpiece
from ncfix.compensate.plan.kinematics import commands_from_joints
from ncfix.control.moves import FeedMode, MotionKind, Moves, Rule
from ncfix.control.setup import Setup, Tool
from ncfix.control.trace import trace
from ncfix.machine import Machine
from ncfix.text.reader import read

Vector = NDArray[np.float64]

PLANAR = ("arc", "hole", "contour", "corner", "tangent", "pecked")
"""Events in the planes of a tool that stands upright."""
PLANES = {"Z": [0, 1], "Y": [2, 0], "X": [1, 2]}
"""The two axes of a plane by the axis across it."""
TURNING = ("swivelled",)
"""Events of a tool that turns."""
SAME = 3e-4
"""mm: paths are one and the same, but for six digits in inches, in turned and scaled coordinates."""
ROUNDED, ROUNDED_TURNED = 5e-4, 1.5e-3
"""mm and degrees: corrected words have steps of 0.1 um, 0.25 um in inches, on both sides; angles that `full` corrects
have steps of 0.0001 degree, which X Y Z make up for at levers of some 100 mm."""

SECOND = {"X": 7.5, "Y": -4.25, "Z": 52.0, "A": 0.0, "B": 0.0, "C": 12.0}
"""Another work offset."""
FEED, SPEED = 500.0, 1000.0
"""mm/min, and revolutions of the spindle per minute."""
SHORT = 65.5
"""The length of another tool, mm."""
COMPOSED = replace(
    SETUP,
    work_offsets=SETUP.work_offsets
    | {"G55": SECOND, "PRESET": SETUP.work_offsets["G54"], "PRESET1": SETUP.work_offsets["G54"], "PRESET2": SECOND},
    tools={0: Tool(LENGTH, 3.0), 1: Tool(LENGTH, 3.0), 2: Tool(SHORT, 2.0)},
    variables={"$SC_TOOL_LENGTH_CONST": 17.0},
    references={code: {"X": 0.0, "Y": 0.0, "Z": 290.0} for code in ("G28", "G74")},
)


class Item(NamedTuple):
    """An event or a rewrite, and where its numbers come from."""

    kind: str
    seed: int


class Frame(NamedTuple):
    """Coordinates of the work offset are `turn @ coordinates of the program + shift`."""

    turn: Vector = np.eye(3)
    shift: Vector = np.zeros(3)

    def __matmul__(self, other: Frame) -> Frame:
        return Frame(self.turn @ other.turn, self.turn @ other.shift + self.shift)

    def inverse(self, point: Vector) -> Vector:
        """Where the program says that a point is."""
        return np.linalg.solve(self.turn, point - self.shift)


def shifted(*by: float) -> Frame:
    """Another zero."""
    return Frame(np.eye(3), np.array(by))


def scaled(*factors: float) -> Frame:
    """Mirrored or scaled."""
    return Frame(np.diag(factors))


def turned(axis: str, degrees: float, centre: Sequence[float] = (0.0, 0.0, 0.0)) -> Frame:
    """Turned about an axis through a point, right-handed."""
    i, j = PLANES[axis]
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.eye(3)
    turn[[i, i, j, j], [i, j, i, j]] = c, -s, s, c
    return Frame(turn, np.array(centre) - turn @ np.array(centre))


def number(value: float, places: int) -> str:
    """A number without zeros at its end, but with its point."""
    text = f"{value:.{places}f}".rstrip("0")
    return "0." if float(text) == 0 else text


class Author:
    """Writes the items of a composition as one program of a language; `wild`: with the rewrites.

    q        where the axes stand: X Y Z, mm, the tilting axis and C, degrees
    frame    coordinates of the program in those of the work offset
    offset   the work offset in force
    length   the tool length in force
    unit     mm per unit of the program
    tcp      X Y Z are the tip in the workpiece
    steps    words are increments
    unsaid   axes which the program has to name
    metric   F is in mm though words are in inches: feeds are not compared
    text     what was written
    rotary, exact, flat  the tool turns; nothing may be rounded on the way; the program will be written out flat
    """

    comment = "; here"
    text = ""
    metric = False
    rotary = False
    exact = False
    flat = False
    EVENTS: ClassVar[dict[str, float]] = {"line": 6, "rapid": 2}
    REWRITES: ClassVar[dict[str, float]] = {}

    def __init__(self, machine: Machine, dialect: str, *, wild: bool, setup: Setup) -> None:
        self.machine, self.dialect, self.wild, self.setup = machine, dialect, wild, setup
        self.placed = with_workpiece(machine, setup)
        self.tilting = next(axis.name for axis in machine.axes if axis.rotary and axis.name != "C")
        self.letters = "XYZ" + self.tilting + "C"
        self.lines: list[str] = []
        self.moving: set[str] = set()
        self.behind: list[str] = []
        self.open: list[tuple[int, Callable[[], None]]] = []
        self.q = np.array([0.0, 0.0, 290.0, 0.0, 0.0])
        self.frame, self.offset = Frame(), SETUP.work_offsets["G54"]
        self.length, self.unit, self.tcp, self.steps, self.code = 0.0, 1.0, False, False, ""
        self.unsaid = set(self.letters)
        self.names = iter(range(1, 1000))
        self.begin()

    def begin(self) -> None:
        """The head of the program."""

    def finish(self) -> str:
        """The program."""
        raise NotImplementedError

    def write(self, items: Sequence[Item]) -> str:
        """The items as a program."""
        for kind, seed in items:
            if kind in self.EVENTS or self.wild:
                self.style = random.Random(seed + 1)
                getattr(self, kind)(random.Random(seed))
            if kind in self.EVENTS:
                self.open = [(left - 1, close) for left, close in self.open]
                while self.open and self.open[-1][0] <= 0:
                    self.open.pop()[1]()
        while self.open:
            self.open.pop()[1]()
        return self.finish()

    def put(self, line: str, moves: bool = False) -> None:
        """Another line."""
        self.lines.append(line)
        if moves:
            self.moving.add(line)

    def wrap(self, chance: random.Random, close: Callable[[], None]) -> None:
        """What the next events write is within something that is closed behind them."""
        self.open.append((chance.randint(1, 4), close))

    def often(self, share: float) -> bool:
        """A choice of style: never in the plain program."""
        return self.wild and self.style.random() < share

    # -- places -------------------------------------------------------------------------------------------------------

    def place(self, q: Vector) -> Vector:
        """A position of the axes in coordinates of the program, mm and degrees."""
        offset = np.array([self.offset[letter] for letter in self.letters])
        linear = q[:3] - (0.0, 0.0, self.length)
        if self.tcp:
            columns = [self.letters.index(name) for name in self.machine.axis_names]
            joints = np.where(self.machine.rotary, np.radians(q[columns]), q[columns])[None]
            found = commands_from_joints(self.placed, joints, np.array([True]), np.array([self.length]))[0]
            linear = found[[list(self.machine.axis_names).index(letter) for letter in "XYZ"]]
        return np.concatenate([self.frame.inverse(linear - offset[:3]), q[3:] - offset[3:]])

    def somewhere(self, chance: random.Random, *, turns: bool = False) -> Vector:
        """Another position; some axes stay."""
        q = self.q.copy()
        low = [-40.0, -40.0, 120.0, -40.0, -90.0]
        for axis in chance.sample(range(5 if turns else 3), chance.randint(1, 5 if turns else 3)):
            q[axis] = round(low[axis] + chance.random() * (80, 80, 80, 80, 180)[axis], chance.choice([1, 2, 3]))
        return q

    def bow(self, chance: random.Random, across: str = "Z") -> tuple[Vector, Vector, float, float]:
        """An arc in a plane, or a helix: where it ends, its centre, its sweep, rad, and how far it climbs."""
        radius, side = chance.uniform(3, 15), np.radians(chance.uniform(0, 360))
        sweep = np.radians(chance.choice([-1, 1]) * chance.choice([chance.uniform(20, 160), chance.uniform(200, 340)]))
        climb = chance.choice([0.0, chance.uniform(-5, 5)])
        from_centre, along = np.zeros(3), np.eye(3)["XYZ".index(across)]
        from_centre[PLANES[across]] = radius * np.cos(side), radius * np.sin(side)
        centre, target = self.q[:3] - from_centre, self.q.copy()
        target[:3] = centre + turned(across, np.degrees(sweep)).turn @ from_centre + climb * along
        return target.round(6), centre, sweep, climb

    def legs(self, chance: random.Random) -> tuple[Vector, Vector, Vector, float]:
        """A line in the plane XY and what goes on behind it: where it ends, where a line from there to one side ends,
        the centre of an arc that goes on in its direction, and the sweep of the arc, rad."""
        way, turn = np.radians(chance.uniform(0, 360)), chance.choice([-1, 1]) * np.radians(chance.uniform(30, 140))
        first = self.q.copy()
        first[:2] = (first[:2] + 20.0 * np.array([np.cos(way), np.sin(way)])).round(3)
        way = np.arctan2(*(first - self.q)[1::-1])
        last, centre = first.copy(), first[:3].copy()
        last[:2] = (last[:2] + 20.0 * np.array([np.cos(way + turn), np.sin(way + turn)])).round(3)
        centre[:2] += np.sign(turn) * 12.0 * np.array([-np.sin(way), np.cos(way)])
        return first, last, centre, turn

    def pointed(self, target: Vector) -> Vector | None:
        """The direction of the tool at a position, in coordinates of the program; None: the nearest way there may be
        another one, or the frame is no plain rotation."""
        (a, c), (tilt, turn) = target[3:], self.q[3:]
        if a * tilt < 9.0 or abs(a - tilt) + abs(c - turn) > 60.0 or not np.allclose(np.linalg.det(self.frame.turn), 1):
            return None
        return self.frame.turn.T @ self.posture(target)[:, 2]

    def posture(self, q: Vector) -> Vector:
        """How the tool stands in the workpiece (3, 3)."""
        columns = [self.letters.index(name) for name in self.machine.axis_names]
        joints = np.where(self.machine.rotary, np.radians(q[columns]), q[columns])
        return np.asarray(self.placed.nominal(joints, self.length))[:3, :3]

    def swivelled(self, chance: random.Random) -> None:
        """The tool turned, then lines square to it: sometimes in a plane to which the control turns it."""
        target, spin = self.q.copy(), chance.uniform(-180, 180)
        target[3:] = self.somewhere(chance, turns=True)[3:]
        origin = [round(chance.uniform(-10, 10), 2) for _ in range(3)]
        tilted = self.wild and self.may_swivel() and self.pointed(target) is not None
        if tilted:
            plane = shifted(*origin) @ Frame(self.posture(target) @ turned("Z", spin).turn)
            self.swivel(plane, target)
            self.q, self.unsaid = target, set("XYZ")
        else:
            self.travel(target, rapid=True)
        for rapid in (True, False):
            self.travel(self.somewhere(chance), rapid=rapid)
        if tilted:
            self.unswivel()
            self.unsaid = set(self.letters)

    def may_swivel(self) -> bool:
        """Make ready for a plane to which the control turns; False: it cannot."""
        raise NotImplementedError

    def swivel(self, plane: Frame, target: Vector) -> None:
        """Turn to a plane, in which the axes stand at a position."""
        raise NotImplementedError

    def unswivel(self) -> None:
        """Leave that plane."""
        raise NotImplementedError

    def travel(self, target: Vector, *, rapid: bool) -> None:
        """A straight motion."""
        raise NotImplementedError

    def values(self, target: Vector) -> dict[str, float]:
        """The words of a motion, in units of the program: those that it needs, and sometimes all."""
        here, there = self.place(self.q), self.place(target)
        sparing = self.often(0.5) and not self.unsaid
        steps = self.steps and not self.unsaid
        found = {}
        for n, letter in enumerate(self.letters):
            moves = abs(there[n] - here[n]) > 1e-7
            if n > 2 and not moves and letter not in self.unsaid:
                continue
            if moves or not sparing:
                found[letter] = (there[n] - here[n] if steps else there[n]) / (self.unit if n < 3 else 1.0)
        self.unsaid -= set(found)
        return found or {"X": 0.0 if steps else there[0] / self.unit}


# -- the judge --------------------------------------------------------------------------------------------------------


class Composition(NamedTuple):
    """A route with its rewrites, and what it is corrected with."""

    author: type[Author]
    dialect: str
    machine: Machine
    setup: Setup
    options: FixOptions
    items: Sequence[Item]

    def written(self, *, wild: bool) -> Author:
        """Its author, who has written it."""
        author = self.author(self.machine, self.dialect, wild=wild, setup=self.setup)
        author.text = author.write(self.items)
        return author


class Corrected(NamedTuple):
    """A program that was corrected: its motions (n, k) before and behind, which of them (n,) are passed in the end, why
    some were refused, or are when it is read again, and how many pass by which rule."""

    text: str
    before: Vector
    after: Vector
    passes: NDArray[np.bool_]
    refused: Sequence[str]
    passed: Mapping[str, int]


def compose(author: type[Author], dialect: str, machines: Sequence[Machine], seed: int) -> Composition:
    """A composition at random. With play no numbers are rounded on the way: the smallest step back counts."""
    chance = random.Random(seed)
    rotary, flat = chance.random() < 0.4, chance.random() < 0.25
    exact, machine = not rotary and chance.random() < 0.5, chance.choice(machines)
    if not exact:
        machine = machine.replace(effects=tuple(e for e in machine.effects if not e.basis.needs_direction))
    strategy = chance.choice(["position", "full", "rotary-then-linear"])
    others = PLANAR if rotary else TURNING
    events = {each: share for each, share in author.EVENTS.items() if each not in others}
    left_out = {"units"} if exact else {"increments"} if rotary and strategy == "full" else set()
    rewrites = {each: share for each, share in author.REWRITES.items() if each not in left_out}
    own = type(author.__name__, (author,), {"rotary": rotary, "exact": exact, "flat": flat})
    items = [
        Item(chance.choices(list(pool), list(pool.values()))[0], chance.randrange(10**6))
        for pool in chance.choices([events, rewrites], [1.0, 0.6], k=chance.randint(4, 14))
    ]
    setup = replace(COMPOSED, block_skip=chance.choice([None, True, False]))
    return Composition(own, dialect, machine, setup, replace(OPTIONS, strategy=strategy, flatten=flat), items)


def motions(source: bytes, made: Composition) -> tuple[Vector, NDArray[np.bool_], list[str]]:
    """What there is to say of the motions of a program: where they end, the circle, the tool, how fast; which pass; why
    some are refused."""
    names, rotary = made.machine.axis_names, rotary_names(made.machine)
    program = read(source, "part", made.dialect)
    moves = trace(program, made.setup, names, rotary, kinematics=kinematics_of(made.machine)).moves
    rows = np.flatnonzero(moves.kind != MotionKind.DWELL)
    columns = (moves.kind, *(moves.sweep * moves.normal.T), *moves.centre.T, moves.tool_length, speeds(moves))
    said = np.column_stack([ends(moves, made.machine), *(column[rows] for column in columns)])
    refused = sorted({moves.reasons[n] for n in moves.reason[rows[moves.rule[rows] == Rule.REFUSE]]})
    return said, moves.rule[rows] == Rule.PASS, refused


def speeds(moves: Moves) -> Vector:
    """The feed of each motion as a share of FEED; NaN where axes turn, or nothing moves."""
    linear = [moves.axes.index(letter) for letter in "XYZ"]
    ways = np.linalg.norm((moves.end - moves.start)[:, linear], axis=1)
    round_about = np.linalg.norm(np.cross(moves.start[:, linear] - moves.centre, moves.normal), axis=1)
    ways = np.where(moves.kind == MotionKind.ARC, round_about * np.abs(moves.sweep), ways)
    modes = [moves.feed_mode == mode for mode in (FeedMode.INVERSE_TIME, FeedMode.PER_REVOLUTION)]
    turns = (moves.end != moves.start)[:, moves.rotary].any(axis=1)
    known = (moves.kind != MotionKind.RAPID) & (moves.kind != MotionKind.CYCLE) & (ways > 0.1) & ~turns
    return np.where(known, moves.feed * np.select(modes, [ways, SPEED], 1.0) / FEED, np.nan)


def corrected(text: str, made: Composition) -> Corrected:
    """Correct a program, and follow it before and behind."""
    fixed = fix_flat if made.options.flatten else fix_program
    done = fixed(read(text.encode(), "part", made.dialect), made.machine, made.setup, made.options)
    (before, _, _), (after, passes, again) = (motions(each, made) for each in (text.encode(), done.text))
    refused = [f"{each.code} {each.reason}" for each in done.report.refused] or again
    return Corrected(done.text.decode(), before, after, passes, refused, done.report.passed_by_rule)


def difference(made: Composition, refusals: Sequence[str] = ()) -> str:
    """What a composition makes of its path that the plain program does not; empty if there is nothing.

    refusals  reasons, or parts of them, for which the composition may be refused
    """
    plain, wild = made.written(wild=False), made.written(wild=True)
    one, other = corrected(plain.text, made), corrected(wild.text, made)
    compared = slice(None, -1 if wild.metric else None)
    if one.before.shape != other.before.shape or far(*(each.before[:, compared] for each in (one, other))) > SAME:
        return "it is another path"
    why = [each for each in other.refused if not any(known in each for known in refusals)]
    if one.refused or why:
        return f"refused: {one.refused or why}"
    if other.refused:
        return ""
    kinds = {each.kind for each in made.items}
    if ("swivelled" not in kinds and one.passed != other.passed) or one.after.shape != other.after.shape:
        return f"{one.passed} passed, or {other.passed}"
    axes = len(made.machine.axis_names)
    if not (kinds & {"tilted", "swivelled"} and made.options.strategy == "full"):
        off = far(*(each.after[~other.passes, :axes] for each in (one, other)))
        if off > (ROUNDED_TURNED if made.options.strategy == "full" else ROUNDED):
            return f"corrected ends are {off * 1e3:.1f} um or mdeg apart"
    return "" if made.options.flatten else changed_beside(wild, other, made)


def changed_beside(wild: Author, done: Corrected, made: Composition) -> str:
    """What has changed besides the blocks that move, or changes with a remark in these; empty if nothing does."""
    kept = iter(done.text.splitlines())
    lost = [line for line in wild.text.splitlines() if line not in wild.moving and line not in kept]
    if lost:
        return f"changed: {lost}"
    remark = " " + wild.comment
    dressed = "".join(line + remark * (line in wild.moving) + "\n" for line in wild.text.splitlines())
    if corrected(dressed, made).text.replace(remark, "") != done.text:
        return "a remark changes it"
    return ""


def far(one: Vector, other: Vector) -> float:
    """How far two arrays are apart where both are known."""
    return float(np.nan_to_num(np.abs(one - other)).max(initial=0.0))


def shrunk(made: Composition, fails: Callable[[Composition], object]) -> Composition:
    """The composition without the items that it fails without."""
    for n in reversed(range(len(made.items))):
        less = made._replace(items=[*made.items[:n], *made.items[n + 1 :]])
        if fails(less):
            return shrunk(less, fails)
    return made
