"""Judges what became of each line of a short program by reading the result again.

The machine has a constant error, so a corrected block must end displaced by exactly that much, in whatever frame it is
written; a passed or refused block keeps its bytes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace

import numpy as np

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import Fixed, fix_program
from ncfix.compensate.following import follow
from ncfix.control.moves import MotionKind, Moves, Rule
from ncfix.control.setup import Setup, Tool
from ncfix.diagnostics import NcfixError, SourceError
from ncfix.machine import Machine, loads
from ncfix.text.dialect import Dialect, get
from ncfix.text.reader import read
from ncfix.text.stamp import find
from ncfix.values import frozen

SHIFT = {"X": -0.0124, "Y": 0.0213, "Z": 0.0085}
"""Correction, mm, added to commands: minus the errors of the machine."""
STEP = 0.0011
"""Tolerance, mm, of a corrected word: its last digit."""
CLOSE = 1e-4
"""Tolerance, mm and degrees, of a position stated in a test."""

AXIS = """
[axis.{0}]
type = "linear"
direction = [{1}]
range = [-5000, 5000]
[[effect]]
name = "E{0}{0}"
basis = "constant"
coefficients = [{2}]
"""
LINEAR = (("X", "1, 0, 0"), ("Y", "0, 1, 0"), ("Z", "0, 0, 1"))
OPTIONS = FixOptions(tolerance_um=60.0, figures=False)

SYSTEMS = ("G54", "G55", "G54.1P1", "G54.1P2", "G500", "preset")
SETUP = Setup(
    work_offsets={name: {"X": 10.0 * n, "Y": -5.0 * n, "Z": 3.0 * n} for n, name in enumerate(SYSTEMS)},
    tools={n: Tool(20.0 * n, 3.0) for n in range(10)},
    initial={"X": 0.0, "Y": 0.0, "Z": 200.0},
    references={"G28": {"X": 0.0, "Y": 0.0, "Z": 300.0}, "G30": {"X": 1.0, "Y": 1.0, "Z": 290.0}},
    no_point="calculator",
)


def shifted_machine(share: float = 1.0) -> Machine:
    """A machine with three axes, each with its share of the constant error."""
    text = 'name = "shifted"\ntopology = "w F X Y Z t"\n' + "".join(
        AXIS.format(axis, direction, -SHIFT[axis] * share) for axis, direction in LINEAR
    )
    return loads(text + "\n[tool]\ndirection = [0, 0, 1]\npoint = [0, 0, 0]\n")


def check_places(
    dialect: Dialect | str,
    program: str,
    places: Mapping[int, Mapping[str, float] | None],
    setup: Setup = SETUP,
    machine: Machine | None = None,
) -> None:
    """Raise AssertionError if a program is not followed as stated.

    places   line -> axis -> position after that line, in machine coordinates, mm and degrees; of a hole, at its bottom;
             under tool-centre-point control and in a tilted plane, X Y Z of the tip on the workpiece. None for a line
             whose motions are refused, or at which the program stops
    setup    as `Statements.setup`: G54 has no offset, and tool n is 20 n mm long
    machine  default: a machine with X, Y and Z
    """
    dialect = get(dialect) if isinstance(dialect, str) else dialect
    machine = shifted_machine() if machine is None else machine
    try:
        moves = follow(read(program.encode("latin-1"), "part", dialect), machine, setup).trace.moves
    except SourceError as error:
        place = error.messages[0].place
        if place is not None and places.get(place.line, {}) is None:
            return
        raise AssertionError(f"{dialect.name}: {error}") from error
    ends = np.where([axis.rotary for axis in machine.axes], np.degrees(moves.end), moves.end)
    for line, wanted in places.items():
        (rows,) = np.nonzero((moves.block == line - 1) & (moves.kind != MotionKind.DWELL))
        told = f"{dialect.name}: line {line}, {program.splitlines()[line - 1]!r}"
        assert rows.size, f"{told}: it has no motion"
        refused = bool((moves.rule[rows] == Rule.REFUSE).any())
        assert refused == (wanted is None), f"{told}: its motion is {'' if refused else 'not '}refused"
        found = dict(zip(machine.axis_names, ends[rows[-1]].tolist(), strict=True))
        for axis, value in (wanted or {}).items():
            assert abs(found[axis] - value) < CLOSE, f"{told}: {axis} stands at {found[axis]:.6g}, not at {value:g}"


@frozen
class Judged:
    """The fate of a program.

    lines    line -> "right", "passed", "refused", or what is wrong with it; only lines with motions
    stopped  line at which the program stops, with the message; None if it does not
    text     the corrected program
    places   line -> programmed end position, commands of all axes, mm and rad
    """

    lines: dict[int, str]
    stopped: tuple[int, str] | None = None
    text: str = ""
    places: Mapping[int, tuple[float, ...]] = field(default_factory=dict)

    @property
    def wrong(self) -> dict[int, str]:
        """Lines that are neither right, nor passed by a rule, nor refused."""
        return {line: what for line, what in self.lines.items() if what not in ("right", "passed", "refused")}


def judged(
    lines: Sequence[str], dialect: Dialect, machine: Machine, setup: Setup = SETUP, skipped: bool | None = None
) -> Judged:
    """Correct a program with one block per line and judge every line.

    skipped  position of block delete when the result is read; None: not given

    Raises every exception that has no code.
    """
    source = "".join(f"{line}\n" for line in lines).encode("latin-1")
    known = setup if skipped is None else replace(setup, block_skip=skipped)
    try:
        program = read(source, "part", dialect)
        before = follow(program, machine, known).trace.moves
        fixed = fix_program(program, machine, setup, OPTIONS)
    except NcfixError as error:
        place = error.messages[0].place
        return Judged({}, (place.line if place else 0, str(error.messages[0])))
    again = read(fixed.text, "part", dialect)
    after = follow(again, machine, known).trace.moves
    assert not fixed.changed or find(again) is not None, "a corrected program has no stamp"
    places = {int(block) + 1: tuple(end) for block, end in zip(before.block, before.end.tolist(), strict=True)}
    return Judged(_by_line(lines, fixed, before, after), None, fixed.text.decode("latin-1"), places)


def _by_line(lines: Sequence[str], fixed: Fixed, before: Moves, after: Moves) -> dict[int, str]:
    """Motion by motion: the tolerance is so wide that no motion is split, and inserted blocks have no motions."""
    new = fixed.text.decode("latin-1").splitlines()
    rows, others = (np.flatnonzero(moves.kind != MotionKind.DWELL) for moves in (before, after))
    if len(rows) != len(others):
        return {0: f"{len(rows)} motions became {len(others)}"}
    found, refused = {}, {each.line for each in fixed.report.refused}
    blocks = before.block[rows]
    for block in dict.fromkeys(blocks.tolist()):
        own = np.flatnonzero(blocks == block)
        end = after.end[others[own[-1]]] - before.end[rows[own[-1]]]
        off = np.abs(end - _shift(before, fixed, block))
        most = float(np.nanmax(off, initial=0.0))
        same = lines[block] == new[after.block[others[own[-1]]]]
        if block + 1 in refused:
            found[block + 1] = "refused" if same else "refused and changed"
        elif same and (before.rule[rows[own]] == Rule.PASS).all():
            found[block + 1] = "passed"
        elif most <= STEP:
            found[block + 1] = "right"
        else:
            found[block + 1] = f"off by {most:.4f} mm"
    return found


def _shift(moves: Moves, fixed: Fixed, block: int) -> np.typing.NDArray[np.float64]:
    """The expected displacement of a block's motions; NaN along axes that the report lists as left where they are."""
    line = block + 1
    left = {each.axis for each in fixed.report.left if any(low <= line <= high for low, high in each.stretches)}
    return np.array([np.nan if axis in left else SHIFT.get(axis, 0.0) for axis in moves.axes])
