"""A program followed on a machine, with workpiece and tool lengths, and whether it was corrected before.

A corrected program carries a stamp. If the stamp is gone, its numbers still show the correction: people and CAM systems
write round numbers, and a correction makes them crooked. If the coordinates of a program are crooked, and become round
when the errors of this machine are added to them, then the program was corrected for these errors. Correcting it again
would apply the correction twice, which leaves an error as large as the original one, and no later check would show it.
A number is round here if it lies within one least increment of a grid that is ten times coarser. In a program whose
numbers use all digits, by chance as many numbers become round as cease to be; such a program is not suspected.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ncfix.arrays import Array, Mask
from ncfix.compensate import FixOptions
from ncfix.compensate.plan.kinematics import commands_from_joints, joints_from_commands
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.control.coordinates import INCH
from ncfix.control.interpreter import FollowedLanguage
from ncfix.control.moves import Kinematics, Moves, Rule, TcpState, Trace
from ncfix.control.setup import PROBED, Run, Setup
from ncfix.control.trace import Follower, NotInPartsError, trace
from ncfix.diagnostics import Message, Place, RefusedError, UsageError
from ncfix.machine import Machine
from ncfix.text import stamp
from ncfix.text.dialect import Dialect, beginning_without_comments
from ncfix.text.language import Language, language_of
from ncfix.text.tree import Program
from ncfix.values import frozen
from ncfix.version import __version__

Resolve = Callable[[str], bytes | None]
FORCE = "correct the original program, or use --force if this is the original"


@frozen
class Followed:
    """A program followed on a machine.

    machine  the machine with the workpiece at its place
    trace    the motions, with every tool length known
    """

    machine: Machine
    trace: Trace


def follow(program: Program, machine: Machine, setup: Setup, resolve: Resolve | None = None) -> Followed:
    """Follow a program on a machine; `resolve` gives the text of a subprogram file by its name.

    Raises SourceError for a block that cannot be followed, and UsageError for a value that is used and not given
    (NCF431 for tool lengths, if the errors of the machine depend on them).
    """
    found = traced(program, machine, setup, resolve)
    return Followed(with_workpiece(machine, setup), with_tool_lengths(program, found, machine, setup))


def traced(program: Program, machine: Machine, setup: Setup, resolve: Resolve | None = None) -> Trace:
    """The motions of a program on a machine; tool lengths that are not given are NaN. Raises what `trace` raises."""
    names, rotary = machine.axis_names, rotary_names(machine)
    return trace(program, setup, names, rotary, resolve, kinematics=kinematics_of(machine))


@frozen
class Positions:
    """The kinematics of a machine, as the control's interpreter uses them (`Kinematics`)."""

    machine: Machine

    @property
    def travel(self) -> Sequence[tuple[float, float]]:
        """(low, high) end of travel of each axis, mm and rad."""
        return [(low, high) for low, high in self.machine.ranges.tolist()]

    def __call__(self, command: Sequence[float], before: TcpState, after: TcpState, /) -> Sequence[float]:
        """The command that, under state `after`, means the axis positions of `command` under state `before`.

        A state says whether tool-centre-point control (TCP) is on, and gives the tool length, mm.
        """
        row = np.array([command], dtype=np.float64)
        q = joints_from_commands(self.machine, row, np.array([before.on]), np.array([before.tool_length]))
        found = commands_from_joints(self.machine, q, np.array([after.on]), np.array([after.tool_length]))
        return found[0].tolist()


def kinematics_of(machine: Machine) -> Kinematics | None:
    """The kinematics of a machine; None without X, Y and Z."""
    return Positions(machine) if {"X", "Y", "Z"} <= set(machine.axis_names) else None


def with_workpiece(machine: Machine, setup: Setup) -> Machine:
    """The machine with the workpiece at the place, and under the conditions, that the setup gives."""
    x, y, z = (a + b for a, b in zip(machine.workpiece_offset, setup.workpiece_offset, strict=True))
    return machine.replace(workpiece_offset=(x, y, z), conditions=dict(setup.inputs))


INCHES = re.compile(rb"(?i)(?<![A-Z])G0*20(?![\d.])")


def resolving(machine: Machine, dialect: Dialect, source: bytes) -> Machine:
    """The machine with the least increment that its control has for this program.

    In a program in inches (G20), controls with decimal inches resolve 0.0001 inch where they resolve 0.001 mm.

    source  the text of the program, or its beginning
    """
    if not dialect.decimal_inches or INCHES.search(beginning_without_comments(source)) is None:
        return machine
    linear, rotary = machine.least_increment
    return machine.replace(least_increment=(linear * INCH / 10, rotary))


