"""A program followed on a certain machine, and whether it was corrected before.

It is followed with the workpiece where the setup has it, and with every tool length.

A program that was corrected carries a stamp. If that is gone, its numbers still tell: people and CAM systems write
round numbers; a correction makes them crooked. If a program's coordinates are crooked, and become round when the errors
of the machine are put into them, then it was written for these errors. Correcting it again would put the errors back
in, the other way round, as large as they were, and nothing later on would show it. A number is round here if it lies
within one step of the control's digits of a grid that is ten times coarser. Of numbers with all digits used as many
become round as cease to be, by chance; nothing is said of them.
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
FORCE = "fix the original program, or say --force if this is it"


@frozen
class Followed:
    """What the machine does with a program.

    machine  the machine with the workpiece in its place
    trace    the motions, with every tool length known
    """

    machine: Machine
    trace: Trace


def follow(program: Program, machine: Machine, setup: Setup, resolve: Resolve | None = None) -> Followed:
    """Follow a program on a machine; `resolve` gives the text of a subprogram file by its name.

    Raises SourceError for what cannot be followed, UsageError for what is used and not given: NCF431 for the lengths of
    tools, where the errors of the machine depend on them.
    """
    found = traced(program, machine, setup, resolve)
    return Followed(with_workpiece(machine, setup), with_tool_lengths(program, found, machine, setup))


def traced(program: Program, machine: Machine, setup: Setup, resolve: Resolve | None = None) -> Trace:
    """The motions of a program on a machine; tool lengths that are not given are NaN. Raises what `trace` raises."""
    names, rotary = machine.axis_names, rotary_names(machine)
    return trace(program, setup, names, rotary, resolve, kinematics=kinematics_of(machine))


@frozen
class Positions:
    """What a machine's kinematics say about positions of its axes."""

    machine: Machine

    @property
    def travel(self) -> Sequence[tuple[float, float]]:
        """How far each axis goes, mm and rad."""
        return [(low, high) for low, high in self.machine.ranges.tolist()]

    def __call__(self, command: Sequence[float], before: TcpState, after: TcpState, /) -> Sequence[float]:
        """A command as it is with tool-centre-point control or without, said as it is under another state."""
        row = np.array([command], dtype=np.float64)
        q = joints_from_commands(self.machine, row, np.array([before.on]), np.array([before.tool_length]))
        found = commands_from_joints(self.machine, q, np.array([after.on]), np.array([after.tool_length]))
        return found[0].tolist()


def kinematics_of(machine: Machine) -> Kinematics | None:
    """The kinematics of a machine; None without X, Y and Z."""
    return Positions(machine) if {"X", "Y", "Z"} <= set(machine.axis_names) else None


def with_workpiece(machine: Machine, setup: Setup) -> Machine:
    """The machine with the workpiece where the setup has it, under the conditions that the setup gives."""
    x, y, z = (a + b for a, b in zip(machine.workpiece_offset, setup.workpiece_offset, strict=True))
    return machine.replace(workpiece_offset=(x, y, z), conditions=dict(setup.inputs))


INCHES = re.compile(rb"(?i)(?<![A-Z])G0*20(?![\d.])")


def resolving(machine: Machine, dialect: Dialect, source: bytes) -> Machine:
    """The machine with what its control resolves in a program in inches, where that is a decimal fraction of an inch.

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

    Where the errors do not depend on it, a length that is not given counts as zero; where they do, it must be given:
    raises UsageError NCF431 naming every tool that lacks it, unless the setup assumes zero, and NCF446 naming every
    tool with a length below zero, which is a distance of another kind.
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
            text = "the length offset of tool {tool} is {length:g} mm: that does not say how long the tool is"
            hint = "give its length from the gauge line to the tip, and the work offset lower by the difference"
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
        text = "the length of tool {tool} is needed and not given: the errors of this machine depend on it"
        hint = (
            "--tool {tool}=LENGTH, or `{tool} = {{ length = ... }}` under [tools] in the setup file, or --assume-zero"
        )
        raise UsageError.collected(told("NCF431", first, text, hint))
    text = "the length of tool {tool} is not given and was taken as zero"
    notes = told("NCF437", first, text, "--tool {tool}=LENGTH")
    assumed = (*followed.assumed, *(f"length of tool {tool}" for tool in first))
    return replace(known, messages=(*followed.messages, *notes), assumed=assumed)


def _first_motions(moves: Moves, chosen: Mask) -> dict[int, int]:
    """Tool -> the first of the chosen motions (n,) that is made with it, in the order of the program."""
    rows = np.flatnonzero(chosen & (moves.tool >= 0))
    rows = rows[np.diff(moves.tool[rows], prepend=-1) != 0]
    found: dict[int, int] = {}
    for tool, row in zip(moves.tool[rows].tolist(), rows.tolist(), strict=True):
        found.setdefault(tool, row)
    return found


PART_BYTES = 1 << 20
"""How much text is a part: its columns take about forty times as much memory, and stay in the processor's cache."""


