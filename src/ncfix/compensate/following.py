"""A program followed on a certain machine: with the workpiece where the setup has it, and with every tool length."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ncfix.compensate.plan.kinematics import commands_from_joints, joints_from_commands
from ncfix.control.moves import Kinematics, Moves, Rule, TcpState, Trace
from ncfix.control.setup import Setup
from ncfix.control.trace import trace
from ncfix.diagnostics import Message, UsageError
from ncfix.machine import Machine
from ncfix.text.tree import Program

Resolve = Callable[[str], bytes | None]


@dataclass(frozen=True, slots=True)
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
    return Followed(placed(machine, setup), with_tool_lengths(program, found, machine, setup))


def traced(program: Program, machine: Machine, setup: Setup, resolve: Resolve | None = None) -> Trace:
    """The motions of a program on a machine; tool lengths that are not given are NaN. Raises what `trace` raises."""
    names, rotary = machine.axis_names, rotary_names(machine)
    return trace(program, setup, names, rotary, resolve, kinematics=kinematics_of(machine))


@dataclass(frozen=True, slots=True)
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
        result: list[float] = found[0].tolist()
        return result


def kinematics_of(machine: Machine) -> Kinematics | None:
    """The kinematics of a machine; None without X, Y and Z."""
    return Positions(machine) if {"X", "Y", "Z"} <= set(machine.axis_names) else None


def placed(machine: Machine, setup: Setup) -> Machine:
    """The machine with the workpiece where the setup has it, under the conditions that the setup gives."""
    x, y, z = (a + b for a, b in zip(machine.workpiece_offset, setup.workpiece_offset, strict=True))
    return machine.replace(workpiece_offset=(x, y, z), conditions=dict(setup.inputs))


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
    if machine.depends_on_tool_length:
        _require_lengths(program, moves)
    unknown = np.isnan(moves.tool_length)
    if not unknown.any():
        return followed
    known = replace(followed, moves=replace(moves, tool_length=np.where(unknown, 0.0, moves.tool_length)))
    unknown &= moves.rule == Rule.CORRECT
    if not machine.depends_on_tool_length or not unknown.any():
        return known
    first = _first_motions(moves, unknown)
    if not setup.assume_zero:
        raise UsageError.collected(_tool_needed(program, moves, tool, row) for tool, row in first.items())
    notes = [_tool_assumed(program, moves, tool, row) for tool, row in first.items()]
    assumed = (*followed.assumed, *(f"length of tool {tool}" for tool in first))
    return replace(known, messages=(*followed.messages, *notes), assumed=assumed)


def _first_motions(moves: Moves, chosen: NDArray[np.bool_]) -> dict[int, int]:
    """Tool -> the first of the chosen motions (n,) that is made with it, in the order of the program."""
    if not chosen.any():
        return {}
    tools, rows = np.unique(np.where(chosen, moves.tool, -1), return_index=True)
    return {int(tools[each]): int(rows[each]) for each in np.argsort(rows) if tools[each] >= 0}


def _require_lengths(program: Program, moves: Moves) -> None:
    """Raises UsageError NCF446: a length offset below zero does not say how long the tool is."""
    below = _first_motions(moves, (moves.tool_length < 0) & (moves.rule == Rule.CORRECT))
    if below:
        raise UsageError.collected(_no_length(program, moves, tool, row) for tool, row in below.items())


def _no_length(program: Program, moves: Moves, tool: int, row: int) -> Message:
    text = f"the length offset of tool {tool} is {moves.tool_length[row]:g} mm: that does not say how long the tool is"
    hint = "give its length from the gauge line to the tip, and the work offset lower by the difference"
    return Message("NCF446", text, program.place(int(moves.block[row])), hint)


def _tool_needed(program: Program, moves: Moves, tool: int, row: int) -> Message:
    text = f"the length of tool {tool} is needed and not given: the errors of this machine depend on it"
    hint = f"--tool {tool}=LENGTH, or `{tool} = {{ length = ... }}` under [tools] in the setup file, or --assume-zero"
    return Message("NCF431", text, program.place(int(moves.block[row])), hint)


def _tool_assumed(program: Program, moves: Moves, tool: int, row: int) -> Message:
    text = f"the length of tool {tool} is not given and was taken as zero"
    return Message("NCF437", text, program.place(int(moves.block[row])), f"--tool {tool}=LENGTH")