def rotary_names(machine: Machine) -> frozenset[str]:
    """The letters of the rotary axes."""
    return frozenset(axis.name for axis in machine.axes if axis.rotary)


def with_tool_lengths(program: Program, followed: Trace, machine: Machine, setup: Setup) -> Trace:
    """The trace with every tool length known.

    If the errors of the machine do not depend on the tool length, a length that is not given counts as zero. If they
    do, it must be given. Raises UsageError NCF431, which names every tool without a length, unless the setup assumes
    zero; and NCF446, which names every tool with a length below zero: that is not the length from gauge line to tip.
    """
    moves = followed.moves

    def told(code: str, first: Mapping[int, int], text: str, hint: str) -> list[Message]:
        return [
            Message(
                code,
                text.format(tool=tool, length=moves.tool_length[row]),
                program.place(int(moves.block[row])),
                hint.format(tool=tool),
            )
            for tool, row in first.items()
        ]

    if machine.depends_on_tool_length:
        below = _first_motions(moves, (moves.tool_length < 0) & (moves.rule == Rule.CORRECT))
        if below:
            text = "the length offset of tool {tool} is {length:g} mm: that is not the length of the tool"
            hint = "give its length from the gauge line to the tip, and lower the work offset by the difference"
            raise UsageError.collected(told("NCF446", below, text, hint))
    unknown = np.isnan(moves.tool_length)
    if not unknown.any():
        return followed
    known = replace(followed, moves=replace(moves, tool_length=np.where(unknown, 0.0, moves.tool_length)))
    unknown &= moves.rule == Rule.CORRECT
    if not machine.depends_on_tool_length or not unknown.any():
        return known
    first = _first_motions(moves, unknown)
    if not setup.assume_zero:
        text = "the length of tool {tool} is not given, but the errors of this machine depend on it"
        hint = (
            "--tool {tool}=LENGTH, or `{tool} = {{ length = ... }}` under [tools] in the setup file, or --assume-zero"
        )
        raise UsageError.collected(told("NCF431", first, text, hint))
    text = "the length of tool {tool} is not given; ncfix uses zero"
    notes = told("NCF437", first, text, "--tool {tool}=LENGTH")
    assumed = (*followed.assumed, *(f"length of tool {tool}" for tool in first))
    return replace(known, messages=(*followed.messages, *notes), assumed=assumed)


def _first_motions(moves: Moves, chosen: Mask) -> dict[int, int]:
    """Tool -> the first of the chosen motions (n,) made with it, in the order of the program."""
    rows = np.flatnonzero(chosen & (moves.tool >= 0))
    rows = rows[np.diff(moves.tool[rows], prepend=-1) != 0]
    found: dict[int, int] = {}
    for tool, row in zip(moves.tool[rows].tolist(), rows.tolist(), strict=True):
        found.setdefault(tool, row)
    return found


PART_BYTES = 1 << 20
"""Usual size of a part, bytes. Its columns take about forty times as much memory."""


@frozen
class Task:
    """The task of correcting one program, common to all of its parts.

    resolve  returns the text of a subprogram file by its name
    size     usual size of a part, bytes
    head     the first bytes of the text, from which its unit and dialect are told; empty: those of the first part
    """

    machine: Machine
    setup: Setup
    options: FixOptions
    resolve: Resolve | None
    path: str
    dialect: Dialect
    size: int = PART_BYTES
    head: bytes = b""

    def __post_init__(self) -> None:
        numbered = replace(self.dialect, block_numbers=self.options.block_numbers)
        object.__setattr__(self, "dialect", numbered)

    @property
    def step(self) -> float:
        """The least increment of the control for this program, mm."""
        return resolving(self.machine, self.dialect, self.head).least_increment[0]

    def follower(self) -> Follower:
        """A new follower for the program, at its beginning."""
        axes, rotary = self.machine.axis_names, rotary_names(self.machine)
        kinematics = kinematics_of(self.machine)
        return follower_of(self.dialect, Run(self.setup, axes, rotary, self.resolve, kinematics=kinematics))

    def check(self) -> None:
        """Raise `NotInPartsError` if strategy or options need the whole program at once."""
        strategy = get_strategy(self.options.strategy)
        if strategy.corrects_orientation or not strategy.follows_path or self.machine.is_perfect:
            raise NotInPartsError(f"the strategy {strategy.name} needs the whole path at once")
        if self.options.block_numbers == "renumber" and language_of(self.dialect, Language).renumber is not None:
            raise NotInPartsError("all blocks get new numbers")


def follower_of(dialect: Dialect, run: Run) -> Follower:
    """A follower that reads a program part by part."""
    language = language_of(dialect, FollowedLanguage)
    return Follower(language.control(run, dialect), run, partial(language.interpreter, in_parts=True))


