"""The corrected ends of motions, in bulk, with what cannot be corrected and why."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ncfix.compensate import arcs
from ncfix.compensate.held import with_rotary_held
from ncfix.compensate.plan.arrays import Array, Index, Mask, chosen, every, finite, picked, put, slices
from ncfix.compensate.plan.findings import Finding
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.kinematics import Correction, commands_from_joints
from ncfix.compensate.plan.strategies import Path, Strategy
from ncfix.compensate.standing import standing
from ncfix.machine import Machine

BATCH = 32_768
"""Ends corrected at a time."""


@dataclass(frozen=True, slots=True)
class Ends:
    """Where motions shall end.

    wanted    (n, n_axes) commands; those of the program where nothing is corrected
    failed    (n,) motions that should be corrected and cannot
    oriented  (n,) the tool direction is corrected too, without damping or limits
    findings  why they cannot
    before    (n,) mm: how far the tip is off without a correction; NaN where that is not known
    """

    wanted: Array
    failed: Mask
    oriented: Mask
    findings: tuple[Finding, ...]
    before: Array


def corrected(intent: Intent, strategy: Strategy, rows: Index) -> Ends:
    """Correct the ends of motions `rows`."""
    moves = intent.moves
    ones = np.ones(len(rows))
    q = intent.joints_at(rows, ones)
    lengths = np.broadcast_to(intent.lengths(rows), len(rows))
    named = finite(picked(moves.end, rows))
    fit = finite(q) & np.isfinite(lengths)
    good, q = rows[fit], chosen(q, fit)
    result = _solved(intent, strategy, good, q)
    wanted = moves.end.copy()
    put(wanted, good, as_commands(intent, good, picked(moves.end, good), q, result.q))
    failed, oriented = np.zeros(len(moves), dtype=bool), np.zeros(len(moves), dtype=bool)
    failed[rows[~fit]] = failed[good[~result.converged]] = True
    oriented[good] = result.oriented
    before = np.full(len(moves), np.nan)
    if result.before is not None:
        before[good[result.converged]] = result.before[result.converged]
    wanted[failed] = moves.end[failed]
    troubles = (
        _finding("NCF408", rows[~named], "the end of this motion is not known in all axes"),
        _finding("NCF414", rows[named & ~np.isfinite(lengths)], "the length of the tool is not known here"),
        _finding(
            "NCF402",
            rows[named & np.isfinite(lengths) & ~fit],
            "the linear axes cannot bring the tool tip there with the rotary axes where they are",
        ),
        _finding("NCF403", good[~result.converged], "no command found that brings the tool tip where it should be"),
    )
    return Ends(wanted, failed, oriented, tuple(trouble for trouble in troubles if len(trouble)), before)


def with_rotary_as_it_stands(intent: Intent, ends: Ends, kept: Mask) -> Ends:
    """The ends with X Y Z for rotary axes that get no word, where corrections before have left these."""
    if intent.wordless is None:
        return ends
    stands = standing(intent.machine, intent.moves, ends.wanted, kept, intent.before).end
    off = intent.wordless & intent.machine.rotary & (stands != ends.wanted) & ~kept[:, None]
    rows = np.flatnonzero(off.any(axis=1))
    if not rows.size:
        return ends
    commands = np.where(off[rows], stands[rows], ends.wanted[rows])
    found, arrived = intent.aimed(rows, np.ones(len(rows)), commands)
    wanted = ends.wanted.copy()
    wanted[rows[arrived]] = found[arrived]
    return replace(ends, wanted=wanted)


def _solved(intent: Intent, strategy: Strategy, rows: Index, q: Array) -> Correction:
    """The correction of ends q (k, n_axes) of motions; where one depends on others, of all of them at once."""
    ones = np.ones(len(rows))
    if strategy.corrects_orientation:
        found = strategy.solve(intent.machine, q, intent.states(rows, ones), along(intent, rows, ones))
        return with_rotary_held(intent, strategy, rows, ones, q, found)
    if not strategy.follows_path:
        return strategy.solve(intent.machine, q, intent.states(rows, ones))
    parts = []
    for part in slices(len(rows), BATCH):
        parts.append(strategy.solve(intent.machine, q[part], intent.states(rows[part], ones[part])))
    if len(parts) == 1:
        return parts[0]
    before = [part.before for part in parts if part.before is not None]
    return Correction(
        np.concatenate([part.q for part in parts]),
        np.concatenate([part.converged for part in parts]),
        np.concatenate([part.oriented for part in parts]),
        np.concatenate(before) if len(before) == len(parts) else None,
    )


def as_commands(intent: Intent, rows: Index, programmed: Array, nominal: Array, corrected: Array) -> Array:
    """Commands of corrected axis positions (k, n_axes); where nothing is corrected exactly those of the program.

    programmed  (k, n_axes) commands of the program
    nominal     (k, n_axes) axis positions of the program
    """
    tcp, lengths = intent.moves.tcp[rows], intent.moves.tool_length[rows]
    if not tcp.any():
        return corrected
    return led_as_commands(intent.machine, programmed, (nominal, corrected), tcp, lengths)


def led_as_commands(
    machine: Machine, programmed: Array, positions: tuple[Array, Array], tcp: Mask, lengths: ArrayLike
) -> Array:
    """As `as_commands`; `positions` are those of the program and the corrected ones, `tcp` and lengths as there."""
    nominal, corrected = positions
    here, there = (commands_from_joints(machine, q, tcp, lengths) for q in positions)
    still = every(nominal == corrected)[:, None]
    result: Array = programmed + np.where(still, 0.0, there - here)
    return result


def along(intent: Intent, rows: Index, fraction: Array) -> Path:
    """How the ends of motions follow each other, for limits on rates; a motion that is kept begins a new stretch."""
    q = intent.joints_at(rows, fraction)
    tips = intent.machine.tip(q, intent.lengths(rows))
    begins = np.ones(len(rows), dtype=bool)
    begins[1:] = np.diff(rows) != 1
    return path_of(intent, q, tips, begins, np.zeros(len(rows), dtype=bool), q)


def path_of(intent: Intent, q: Array, tips: Array, begins: Mask, pinned: Mask, decided: Array) -> Path:
    """The `Path` of poses q (k, n_axes) with tips (k, 3); `decided` (k, n_axes) corrections of pinned poses."""
    rotary = intent.machine.rotary
    travel_mm, travel_rad = np.zeros(len(q)), np.zeros(len(q))
    travel_mm[1:] = np.linalg.norm(np.diff(tips, axis=0), axis=1)
    travel_rad[1:] = np.abs(np.diff(q[:, rotary], axis=0)).sum(axis=1)
    return Path(travel_mm, travel_rad, begins, pinned, decided[:, rotary])


def with_closed_circles(
    intent: Intent, wanted: Array, kept: Mask, within: float, approaches: Array | None = None
) -> Array:
    """Full circles made to end, within their plane, exactly where they really start.

    Only where that moves their end by no more than `within` mm. Of circles one after another all end where the first
    one starts.
    """
    moves, columns = intent.moves, intent.columns
    rows = np.flatnonzero(intent.segments.arc & ~kept)
    rows = rows[arcs.full_circles(intent, rows)]
    if not rows.size:
        return wanted
    chained = np.zeros(len(rows), dtype=bool)
    same = (moves.normal[rows[1:]] == moves.normal[rows[:-1]]).all(axis=1)
    joined = (moves.start[rows[1:]] == moves.end[rows[:-1]]).all(axis=1)
    chained[1:] = (np.diff(rows) == 1) & same & joined
    first = rows[np.maximum.accumulate(np.where(chained, 0, np.arange(len(rows))))]
    where = standing(intent.machine, moves, wanted, kept, intent.before, approaches)
    shift = (where.start - moves.start)[first[:, None], columns]
    own = (wanted - moves.end)[rows[:, None], columns]
    off = arcs.across(shift - own, moves.normal[rows])
    near = np.linalg.norm(off, axis=1) <= within
    result = wanted.copy()
    result[rows[near, None], columns] += off[near]
    return result


def _finding(code: str, moves: Index, text: str) -> Finding:
    return Finding(code, moves, np.zeros(len(moves)), text)