@frozen
class Task:
    """What all parts of a program have in common.

    resolve  gives the text of a subprogram file by its name
    size     bytes of a part
    head     the first bytes of the text, by which it is told what it is; those of the first part, if not given
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
        """What the control resolves, mm."""
        return resolving(self.machine, self.dialect, self.head).least_increment[0]

    def follower(self) -> Follower:
        """What follows the program."""
        axes, rotary = self.machine.axis_names, rotary_names(self.machine)
        kinematics = kinematics_of(self.machine)
        return follower_of(self.dialect, Run(self.setup, axes, rotary, self.resolve, kinematics=kinematics))

    def check(self) -> None:
        """Raise `NotInPartsError` for what has to be looked at as a whole."""
        strategy = get_strategy(self.options.strategy)
        if strategy.corrects_orientation or not strategy.follows_path or self.machine.is_perfect:
            raise NotInPartsError(f"the strategy {strategy.name} looks at the whole path at once")
        if self.options.block_numbers == "renumber" and language_of(self.dialect, Language).renumber is not None:
            raise NotInPartsError("all blocks get new numbers")


def follower_of(dialect: Dialect, run: Run) -> Follower:
    """What follows a program part by part."""
    language = language_of(dialect, FollowedLanguage)
    return Follower(language.control(run, dialect), run, partial(language.interpreter, in_parts=True))


COARSE = 10
"""Steps of the grid of round numbers, in steps of the control's digits."""
NEAR = 1.0
"""Steps within which a number is on the grid; two roundings, of the number and of its correction, are less."""
ENOUGH = 30
"""Different numbers that have to become round."""
SURE = 6.0
"""Standard deviations by which more have to become round than cease to be; by chance, one program in 10^9."""
LOOKED = 10_000
"""Lines of a program that are looked at: parts of the usual size have more, so that nothing is in a pipe by then."""
MOVED = 0.75
"""Steps by which a number has to be corrected to say anything."""


Numbers = Mapping[int, tuple[Array, Array]]
"""Of each linear axis, by its column: the different commands (k,), and what is added to them (k,), mm."""


def numbers_of(moves: Moves, change: Array, among: Mask, step: float) -> Numbers:
    """The commands that change their axis and are corrected, of motions `among` (n,).

    change  (n, n_axes) what is added to the commands at their ends, mm and rad
    step    of the control's digits, mm
    """
    new = np.abs(moves.end - moves.start) > step / 2
    said = new & among[:, None] & (np.abs(change) > MOVED * step) & ~moves.rotary
    rows = ((axis, np.flatnonzero(each)) for axis, each in enumerate(said.T))
    return {axis: _different(moves.end[row, axis], change[row, axis], step) for axis, row in rows if len(row)}


def numbers_together(one: Numbers, other: Numbers, step: float) -> Numbers:
    """The different numbers of both; of equal ones those that come first."""
    both = {axis: np.hstack([each[axis] for each in (one, other) if axis in each]) for axis in {**one, **other}}
    return {axis: _different(values, change, step) for axis, (values, change) in both.items()}


def suspected(numbers: Numbers, step: float, path: str, force: bool, hint: str = FORCE) -> tuple[Message, ...]:
    """Raise RefusedError NCF438 for a program that seems to have been corrected before; with `force`, only say so."""
    if not looks_corrected(numbers, step):
        return ()
    text = "seems to have been corrected already: with this machine's errors put in, its numbers become round"
    message = Message("NCF438", text, Place(path), hint)
    if not force:
        raise RefusedError((message,))
    return (message,)


def looks_corrected(numbers: Numbers, step: float) -> bool:
    """Whether the program with these numbers seems to have been corrected before, for this machine.

    step  of the control's digits, mm
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
    """Which of the values are near a grid of round numbers, wherever it begins: where most of these are."""
    grid = COARSE * step
    phase = np.exp(2j * np.pi * values / grid)
    start = np.angle(phase.mean()) / (2 * np.pi) * grid
    return np.abs((values - start + grid / 2) % grid - grid / 2) <= NEAR * step


def refuse_stamped(program: Program, options: FixOptions) -> None:
    """Raise RefusedError NCF430 for a program that carries a stamp, unless that is what the options want."""
    block = stamp.find(program)
    if block is not None and not options.force:
        text = "the program has been corrected already; correcting it again would put the error back in"
        raise RefusedError.of("NCF430", text, program.place(block), "fix the original program, or say --force")


SHORT_LINE = 250
"""Characters that a line may have on any control."""


def stamp_of(
    program: Program, machine: Machine, options: FixOptions, block_delete: str = "", assumed: tuple[str, ...] = ()
) -> str:
    """The text of the stamp that a corrected program gets.

    block_delete  for which positions of its switches, in words; empty without
    assumed       names what was taken as zero
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