COARSE = 10
"""Pitch of the grid of round numbers, in least increments of the control."""
NEAR = 1.0
"""Distance, in least increments, up to which a number lies on the grid. The two roundings involved, of the number and
of its correction, add up to less."""
ENOUGH = 30
"""Least number of different commands that have to become round."""
SURE = 6.0
"""Least excess of numbers that become round over those that cease to be, in standard deviations. By chance this is
exceeded in one program of 10^9."""
LOOKED = 10_000
"""Number of lines by which a program is judged. The first part of a pipe has more, so nothing is written before."""
MOVED = 0.75
"""Least correction, in least increments, of a number that is counted."""


Numbers = Mapping[int, tuple[Array, Array]]
"""Column of a linear axis -> its different commands (k,) and the corrections added to them (k,), mm."""


def numbers_of(moves: Moves, change: Array, among: Mask, step: float) -> Numbers:
    """The commands that move a linear axis and are corrected, of motions `among` (n,).

    change  (n, n_axes) the corrections added to the commands at their ends, mm and rad
    step    least increment of the control, mm
    """
    new = np.abs(moves.end - moves.start) > step / 2
    said = new & among[:, None] & (np.abs(change) > MOVED * step) & ~moves.rotary
    rows = ((axis, np.flatnonzero(each)) for axis, each in enumerate(said.T))
    return {axis: _different(moves.end[row, axis], change[row, axis], step) for axis, row in rows if len(row)}


def numbers_together(one: Numbers, other: Numbers, step: float) -> Numbers:
    """The different commands of both; of equal commands, the first."""
    both = {axis: np.hstack([each[axis] for each in (one, other) if axis in each]) for axis in {**one, **other}}
    return {axis: _different(values, change, step) for axis, (values, change) in both.items()}


def suspected(numbers: Numbers, step: float, path: str, force: bool, hint: str = FORCE) -> tuple[Message, ...]:
    """Raise RefusedError NCF438 if the program seems to have been corrected before; with `force`, only return it."""
    if not looks_corrected(numbers, step):
        return ()
    text = (
        "has probably been corrected already: its numbers become round when the errors of this machine are added to "
        "them"
    )
    message = Message("NCF438", text, Place(path), hint)
    if not force:
        raise RefusedError((message,))
    return (message,)


def looks_corrected(numbers: Numbers, step: float) -> bool:
    """Whether a program with these commands seems to have been corrected before, for this machine.

    step  least increment of the control, mm
    """
    gained, lost = 0, 0
    for before, change in numbers.values():
        crooked, straightened = ~_round(before, step), _round(before - change, step)
        gained += int((straightened & crooked).sum())
        lost += int((~straightened & ~crooked).sum())
    return gained >= ENOUGH and gained - lost > SURE * math.sqrt(gained + lost)


def _different(values: Array, change: Array, step: float) -> tuple[Array, Array]:
    steps = np.rint(values / step)
    order = np.argsort(steps, kind="stable")
    first = order[np.diff(steps[order], prepend=-np.inf) != 0]
    return values[first], change[first]


def _round(values: Array, step: float) -> Mask:
    """(k,) which values are near a grid of round numbers, the offset of which is fitted to the values."""
    grid = COARSE * step
    phase = np.exp(2j * np.pi * values / grid)
    start = np.angle(phase.mean()) / (2 * np.pi) * grid
    return np.abs((values - start + grid / 2) % grid - grid / 2) <= NEAR * step


def refuse_stamped(program: Program, options: FixOptions) -> None:
    """Raise RefusedError NCF430 if the program carries a stamp, unless the options say `force`."""
    block = stamp.find(program)
    if block is not None and not options.force:
        text = "the program has been corrected already; a second correction would make the part wrong"
        raise RefusedError.of("NCF430", text, program.place(block), "correct the original program, or use --force")


SHORT_LINE = 250
"""Number of characters that a line may have on any control."""


def stamp_of(
    program: Program, machine: Machine, options: FixOptions, block_delete: str = "", assumed: tuple[str, ...] = ()
) -> str:
    """The text of the stamp of a corrected program.

    block_delete  the positions of the switches for which it is right, in words; empty without skippable blocks
    assumed       names of the values that were taken as zero
    """
    words = (
        f"ncfix {__version__} machine {machine.hash} strategy {options.strategy} tolerance {options.tolerance_um:g} um"
    )
    if block_delete:
        words += f", {block_delete}"
    if PROBED in assumed:
        words += ", nominal probing"
    if zeros := [each for each in assumed if each != PROBED]:
        words += f", assumed zero: {', '.join(zeros)}"
    return words[: min(program.dialect.line_limit or SHORT_LINE, SHORT_LINE) - 10]
