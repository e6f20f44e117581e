"""Preview of a correction, before anything is written: changed lines of text, and changed motions with their reasons.

The text is a unified diff, in which the old and the new form of a line stand together. For each motion, the commands of
the axes at its end are given before and after, with the errors of the machine that move the tool tip most there.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ncfix.arrays import Array, Index, picked
from ncfix.compensate.driver import Fixed, fix_flat, fix_program
from ncfix.compensate.following import with_workpiece
from ncfix.compensate.plan.kinematics import reached_joints, signs
from ncfix.machine import Machine, State
from ncfix.text.writer import Edit, Splices, spliced
from ncfix.values import frozen

if TYPE_CHECKING:
    from ncfix.compensate import FixOptions
    from ncfix.compensate.following import Resolve
    from ncfix.control.moves import Moves
    from ncfix.control.setup import Setup
    from ncfix.text.tree import Program

CONTEXT = 3
"""Number of unchanged lines before and after a change in a diff."""
MOST_NAMED = 3
"""Largest number of errors that are named as reasons of a correction."""
LEAST_SHARE = 0.05
"""Least effect of an error that is named, as a part of that of the largest error."""


@frozen
class MotionChange:
    """The command of an axis at the end of a motion, before and after.

    line           line of the program
    before, after  mm, or degrees of a rotary axis, in machine coordinates; under tool-centre-point control X Y Z of
                   the tip
    change         um, or thousandths of a degree
    pieces         number of blocks into which the motion is split
    why            name of an error -> motion of the tip by it there, um; the largest ones
    """

    line: int
    axis: str
    rotary: bool
    before: float
    after: float
    change: float
    pieces: int
    why: Mapping[str, float]

    @property
    def reason(self) -> str:
        """The reasons in words."""
        named = ", ".join(f"{name} {size:.1f} um" for name, size in self.why.items())
        return f"{named}; in {self.pieces} pieces" if self.pieces > 1 else named


@frozen
class Changes:
    """The changes that a correction makes.

    fixed    the corrected program
    machine  the machine with the workpiece at its place
    """

    fixed: Fixed
    machine: Machine

    @classmethod
    def of(
        cls, program: Program, machine: Machine, setup: Setup, options: FixOptions, resolve: Resolve | None
    ) -> Changes:
        """Correct a program; raises what `fix_program`, or with `flatten` `fix_flat`, raises."""
        fix = fix_flat if options.flatten else fix_program
        fixed = fix(program, machine, setup, options, resolve)
        return cls(fixed, machine if fixed.made is None else with_workpiece(machine, setup))

    def unified(self, original: bytes, before: str, after: str) -> Iterator[bytes]:
        """The lines of a unified diff from the original text to the corrected one; none if nothing changes."""
        text, made = self.fixed.text, self.fixed.made
        if made is None or text == original:
            return
        yield from (f"--- {before}\n".encode(), f"+++ {after}\n".encode())
        old = original.splitlines(keepends=True)
        if original == made.program.source and spliced(original, made.edits) == text:
            yield from _hunks(old, list(_replaced(original, made.edits)))
        else:  # written out flat, or numbered anew
            found = difflib.diff_bytes(
                difflib.unified_diff, old, text.splitlines(keepends=True), n=CONTEXT, lineterm=b"\n"
            )
            yield from (_ended(line) for number, line in enumerate(found) if number > 1)

    def motions(self) -> Iterator[MotionChange]:
        """The commands that change, by motion and axis."""
        made = self.fixed.made
        if made is None:
            return
        plan, moves = made.plan, made.plan.moves
        steps = np.where(moves.rotary, self.machine.least_increment[1], self.machine.least_increment[0])
        changed = (np.abs(plan.shift) > steps / 2) & ~plan.unchanged[:, None]
        rows = np.flatnonzero(changed.any(axis=1))
        pieces = np.bincount(plan.plan.pieces.move, minlength=len(moves))
        lines, shift = made.program.lines(moves.block), plan.shift
        why = self._reasons(moves, rows)
        scale = np.where(moves.rotary, np.degrees(1.0), 1.0)
        for at, row in enumerate(rows.tolist()):
            for axis in np.flatnonzero(changed[row]).tolist():
                before = float(moves.end[row, axis] * scale[axis])
                way = float(shift[row, axis] * scale[axis])
                found = (moves.axes[axis], bool(moves.rotary[axis]), before, before + way, 1e3 * way)
                yield MotionChange(int(lines[row]), *found, int(pieces[row]), why[at])

    def _reasons(self, moves: Moves, rows: Index) -> Sequence[Mapping[str, float]]:
        """For each of motions `rows` (k,): name of an effect -> tip error by it at the end, um; the largest ones."""
        length = np.nan_to_num(picked(moves.tool_length, rows))
        q, _ = reached_joints(self.machine, picked(moves.end, rows), moves.tcp[rows], length)
        state = State(length, signs(picked(moves.end - moves.start, rows)))
        names = dict.fromkeys(effect.name for effect in self.machine.effects if effect.active)
        tip = self.machine.tip(q, length)
        sizes = np.zeros((len(rows), len(names)))
        for column, name in enumerate(names):
            own = tuple(effect for effect in self.machine.effects if effect.active and effect.name == name)
            gap: Array = self.machine.replace(effects=own).actual_tip(q, state) - tip
            sizes[:, column] = 1e3 * np.linalg.norm(np.nan_to_num(gap), axis=1)
        order = np.argsort(-sizes, axis=1, kind="stable")[:, :MOST_NAMED]
        known = list(names)
        return [
            {known[k]: float(each[k]) for k in best if each[k] > max(LEAST_SHARE * each[best[0]], 1e-3)}
            for each, best in zip(sizes, order.tolist(), strict=True)
        ]


def as_plain(changes: Sequence[MotionChange]) -> list[dict[str, Any]]:
    """Changes as plain data, for JSON: mm and um, or degrees and thousandths of a degree."""
    return [
        {
            "line": each.line,
            "axis": each.axis,
            "from": round(each.before, 6),
            "to": round(each.after, 6),
            "mdeg" if each.rotary else "um": round(each.change, 3),
            "pieces": each.pieces,
            "why": {name: round(size, 3) for name, size in each.why.items()},
        }
        for each in changes
    ]


def _replaced(source: bytes, edits: Splices) -> Iterator[tuple[int, int, list[bytes]]]:
    """(first, stop, new lines) of each stretch of changed lines; lines are counted from 0, `stop` is excluded."""
    lines = source.splitlines(keepends=True)
    begins = np.append(0, np.cumsum([len(line) for line in lines]))
    found: list[tuple[int, int, list[Edit]]] = []
    for edit in edits.edits():
        first = min(int(np.searchsorted(begins, edit.start, side="right")) - 1, len(lines) - 1)
        last = max(int(np.searchsorted(begins, edit.stop, side="left")), first + 1)
        if found and first < found[-1][1]:
            found[-1] = (found[-1][0], max(last, found[-1][1]), [*found[-1][2], edit])
        else:
            found.append((first, last, [edit]))
    for first, last, own in found:
        at, stop = int(begins[first]), int(begins[last])
        moved = Splices.of([replace(edit, start=edit.start - at, stop=edit.stop - at) for edit in own])
        new = spliced(source[at:stop], moved).splitlines(keepends=True)
        while first < last and new and lines[first] == new[0]:
            first, new = first + 1, new[1:]
        while first < last and new and lines[last - 1] == new[-1]:
            last, new = last - 1, new[:-1]
        if first < last or new:
            yield first, last, new


def _hunks(lines: Sequence[bytes], changes: Sequence[tuple[int, int, list[bytes]]]) -> Iterator[bytes]:
    together: list[list[tuple[int, int, list[bytes]]]] = []
    for change in changes:
        if together and change[0] - together[-1][-1][1] <= 2 * CONTEXT:
            together[-1].append(change)
        else:
            together.append([change])
    moved = 0
    for hunk in together:
        begin, end = max(hunk[0][0] - CONTEXT, 0), min(hunk[-1][1] + CONTEXT, len(lines))
        grown = sum(len(new) - (last - first) for first, last, new in hunk)
        sizes = (end - begin, end - begin + grown)
        old, new = (at + (size > 0) for at, size in zip((begin, begin + moved), sizes, strict=True))
        yield f"@@ -{old},{sizes[0]} +{new},{sizes[1]} @@\n".encode()
        at = begin
        for first, last, instead in hunk:
            yield from (_ended(b" " + line) for line in lines[at:first])
            yield from (_ended(b"-" + line) for line in lines[first:last])
            yield from (_ended(b"+" + line) for line in instead)
            at = last
        yield from (_ended(b" " + line) for line in lines[at:end])
        moved += grown


def _ended(line: bytes) -> bytes:
    return line if line.endswith(b"\n") else line + b"\n\\ No newline at end of file\n"
