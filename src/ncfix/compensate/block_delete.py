"""Block delete: correct a program with skippable blocks (`/`, `/2`) so that it is right in all switch positions.

The operator may set each switch on or off, but there is only one text. So the program is followed and corrected
separately in every position of its switches. All positions that execute a block must agree on its new text. A motion
that starts at different places in different positions is not split, because the pieces would lie on one of its paths
only. A block that still needs different corrections in different positions is refused.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from itertools import combinations, repeat

import numpy as np

from ncfix.arrays import Mask
from ncfix.compensate import FixOptions
from ncfix.compensate.account import Reason
from ncfix.compensate.plan.figure_tally import PathError
from ncfix.compensate.plan.findings import Finding
from ncfix.compensate.solve import (
    NONE,
    AcceptedPlan,
    PrecedingMotion,
    SelfCheckError,
    WrittenPlan,
    differences,
    plan_and_write,
)
from ncfix.control.interpreter import NEVER
from ncfix.control.moves import MotionKind, Moves, Pass, Rule, Trace
from ncfix.control.setup import Setup
from ncfix.control.state import BLOCK_DELETE, named_switches
from ncfix.diagnostics import Message, NcfixError, Place, RefusedError, SourceError, UsageError
from ncfix.machine import Machine
from ncfix.text.reader import read
from ncfix.text.tree import Program, Skip
from ncfix.text.writer import Edit, Splices
from ncfix.values import frozen, mutable
from ncfix.writer.pieces import SecondReading

DIFFERS = "NCF451"
TOO_MANY = "NCF452"
NOT_IN_ALL = "NCF453"
MOST_SWITCHES = 4
"""Largest number of switches whose positions are all followed (sixteen positions)."""
ATTEMPTS = 16
"""Largest number of attempts. The second knows the frames that the first has moved, each further one those that depend
on them."""
MAX_SINGLE_ATTEMPTS = 4
"""Attempts after which the blocks behind the first one that differs are treated as that one is: each further attempt
would find only the next of a chain of blocks that begin where another ends, and a program may be one chain."""
POSITION_DECIMALS = 9
"""Decimals, of mm and rad, to which two positions must agree to count as the same."""
WHY = "if a block with / before it is skipped, this block needs another correction than if it is executed"

Follow = Callable[[Setup], Trace]
Edits = tuple[Edit, ...]
Readings = Sequence[SecondReading | None]


@frozen
class SwitchSetting:
    """One position of the block delete switches, and the motions of the program in it.

    on     the switches that are on; None for a program without skippable blocks
    setup  the setup with the switches in this position
    """

    on: frozenset[int] | None
    setup: Setup
    trace: Trace

    @property
    def name(self) -> str:
        """The position in words, see `named`."""
        return named(self.on or (), self.trace.switches)


def named(on: Iterable[int], switches: Iterable[int]) -> str:
    """A position of the switches in words: `off`, `on`, or `on for ... only` if some of several are on."""
    on, switches = frozenset(on), frozenset(switches)
    if not on:
        return "off"
    return "on" if on >= switches else f"on for {named_switches(on)} only"


def positions_of(setup: Setup, follow: Follow) -> tuple[SwitchSetting, ...]:
    """The program followed in all positions of its switches, or only in the one that the setup states.

    Unless the setup states it, the first position has all switches off. Raises what `follow` raises (with the switches
    that are on named in the text), UsageError with everything that is lacking in any position, and RefusedError NCF452
    for more than `MOST_SWITCHES` switches.
    """
    if setup.block_skip is not None:
        trace, stated = follow(setup), setup.block_skip
        on = trace.switches & stated if isinstance(stated, frozenset) else trace.switches if stated else frozenset()
        return (SwitchSetting(on if trace.switches else None, setup, trace),)
    outcomes, lacking = {frozenset[int](): _outcome(setup, follow)}, list[Message]()
    switches = _switches(outcomes.values())
    while len(outcomes) < 2 ** len(switches):
        if len(switches) > MOST_SWITCHES:
            text = f"the program has {len(switches)} switches of block delete ({named_switches(switches)})"
            hint = (
                "give --block-skip on, off, or the numbers of those that are on: ncfix checks all positions of up to "
                f"{MOST_SWITCHES} switches"
            )
            raise RefusedError.of(TOO_MANY, f"{text}: too many to prove all their positions", None, hint)
        for on in (
            frozenset(each) for count in range(len(switches) + 1) for each in combinations(sorted(switches), count)
        ):
            if on not in outcomes:
                outcomes[on] = _outcome(replace(setup, block_skip=on), follow)
        switches |= _switches(outcomes.values())
    for outcome in outcomes.values():
        lacking += outcome.messages if isinstance(outcome, UsageError) else ()
    if lacking:
        raise UsageError.collected(dict.fromkeys(lacking))
    if not switches:
        (trace,) = (each for each in outcomes.values() if isinstance(each, Trace))
        return (SwitchSetting(None, setup, trace),)
    return tuple(
        SwitchSetting(on, replace(setup, block_skip=on), replace(each, switches=switches))
        for on, each in outcomes.items()
        if isinstance(each, Trace)
    )


def _outcome(setup: Setup, follow: Follow) -> Trace | UsageError:
    """The program followed in one position, or the error that says what the setup does not give for it."""
    try:
        return follow(setup)
    except UsageError as error:
        return error
    except SourceError as error:
        if not setup.block_skip:
            raise
        assert isinstance(setup.block_skip, frozenset)
        words = f"if blocks with {named_switches(setup.block_skip)} are skipped"
        hint = "--block-skip off if they are never skipped: ncfix then uses only that position"
        raise SourceError.collected(
            replace(each, text=f"{words}: {each.text}", hint=hint) for each in error.messages
        ) from None


def _switches(outcomes: Iterable[Trace | UsageError]) -> frozenset[int]:
    return frozenset[int]().union(*(each.switches for each in outcomes if isinstance(each, Trace)))


def in_pairs(
    first: Sequence[SwitchSetting], second: Sequence[SwitchSetting]
) -> Iterator[tuple[SwitchSetting, SwitchSetting]]:
    """Two programs paired in each position of block delete. A switch that a program lacks does not affect it."""
    if len(first) == len(second) == 1:
        yield first[0], second[0]
        return
    tables = [{each.on or frozenset[int](): each for each in own} for own in (first, second)]
    for on in dict.fromkeys((*tables[0], *tables[1])):
        one, other = (own[on & frozenset[int]().union(*own)] for own in tables)
        yield one, other


# -- messages ---------------------------------------------------------------------------------------------------------


def messages_of(positions: Sequence[SwitchSetting]) -> tuple[Message, ...]:
    """The messages of all positions, without duplicates, and one that says that all positions were followed.

    `NEVER` (NCF249, a block that is not executed) is kept only if it is given in every position.
    """
    messages = [each for position in positions for each in position.trace.messages]
    if len(positions) == 1:
        return tuple(messages)
    places = [each.place for each in messages if each.code == BLOCK_DELETE]
    always = set.intersection(*({each.text for each in position.trace.messages} for position in positions))
    rest = dict.fromkeys(
        each for each in messages if each.code != BLOCK_DELETE and (each.code != NEVER or each.text in always)
    )
    first = min(filter(None, places), key=lambda place: place.line, default=None)
    (switches, *_), many = (each.trace.switches for each in positions), len(positions)
    words = "/" if len(switches) == 1 else named_switches(switches), "both" if many == 2 else f"all {many}"
    text = (
        "blocks with {} may be executed or skipped: ncfix keeps the tolerance in {} positions of block delete"
    ).format(*words)
    return (Message(BLOCK_DELETE, text, first, "--block-skip on or off: ncfix uses that position only"), *rest)


def worst_findings(every: Sequence[WrittenPlan]) -> list[tuple[Finding, ...]]:
    """The findings of each position; each block only in the position in which its figure is largest."""
    if len(every) == 1:
        return [every[0].plan.findings]
    worst, where = dict[tuple[str, int], float](), dict[tuple[str, int], tuple[int, int]]()
    for position, solution in enumerate(every):
        for finding in solution.plan.findings:
            for row, value in zip(finding.moves.tolist(), finding.values.tolist(), strict=True):
                key = finding.code, int(solution.moves.block[row])
                if key not in worst or value > worst[key]:
                    worst[key], where[key] = value, (position, row)
    return [
        tuple(
            finding.among([where[finding.code, int(solution.moves.block[row])] == (k, row) for row in finding.moves])
            for finding in solution.plan.findings
        )
        for k, solution in enumerate(every)
    ]


def assumed_of(positions: Sequence[SwitchSetting]) -> tuple[str, ...]:
    """The names of all values that were taken as zero in any position."""
    return tuple(dict.fromkeys(name for each in positions for name in each.trace.assumed))


def stamped(positions: Sequence[SwitchSetting]) -> str:
    """The words of the stamp about block delete; empty for a program without skippable blocks."""
    if positions[0].on is None:
        return ""
    if len(positions) == 1:
        return f"block delete {positions[0].name}"
    return f"block delete on or off{'' if len(positions) == 2 else ' (all switches)'}"


# -- one text for all positions ---------------------------------------------------------------------------------------


@frozen
class JointPlan:
    """The plan for each position, and the one text for all of them.

    splices       the edits of the program's text
    added_blocks  number of lines that the edits add
    """

    plans: tuple[WrittenPlan, ...]
    splices: Splices
    added_blocks: int


def plan_and_write_all(
    program: Program,
    moves: Sequence[Moves],
    machine: Machine,
    options: FixOptions,
    readings: Readings,
    before: PrecedingMotion | None = None,
    first: AcceptedPlan | None = None,
    refused: Mapping[int, Reason] = NONE,
) -> JointPlan:
    """Plan and write a program so that all positions of block delete agree on the text.

    moves, readings  one for each position
    before, first    for a program in a single position only, see `plan_and_write`
    refused          block -> why it is refused, whatever the plan is; not together with `first`
    """
    if len(moves) == 1:
        solution = plan_and_write(program, moves[0], machine, options, readings[0], before, first, refused)
        return JointPlan((solution,), solution.emission.splices, solution.emission.added_blocks)
    refused, whole = dict(refused), _starting_elsewhere(moves)
    spelled, resting, passed, tried = dict[int, Mask](), set[int](), set[int](), set[int]()
    attempts = 0
    while True:
        plans: list[WrittenPlan] = []
        for k, own in enumerate(moves):
            twin = next((j for j in range(k) if equal(own, moves[j]) and equal(readings[k], readings[j])), None)
            if twin is not None:
                plans.append(plans[twin])
                continue
            restricted = _passing(_restricted(own, whole, spelled, resting), passed)
            plans.append(plan_and_write(program, restricted, machine, options, readings[k], refused=refused))
        all_refused = {block: why for each in plans for block, why in each.reasons.items()}
        if all_refused.keys() > refused.keys():
            refused = all_refused
            continue
        edits = [_by_block(program, each.emission.splices) for each in plans]
        differing = _differing(moves, edits)
        if not differing:
            return _merged(plans, edits)
        if differing <= refused.keys():
            raise AssertionError(f"blocks {sorted(differing)} are unchanged and yet differ")
        attempts += 1
        if attempts > MAX_SINGLE_ATTEMPTS:
            nearest = min(differing - refused.keys())
            differing |= {block for block in whole if block > nearest} - refused.keys() - passed
        for block in differing - spelled.keys():
            spelled[block] = _displaced_axes(plans, block)
            whole.add(block)
            differing.remove(block)
        rapids = {block for block in differing - passed if all(map(_only_rapids, moves, repeat(block)))}
        passed |= rapids & tried
        resting = resting - differing | rapids - tried
        tried |= rapids
        differing -= rapids
        deletable = np.array([any(isinstance(item, Skip) for item in each.items) for each in program.templates])
        for block in differing:  # the cause is the nearest skippable block up to and including this one
            causes = np.flatnonzero(deletable[program.template[: block + 1]])
            refused[block] = Reason(DIFFERS, WHY, int(causes[-1]) if causes.size else -1)


def _restricted(moves: Moves, whole: set[int], spelled: Mapping[int, Mask], resting: set[int]) -> Moves:
    """The motions with restrictions on how these blocks may be written.

    whole    blocks whose motions must not be split
    spelled  block -> (n_axes,) axes that must get a word
    resting  blocks in which an axis without a word gets none
    """
    if whole:
        moves = replace(moves, whole=moves.whole | np.isin(moves.block, list(whole)))
    if resting:
        rests = np.isin(moves.block, list(resting))[:, None] & ~moves.programmed
        moves = replace(moves, resting=moves.resting | rests)
    if not spelled:
        return moves
    named = np.zeros(moves.end.shape, dtype=np.bool_)
    for block, axes in spelled.items():
        named[moves.block == block] = axes
    return replace(moves, spelled=named & ~moves.programmed)


def _passing(moves: Moves, blocks: set[int]) -> Moves:
    """The motions; those of these blocks pass uncorrected, because their path depends on which blocks are skipped."""
    if not blocks:
        return moves
    rows = np.isin(moves.block, list(blocks)) & (moves.rule == Rule.CORRECT)
    passing = np.where(rows, Pass.SKIPPED, moves.passing).astype(np.int8)
    return replace(moves, rule=np.where(rows, Rule.PASS, moves.rule), passing=passing)


def _only_rapids(moves: Moves, block: int) -> bool:
    """Whether a block consists of absolute rapids that are corrected or passed, and no cut begins where one ends.

    Frames that mix axes (rotations) are excluded: there a word moves more than its own axis.
    """
    own = moves.block == block
    rapid = (moves.kind == MotionKind.RAPID) & (moves.rule != Rule.REFUSE) & ~moves.incremental
    turned = (np.count_nonzero(moves.frames[k].rotation, axis=1).max() > 1 for k in set(moves.frame[own].tolist()))
    moving = np.flatnonzero(moves.kind != MotionKind.DWELL)
    begun = moving[:-1][moves.cutting[moving[1:]]]
    return bool((rapid[own] & ~np.isin(np.flatnonzero(own), begun)).all()) and not any(turned)


def _displaced_axes(plans: Sequence[WrittenPlan], block: int) -> Mask:
    """(n_axes,) the axes that a block moves, in any position."""
    axes = np.zeros(len(plans[0].moves.axes), dtype=np.bool_)
    for plan in plans:
        rows = np.flatnonzero(plan.moves.block == block)
        last = plan.plan.pieces.last[rows]
        moved = plan.emission.end[last] != plan.emission.start[rows]
        axes |= (moved & ~np.isnan(plan.emission.end[last])).any(axis=0)
    return axes


def _by_block(program: Program, splices: Splices) -> Mapping[int, Edits]:
    """The edits of each block that has any."""
    blocks = np.searchsorted(program.blocks[:, 0], splices.start, side="right") - 1
    edits = defaultdict[int, Edits](tuple)
    for block, edit in zip(blocks.tolist(), splices.edits(), strict=True):
        edits[block] += (edit,)
    return edits


def _differing(moves: Sequence[Moves], edits: Sequence[Mapping[int, Edits]]) -> set[int]:
    """The blocks whose edits differ between two positions that both execute them."""
    wanted, differing = dict[int, Edits](), set[int]()
    for own, edits_here in zip(moves, edits, strict=True):
        for block in {*own.block.tolist(), *edits_here}:
            if wanted.setdefault(block, edits_here.get(block, ())) != edits_here.get(block, ()):
                differing.add(block)
    return differing


def _merged(plans: Sequence[WrittenPlan], edits: Sequence[Mapping[int, Edits]]) -> JointPlan:
    """The one text of all positions, whose edits agree wherever several of them execute a block."""
    wanted = {block: own for edits_here in edits for block, own in edits_here.items()}
    every = [edit for block in sorted(wanted) for edit in wanted[block]]
    ends = b"\n" if any(b"\n" in edit.text for edit in every) else b"\r"
    return JointPlan(tuple(plans), Splices.of(every), sum(edit.text.count(ends) for edit in every))


def equal(one: object, other: object) -> bool:
    """Whether two values are equal, field by field: numbers to the last bit, NaN equal to NaN."""
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return False
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(equal, one, other))
    if is_dataclass(one) and type(one) is type(other):
        return all(equal(getattr(one, each.name), getattr(other, each.name)) for each in fields(one))
    return bool(one == other)


def _starting_elsewhere(moves: Sequence[Moves]) -> set[int]:
    """The blocks whose motions start at different places in different positions."""
    starts, elsewhere = dict[int, bytes](), set[int]()
    for own in moves:
        own_starts, places = defaultdict[int, bytes](bytes), np.round(own.start, POSITION_DECIMALS) + 0.0
        places[np.isnan(places)] = np.nan
        for block, place in zip(own.block.tolist(), places, strict=True):
            own_starts[block] += place.tobytes()
        elsewhere |= {block for block, start in own_starts.items() if starts.setdefault(block, start) != start}
    return elsewhere


# -- the proof in all positions ----------------------------------------------------------------------------------------


@mutable
class WholeProof:
    """The proof of a whole program, in each position of block delete: reads and follows the corrected text.

    follows   for each position, the function that traces a text
    attempts  number of attempts that are left
    """

    program: Program
    follows: Sequence[Callable[[Program], Trace]]
    attempts: int = ATTEMPTS

    def misreadings(self, continued: object, joint: JointPlan, text: bytes) -> Readings | None:
        """See `driver.Proof.misreadings`. RefusedError NCF453 if no text is right in all of several positions."""
        if text == self.program.source:
            return None
        try:
            return self._misreadings(joint, text)
        except SelfCheckError as why:
            if len(self.follows) == 1:
                raise
            wrong = f"no corrected text is right in all positions of block delete: {why}"
            hint = "--block-skip on or off corrects it for one position, if the switch is always in that position"
            raise RefusedError.of(NOT_IN_ALL, wrong, Place(self.program.path), hint) from why

    def _misreadings(self, joint: JointPlan, text: bytes) -> Readings | None:
        pairs = list(zip(joint.plans, (self._again(text, each) for each in self.follows), strict=True))
        wrong = [differences(solution, again) for solution, again in pairs]
        at = next((k for k, each in enumerate(wrong) if each.any()), None)
        if at is None:
            return None
        self.attempts -= 1
        if not self.attempts:
            (solution, again), piece = pairs[at], int(np.argmax(wrong[at]))
            pieces, move = solution.plan.pieces, int(solution.plan.pieces.move[piece])
            meant = solution.moves.end[move] if pieces.unchanged[piece] else solution.emission.end[piece]
            line = self.program.line(int(solution.moves.block[move]))
            raise SelfCheckError(f"line {line} would end at {again.end[piece]}, not at {meant}")
        return [SecondReading.of(again, solution.plan.pieces) for solution, again in pairs]

    def _again(self, text: bytes, follow: Callable[[Program], Trace]) -> Moves:
        try:
            return follow(read(text, self.program.path, self.program.dialect)).moves
        except NcfixError as error:
            raise SelfCheckError(f"the corrected program cannot be read: {error}") from error

    def astray(self, line: int | None, errors: PathError) -> Exception:
        """See `driver.Proof.astray`."""
        return SelfCheckError(f"line {line} would end {errors.after.max:.3f} mm from the intended position")
