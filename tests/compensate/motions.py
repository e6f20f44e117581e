"""Motions by code, as a tracer would give them, and a control and a machine of the tests' own to judge plans by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from conftest import FULL
from ncfix.compensate.plan import deviation, limits, path
from ncfix.compensate.plan.arcs import Closure
from ncfix.compensate.plan.figure_tally import PathError
from ncfix.compensate.plan.findings import Finding
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.path import PathTolerance, Plan, Requirements
from ncfix.compensate.plan.strategies import Strategy
from ncfix.compensate.plan.written import Known, WrittenPieces
from ncfix.control.builder import NEUTRAL, neutral_column
from ncfix.control.moves import FeedMode, Frame, MotionKind, Moves, Rule
from ncfix.machine import Machine, State
from ncfix.writer.pieces import Pieces

SAMPLES = 200 if FULL else 50
"""At how many places of a piece errors are looked at; pieces bend little."""


@dataclass(frozen=True)
class Arc:
    """An arc from where the motion before ended: about `centre`, in the plane across `normal`, rising by `rise`."""

    centre: Sequence[float]
    normal: Sequence[float]
    sweep: float
    rise: float = 0.0
    turn: Sequence[float] = ()


def motions(
    machine: Machine,
    start: Sequence[float],
    steps: Sequence[Sequence[float] | Arc],
    kinds: Sequence[MotionKind] | MotionKind = MotionKind.FEED,
    tcp: bool = False,
    tool_length: float = 100.0,
) -> Moves:
    """Motions one after another: straight ones to command positions, or arcs. Angles in rad."""
    n, width = len(steps), len(machine.axes)
    xyz = [machine.axis_names.index(name) for name in "XYZ"]
    starts, ends = np.empty((n, width)), np.empty((n, width))
    centre, normal, sweep = np.full((n, 3), np.nan), np.full((n, 3), np.nan), np.full(n, np.nan)
    kind = np.array([kinds] * n if isinstance(kinds, MotionKind) else list(kinds), dtype=np.int8)
    here = np.asarray(start, dtype=float)
    for row, step in enumerate(steps):
        starts[row] = here
        if isinstance(step, Arc):
            kind[row], sweep[row] = MotionKind.ARC, step.sweep
            centre[row] = step.centre
            normal[row] = np.asarray(step.normal) / np.linalg.norm(step.normal)
            here = _end_of(step, here, xyz, normal[row], machine.rotary)
        else:
            here = np.asarray(step, dtype=float)
        ends[row] = here
    whole, none = np.ones(n, dtype=bool), np.zeros(n, dtype=bool)
    return Moves(
        axes=machine.axis_names,
        rotary=machine.rotary,
        start=starts,
        end=ends,
        programmed=np.ones((n, width), dtype=bool),
        kind=kind,
        rule=np.full(n, Rule.CORRECT, dtype=np.int8),
        reason=np.zeros(n, dtype=np.int16),
        block=np.arange(n, dtype=np.int32),
        frame=np.zeros(n, dtype=np.int32),
        incremental=none,
        arc_absolute=none,
        tcp=whole if tcp else none,
        whole=none,
        tool=np.zeros(n, dtype=np.int32),
        tool_length=np.full(n, tool_length),
        feed=np.full(n, 1000.0),
        feed_mode=np.full(n, FeedMode.PER_MINUTE, dtype=np.int8),
        centre=centre,
        normal=normal,
        sweep=sweep,
        modal=np.full(n, 10, dtype=np.int16),
        frames=(Frame(np.zeros(width), np.eye(3), 1.0),),
        reasons=("",),
        counted=np.zeros((n, width), dtype=bool),
        **{name: neutral_column(name, n, width) for name in NEUTRAL},
    )


def _end_of(arc: Arc, start: np.ndarray, xyz: list[int], normal: np.ndarray, rotary: np.ndarray) -> np.ndarray:
    end = start.copy()
    spoke = start[xyz] - np.asarray(arc.centre)
    along = normal * (spoke @ normal)
    across = spoke - along
    turned = np.cos(arc.sweep) * across + np.sin(arc.sweep) * np.cross(normal, across)
    if abs(arc.sweep / (2 * np.pi) - round(arc.sweep / (2 * np.pi))) < 1e-12:
        turned = across
    end[xyz] = np.asarray(arc.centre) + along + normal * arc.rise + turned
    if np.all(turned == across) and not arc.rise:
        end[xyz] = start[xyz]
    if len(arc.turn):
        end[rotary] += arc.turn
    return end


def changed(moves: Moves, **columns: object) -> Moves:
    """The motions with columns replaced; words of `incremental` ones count for all axes, unless `counted` is given."""
    if "incremental" in columns and "counted" not in columns:
        columns["counted"] = np.repeat(np.asarray(columns["incremental"])[:, None], len(moves.axes), axis=1)
    return replace(moves, **columns)


# -- a control of our own ---------------------------------------------------------------------------------------------


def interpolated(start: np.ndarray, end: np.ndarray, xyz: list[int], arc: dict | None, f: np.ndarray) -> np.ndarray:
    """Commands of one block at fractions f (k,): straight, or an arc given by centre, normal and sweep."""
    command = start + f[:, None] * (end - start)
    if arc is None:
        return command
    normal, centre = arc["normal"], arc["centre"]
    first = np.cross(normal, [0.3, 0.5, 0.7])
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    frame = np.stack([first, second, normal])
    a, b = frame @ (start[xyz] - centre), frame @ (end[xyz] - centre)
    angle = np.arctan2(a[1], a[0]) + f * arc["sweep"]
    radius = np.hypot(a[0], a[1]) + f * (np.hypot(b[0], b[1]) - np.hypot(a[0], a[1]))
    local = np.stack([radius * np.cos(angle), radius * np.sin(angle), a[2] + f * (b[2] - a[2])], axis=1)
    command[:, xyz] = centre + local @ frame
    return command


def sweep_of(start: np.ndarray, end: np.ndarray, centre: np.ndarray, normal: np.ndarray, like: float) -> float:
    """The sweep that a control works out from the ends, in the sense and with the full turns of `like`."""
    a, b = start - centre, end - centre
    a, b = a - normal * (a @ normal), b - normal * (b @ normal)
    angle = np.arctan2(np.cross(a, b) @ normal, a @ b) % (2 * np.pi)
    if like < 0:
        angle -= 2 * np.pi
    if np.linalg.norm(a - b) < 1e-9:
        angle = np.copysign(2 * np.pi, like)
    return float(angle + np.copysign(2 * np.pi, like) * max(0, round((abs(like) - abs(angle)) / (2 * np.pi))))


def joints(machine: Machine, commands: np.ndarray, tcp: np.ndarray, length: np.ndarray) -> np.ndarray:
    """What a control makes of commands (k, n_axes); with tool-centre-point control by one Newton step: it is linear."""
    q = commands.copy()
    xyz = np.array([machine.axis_names.index(name) for name in "XYZ"])
    rows = np.flatnonzero(tcp)
    plain = np.where(machine.rotary, 0.0, commands[rows])
    gap = machine.nominal(commands[rows], length[rows])[:, :3, 3] - machine.nominal(plain, 0.0)[:, :3, 3]
    jacobian = machine.jacobians(commands[rows], length[rows]).axes[:, :3][:, :, xyz]
    q[rows[:, None], xyz] -= np.linalg.solve(jacobian, gap[..., None])[..., 0]
    return q


def dense_errors(
    machine: Machine, moves: Moves, plan: Plan, count: int = SAMPLES, with_play: bool = False
) -> np.ndarray:
    """Tip errors along every block of a plan, (pieces, count) mm, by a loop over pieces: start left out, end included.

    Pieces that only take up a jump (shorter than a millionth of the block) are left out (NaN); so are rapids.
    with_play: the direction of each axis is that in which the program moves it, and stays while it rests.
    """
    xyz = [machine.axis_names.index(name) for name in "XYZ"]
    pieces, width = plan.pieces, len(machine.axes)
    meant, done = np.empty((2, len(pieces), count + 1, width))
    steps, span = np.arange(count + 1) / count, np.empty(len(pieces))
    here, before = np.zeros(width), 0.0
    for k, row in enumerate(pieces.move.tolist()):
        if k == 0 or pieces.move[k - 1] != row:
            here, before = plan.start[row], 0.0
        span[k] = pieces.fraction[k] - before
        arc = {"normal": moves.normal[row], "centre": moves.centre[row], "sweep": float(moves.sweep[row])}
        programmed = arc if moves.kind[row] == MotionKind.ARC else None
        meant[k] = interpolated(moves.start[row], moves.end[row], xyz, programmed, before + span[k] * steps)
        if pieces.arc[k]:
            arc["centre"] = pieces.centre[k]
            arc["sweep"] = sweep_of(
                here[xyz], pieces.end[k][xyz], pieces.centre[k], arc["normal"], arc["sweep"] * span[k]
            )
        done[k] = interpolated(here, pieces.end[k], xyz, arc if pieces.arc[k] else None, steps)
        here, before = pieces.end[k], float(pieces.fraction[k])
    each = np.repeat(pieces.move, count + 1)
    length, tcp = moves.tool_length[each], moves.tcp[each]
    meant, done = (joints(machine, path.reshape(-1, width), tcp, length) for path in (meant, done))
    ways = _ways(meant.reshape(len(pieces), count + 1, width), span) if with_play else np.zeros(width)
    gap = machine.actual(done, State(length, ways))[:, :3, 3] - machine.nominal(meant, length)[:, :3, 3]
    errors = np.linalg.norm(gap, axis=1).reshape(len(pieces), count + 1)[:, 1:]
    cut = (moves.kind[pieces.move] == MotionKind.FEED) | (moves.kind[pieces.move] == MotionKind.ARC)
    errors[~cut | (span <= 1e-6)] = np.nan
    return errors


def _ways(path: np.ndarray, span: np.ndarray) -> np.ndarray:
    """The direction of each axis at each sample of paths (pieces, samples, n_axes): the last in which it moved."""
    ways, last = np.empty_like(path), np.zeros(path.shape[2])
    for k, piece in enumerate(path):
        motion = np.diff(piece, axis=0)
        way = np.where(np.abs(motion) > 1e-10, np.sign(motion), last)
        ways[k] = np.concatenate([way[:1], way])
        last = way[-1] if span[k] > 1e-6 else last
    return ways.reshape(-1, path.shape[2])


def plan(
    machine: Machine,
    moves: Moves,
    strategy: Strategy,
    tolerance_mm: float,
    closure: Closure = Closure(),  # noqa: B008
    keep: np.ndarray | None = None,
    *,
    state: State = State(),  # noqa: B008
    rounding_mm: float = 0.0,
    split_rapids: bool = False,
    arc_pieces: bool = False,
) -> Plan:
    """The plan of motions on a machine."""
    demands = Requirements(PathTolerance(tolerance_mm, rounding_mm), closure, split_rapids, arc_pieces)
    return path.plan(Intent(machine, moves, state), strategy, demands, keep)


def findings(machine: Machine, moves: Moves, pieces: Pieces, start: np.ndarray | None = None) -> tuple[Finding, ...]:
    """What is against pieces; motions start as in the program, or at `start`."""
    return limits.findings(written(machine, moves, pieces, start))


def path_error(
    machine: Machine,
    moves: Moves,
    pieces: Pieces,
    start: np.ndarray | None = None,
    *,
    rows: np.ndarray | None = None,
    known: Known | None = None,
) -> PathError:
    """The tip errors along pieces; motions start as in the program, or at `start`."""
    return deviation.path_error(written(machine, moves, pieces, start), rows, known)


def written(machine: Machine, moves: Moves, pieces: Pieces, start: np.ndarray | None = None) -> WrittenPieces:
    """Pieces on a program on a machine."""
    return WrittenPieces(Intent(machine, moves, State()), pieces, moves.start if start is None else start)
