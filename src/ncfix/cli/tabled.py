"""A program run with tables active: one figure for tables and for rewritten programs."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from ncfix.cli.following import Following, figures
from ncfix.cli.options import subprograms
from ncfix.cli.targets import shown
from ncfix.diagnostics import Message, Place, RefusedError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    import numpy as np
    from numpy.typing import NDArray

    from ncfix.compensate.fix import Fixed
    from ncfix.compensate.following import Followed
    from ncfix.tables.compensation import Tables
    from ncfix.tables.control import Control
    from ncfix.text.tree import Program


SAME = 0.5
"""mm: tools whose lengths differ by less are the same to tables."""
INSTEAD = "give the original program, or run this one without tables"
MANY = 4
"""Lengths that are listed."""


def along(
    following: Following,
    control: Control,
    tables: Tables,
    settings: Mapping[str, str],
    path: str,
    tool_length: float,
) -> dict[str, Any]:
    """What a control with these tables leaves along a program: `{path, error_before_um, error_after_um, remarks}`.

    Both are looked at where the tool cuts; rewritten programs have the figures of `fix` after, which looks at the ends
    of rapids too. It is remarked on if the program's tools are not of the length that the tables hold for, mm.

    Raises `RefusedError` for a program that would be corrected twice: NCF493 if it carries a stamp of ncfix, NCF438 if
    its numbers show it.
    """
    from ncfix.compensate.figures.simulation import Along, seems_corrected, tip_errors, tip_with
    from ncfix.compensate.plan.intent import Intent
    from ncfix.machine import State

    program, followed = _followed(following, path)
    names, machine, moves = followed.machine.axis_names, followed.machine, followed.trace.moves
    intent, lines = Intent(machine, moves, State()), program.lines(moves.block)
    before = figures(Along.of(tip_errors(intent, lines)))
    if control.rewrites:
        after = rewritten(following, settings, path).report.as_dict()["error_after_um"] or before
    else:
        if seems_corrected(machine, moves):
            text = "seems to have been corrected already: with this machine's errors put in, its numbers become round"
            raise RefusedError.of("NCF438", text, Place(shown(path)), INSTEAD)
        made = tip_with(lambda q, way, length: tables.for_tool(length).at(names, q, way))
        after = figures(Along.of(tip_errors(intent, lines, made=made)))
    fixed_length = not (control.any_tool or control.rewrites) and machine.depends_on_tool_length
    remarks = list(_other_tools(moves.tool_length, tool_length)) if fixed_length else []
    return {"path": shown(path), "error_before_um": before, "error_after_um": after, "remarks": remarks}


def _other_tools(used: NDArray[np.float64], length: float) -> Iterator[str]:
    import numpy as np

    others = sorted({float(round(each, 3)) for each in used[np.isfinite(used)] if abs(each - length) > SAME})
    if others:
        listed = ", ".join(f"{each:g}" for each in others[:MANY]) + (" ..." if len(others) > MANY else "")
        yield f"The tables hold for a tool of {length:g} mm; this program also runs with {listed} mm."


def rewritten(following: Following, settings: Mapping[str, str], path: str) -> Fixed:
    """The program as `ncfix fix` rewrites it under these settings of the control."""
    from ncfix.compensate.fix import FixOptions, fix_program

    assert following.machine is not None
    options = FixOptions(strategy=settings["strategy"], tolerance_um=float(settings["tolerance_um"]))
    find = subprograms(following.setup, path)
    return fix_program(following.read(path), following.machine, following.setup, options, find)


def rewritten_file(following: Following, settings: Mapping[str, str], path: str) -> dict[str, bytes]:
    """Its file; raises `RefusedError` with what could not be corrected, if anything could not."""
    fixed = rewritten(following, settings, path)
    refused = [Message(each.code, each.reason, Place(shown(path), each.line)) for each in fixed.report.refused]
    if refused:
        raise RefusedError.collected(refused)
    return {os.path.basename(path): fixed.text}


def _followed(following: Following, path: str) -> tuple[Program, Followed]:
    from ncfix.compensate.following import follow
    from ncfix.text import stamp

    assert following.machine is not None
    program = following.read(path)
    block = stamp.find(program)
    if block is not None:
        text = "the program has been corrected already: with tables of the same errors it would be corrected twice"
        place = program.place(block)
        raise RefusedError.of("NCF493", text, place, INSTEAD)
    return program, follow(program, following.machine, following.setup, subprograms(following.setup, path))
