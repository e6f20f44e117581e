"""Plans: for each block shape, its words, its codes, and the steps to execute in order.

Everything independent of numbers is prepared once per shape, so that executing a block is fast.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field

import numpy as np

from ncfix.arrays import Mask
from ncfix.control.coordinates import INDEX, mask_of
from ncfix.control.expressions import Evaluate, Fault
from ncfix.control.interpreter import TextUnit
from ncfix.control.lanes.block_rows import Lane
from ncfix.control.state import NO_MOTION
from ncfix.text.dialect import tenths
from ncfix.text.reach import UNREAD, Deletable, deletable
from ncfix.text.tree import (
    Assignment,
    Comment,
    Constant,
    Literal,
    NamedParameter,
    NumberedParameter,
    Opaque,
    OWordLine,
    Program,
    Span,
    Tape,
    Template,
    Word,
)
from ncfix.values import frozen, mutable
from ncfix_iso.rs274 import groups
from ncfix_iso.rs274.control import POLAR
from ncfix_iso.rs274.groups import TOOL_CHANGE, Rules
from ncfix_iso.rs274.order import Step, steps_of

DWELL_WORDS = "P"
"""Words of G4 that give its duration."""
NO_WORDS = frozenset("GMNO")
"""Addresses whose words are not passed as values to the steps of a block."""

WITHOUT_WORDS = frozenset({50, 110, 230, 250, 260, 281, 301, 1030})
"""Codes with different meanings without and with axis words: G5 P10000 and splines, G25 and G26 of spindles and of
working areas, G28.1 and G30.1 that save the position and that approach one; G11 and G23, which end data and the
check of strokes, and are motions in other languages; G103, the look-ahead of Haas, an arc in XZ of Brother."""
SMOOTHING = 51
"""G5.1 Q: axis words, `G5.1 Q2 X0 Y0 Z0`, name the axes concerned, and move nothing."""

CYCLE_WORDS = frozenset("DIJKLPQRUW")
"""Words without which G70 and G71 are no cycles (of turning, or of holes on a circle)."""

LANE_LETTERS = frozenset("FN") | INDEX.keys()
ARC_LETTERS = frozenset("IJKR")
PLACES = ARC_LETTERS | INDEX.keys()
CONFLICT = "NCF208"
UNUSED = "NCF209"
UNKNOWN_M = "NCF229"
MAX_M_CODES = 4

AXES_TAKEN = frozenset((100, 220, 280, 300, 310, 501, 510, 511, 520, 600, 680, 682, 683, 684, 920))
"""G codes that use the axis words of their block themselves, so that it has no motion."""

HARMLESS_TEXT = frozenset({UNREAD, "checksum", "command", "control character", "output", "program name", "text word"})
"""Terminals of the grammars, as kinds of `Opaque`, that move no axis; any other text may."""

FIRST_SYSTEM, EXTENDED_SYSTEM = 540, 541
"""G54, and the code as which ISO controls read it if the block has a P: G54.1 Pn."""

P_USERS = frozenset((*(40, 100, 300, 650, 660, 661, 682), *groups.CYCLES, *(190, 970, 980, 990, 1980)))
"""G and M codes that use P."""


@frozen
class Codes:
    """The codes of a block, by group.

    steps    steps before the motion
    motion   motion code, if the block has one
    stop     M0, M1, M2, M30, M60 in tenths
    call     M98 or M99 in tenths
    takes    whether one of the codes uses the axis words itself
    unknown  unknown G codes
    """

    g: dict[str, int]
    m: dict[str, int]
    steps: tuple[tuple[Step, int], ...]
    motion: int | None
    stop: int | None
    call: int | None
    takes: bool
    unknown: tuple[int, ...]


@frozen
class FlowLine:
    """A flow-control line: its label (text or function), its keyword, and the functions of its arguments."""

    label: str | Evaluate
    keyword: str
    arguments: tuple[Evaluate, ...]
    span: Span


@mutable
class RS274Plan:
    """What is done with every block of a shape.

    literals     (address, slot) of words with a plain number
    fixed        values of addresses that the block has no word for, see `Like`
    pointless    addresses of plain numbers without a decimal point, in dialects where that matters
    computed     words with an expression
    assignments  parameters that are set
    code_words   G and M words, if one of them is computed; else `codes` are the codes
    flow         the flow-control line of the block
    skip         the switches of block delete at its beginning (`/`, `/2`)
    tape         whether the block is a `%`
    unread       whether the block could not be parsed
    command      place of a command to the control itself (`$H` of Grbl)
    unknown_text  place of text with unknown effect
    axes         bit mask of the axis words
    fault        error in the codes, raised when the block is executed
    lane         set if the block may go through the fast lane
    checked      motion codes with which all words are known to be used
    """

    template: Template
    literals: tuple[tuple[str, int], ...] = ()
    fixed: dict[str, float] = field(default_factory=dict)
    pointless: tuple[str, ...] = ()
    computed: tuple[tuple[str, Evaluate, Span], ...] = ()
    assignments: tuple[tuple[int | str | Evaluate, Evaluate, Span], ...] = ()
    code_words: tuple[tuple[Word, Evaluate], ...] = ()
    codes: Codes | None = None
    flow: FlowLine | None = None
    skip: Deletable | None = None
    tape: bool = False
    command: Span | None = None
    unknown_text: Span | None = None
    unread: bool = False
    axes: int = 0
    letters: frozenset[str] = frozenset()
    fault: Fault | None = None
    lane: Lane | None = None
    checked: set[int | None] = field(default_factory=set)

    def span_of(self, address: str) -> Span | None:
        """The place of the word with an address; None if it is written under another one, see `Like`."""
        return next((word.span for word in self.template.words if word.address == address), None)


class RS274Unit(TextUnit[RS274Plan]):
    """The text of a program or subprogram file, on a machine with some axes (bit mask of their letters).

    flows  the flow-control blocks, ascending
    """

    def __init__(self, program: Program, rules: Rules, axes: int, external: str = "") -> None:
        self.rules, self.axes = rules, axes
        super().__init__(program, self._planned, external)

    def take(self, program: Program, begin: int, stop: int) -> None:
        """See `TextUnit.take`."""
        super().take(program, begin, stop)
        leading = [any(isinstance(item, OWordLine) for item in template.items) for template in program.templates]
        self.flows = self.blocks_of([shape for shape, leads in enumerate(leading) if leads])

    def _planned(self, template: Template) -> RS274Plan:
        plan = plan_of(template, self.rules)
        if plan.axes & ~self.axes:
            plan.lane = None
        return plan

    def closed(self) -> Mask:
        """See `TextUnit.closed`."""
        return np.array([plan.lane is None for plan in self.all_plans()], dtype=np.bool_)


def words_of(words: Sequence[Word], address: str) -> list[Word]:
    """The words with an address."""
    return [word for word in words if word.address == address]


def plan_of(template: Template, rules: Rules) -> RS274Plan:
    """The plan for a shape."""
    plan = RS274Plan(template)
    take_values(plan, rules)
    take_statements(plan, rules)
    take_codes(plan, rules)
    plan.lane = lane_of(plan)
    return plan


def take_values(plan: RS274Plan, rules: Rules) -> None:
    """Collect the words that are passed as values to the steps of the block."""
    words = plan.template.words
    standby = words_of(words, "T")[1:] if TOOL_CHANGE in plan.template.m_codes else []
    values = [word for word in words if word.address not in NO_WORDS and word not in standby]
    plain = [(word.address, word.value) for word in values if isinstance(word.value, Literal)]
    computed = [word for word in values if not isinstance(word.value, Literal)]
    plan.literals = tuple((address, value.slot) for address, value in plain)
    plan.pointless = tuple(address for address, value in plain if value.pointless)
    plan.computed = tuple((w.address, rules.compiled(w.value, w.address), w.span) for w in computed)
    plan.letters = frozenset(word.address for word in values)
    if rules.aliases:
        take_aliases(plan, rules)
    plan.axes = mask_of(INDEX[letter] for letter in plan.letters if letter in INDEX)
    if plan.letters & POLAR:
        plan.axes |= 1 << INDEX["X"] | 1 << INDEX["Y"]


def take_aliases(plan: RS274Plan, rules: Rules) -> None:
    """Convert the words of a dialect's own code to those of the family's code for which it stands."""
    codes = [(w.address, round(10 * w.value.value)) for w in plan.template.words if isinstance(w.value, Constant)]
    for code in codes:
        given = rules.aliases[code].given if code in rules.aliases else {}
        family = {own: address for address, (own, _) in given.items() if own is not None}
        untouched = plan.letters - family.keys()
        if untouched & given.keys():
            plan.fault = Fault(CONFLICT, f"{min(untouched & given.keys())} is not a word of {code[0]}{code[1] / 10:g}")
            return
        plan.literals = tuple((family.get(address, address), slot) for address, slot in plan.literals)
        plan.pointless = tuple(family.get(address, address) for address in plan.pointless)
        plan.computed = tuple((family.get(each[0], each[0]), *each[1:]) for each in plan.computed)
        plan.fixed |= {
            address: number
            for address, (own, number) in given.items()
            if number is not None and (own is None or own not in plan.letters)
        }
        plan.letters = untouched | {family[own] for own in plan.letters & family.keys()} | plan.fixed.keys()


def take_statements(plan: RS274Plan, rules: Rules) -> None:
    """Collect everything in the block other than words."""
    items = plan.template.items
    plan.assignments = tuple(assignment(item, rules) for item in items if isinstance(item, Assignment))
    plan.flow = next((flow_line(item, rules) for item in items if isinstance(item, OWordLine)), None)
    plan.skip = deletable(plan.template, DWELL_WORDS)
    plan.tape = any(isinstance(item, Tape) for item in items)
    opaque = {item.kind: item.span for item in items if isinstance(item, Opaque)}
    plan.unread, plan.command = UNREAD in opaque, opaque.get("command")
    plan.unknown_text = next((span for kind, span in opaque.items() if kind not in HARMLESS_TEXT), None)


def take_codes(plan: RS274Plan, rules: Rules) -> None:
    """Collect the codes of the block; by group if they are plain numbers."""
    words = [word for word in plan.template.words if word.address in "GM"]
    plain = [(word, round(10 * word.value.value)) for word in words if isinstance(word.value, Constant)]
    if len(plain) < len(words):
        plan.code_words = tuple((word, rules.compiled(word.value, word.address)) for word in words)
        return
    try:
        plan.codes = grouped_codes(plain, plan.letters, rules)
    except Fault as fault:
        plan.fault = fault


def has_words(plan: RS274Plan) -> bool:
    """Whether a block has words besides its statement."""
    return bool(plan.letters or plan.assignments or plan.template.g_codes or plan.template.m_codes)


def flow_line(item: OWordLine, rules: Rules) -> FlowLine:
    """A flow-control line with its expressions as functions."""
    label = item.label if isinstance(item.label, str) else rules.compiled(item.label, "")
    return FlowLine(label, item.keyword, tuple(rules.compiled(each, "") for each in item.arguments), item.span)


def assignment(item: Assignment, rules: Rules) -> tuple[int | str | Evaluate, Evaluate, Span]:
    """Target and value of an assignment: a name as text, a number as function; and the place."""
    assert isinstance(item.target, NamedParameter | NumberedParameter), "this dialect has no arrays"
    target = item.target.name if isinstance(item.target, NamedParameter) else rules.compiled(item.target.index, "")
    return target, rules.compiled(item.value, ""), item.span


def grouped_codes(pairs: Sequence[tuple[Word, int]], letters: frozenset[str], rules: Rules) -> Codes:
    """The codes of a block by group; raises `Fault` if two exclude each other, or one is unknown."""
    g: dict[str, int] = {}
    m: dict[str, int] = {}
    unknown, named = [], False
    for word, code in pairs:
        if (word.address, code) in rules.aliases:
            like = rules.aliases[word.address, code].code
            code = tenths(like)
        if word.address == "G":
            if rules.din_units and letters.isdisjoint(CYCLE_WORDS):
                code = groups.DIN_UNITS.get(code, code)
            named |= code == SMOOTHING and "Q" in letters
            own = rules.strict or ("G", code) in rules.operations
            if code in WITHOUT_WORDS and not own and not letters.isdisjoint(INDEX):
                unknown.append(code)
                continue
            if code in rules.harmless_g and not (code in groups.SPLINES and is_spline(letters)):
                continue
            if code not in rules.g_groups:
                unknown.append(code)
                continue
            enter(g, rules.g_groups[code], word, code, rules)
        elif code in rules.m_groups:
            enter(m, rules.m_groups[code], word, code, rules)
        elif rules.strict:  # elsewhere one that is not known changes no coordinates
            raise Fault(UNKNOWN_M, f"M{code / 10:g} is not a code of LinuxCNC", span=word.span)
    if rules.strict and sum(word.address == "M" for word, _ in pairs) > MAX_M_CODES:
        raise Fault(CONFLICT, f"more than {MAX_M_CODES} M codes in a block", span=pairs[-1][0].span)
    if not rules.strict and g.get(groups.SYSTEM) == FIRST_SYSTEM and "P" in letters:
        free = P_USERS.isdisjoint((*g.values(), *m.values())) and not has_own(g, m, rules)
        g[groups.SYSTEM] = EXTENDED_SYSTEM if free else FIRST_SYSTEM
    return Codes(
        g,
        m,
        steps_of(g, m, letters, rules),
        g.get(groups.MOTION),
        m.get(groups.STOP),
        m.get(groups.CALL),
        named or any(takes_axes(code, rules) for code in g.values()),
        tuple(unknown),
    )


def has_own(g: Mapping[str, int], m: Mapping[str, int], rules: Rules) -> bool:
    """Whether a block has codes of the dialect's own, which may use any word."""
    written = {*(("G", code) for code in g.values()), *(("M", code) for code in m.values())}
    return not rules.operations.keys().isdisjoint(written) or not rules.tables.keys().isdisjoint(g.values())


def check_words(plan: RS274Plan, codes: Codes, motion: int | None, rules: Rules) -> None:
    """Raise `Fault` for a word that no code of the block uses, if the control does."""
    if not rules.strict or motion in plan.checked or motion in rules.tables or has_own(codes.g, codes.m, rules):
        return
    letter = groups.unused_word(plan.letters, motion, frozenset(codes.g.values()), frozenset(codes.m.values()))
    if letter is not None:
        raise Fault(UNUSED, f"no code of the block uses the word {letter}", span=plan.span_of(letter))
    if plan.codes is not None:
        plan.checked.add(motion)


def takes_axes(code: int, rules: Rules) -> bool:
    """Whether a G code uses the axis words of its block itself."""
    own = ("G", code) in rules.operations or code in rules.tables
    return code in rules.takes or (code in AXES_TAKEN and not own)


def is_spline(letters: frozenset[str]) -> bool:
    """Whether a block with G5 or G5.1 is a spline, as in LinuxCNC and Marlin: with points besides its end."""
    return not letters.isdisjoint("IJ") and not letters.isdisjoint(INDEX)


def enter(codes: dict[str, int], group: str, word: Word, code: int, rules: Rules) -> None:
    """Enter a code in its group; raises `Fault` if there is one already (LinuxCNC: even the same). G80 gives way."""
    if group == groups.MOTION and NO_MOTION in (codes.get(group), code):
        codes[group] = code if codes.get(group, NO_MOTION) == NO_MOTION else codes[group]
        return
    if group in codes and (rules.strict or codes[group] != code):
        first, second = (f"{word.address}{number / 10:g}" for number in (codes[group], code))
        raise Fault(CONFLICT, f"{first} and {second} exclude one another (both set the {group})", span=word.span)
    codes[group] = code


def lane_of(plan: RS274Plan) -> Lane | None:
    """The plan in the fast lane's form; None unless the block is only a straight motion or arc in plain numbers."""
    codes, slots = plan.codes, dict(plan.literals)
    if codes is None or codes.m or codes.unknown or not codes.g.keys() <= {groups.MOTION} or not is_plain(plan):
        return None
    lane = Lane(
        tuple((INDEX[letter], slot) for letter, slot in plan.literals if letter in INDEX),
        slots.get("F", -1),
        -1 if codes.motion is None else codes.motion,
        (slots.get("I", -1), slots.get("J", -1), slots.get("K", -1)),
        slots.get("R", -1),
    )
    if not lane.turns:
        return lane if lane.motion in (-1, 0, 10) else None
    ambiguous = lane.radius >= 0 and max(lane.centre) >= 0
    return None if ambiguous or lane.motion not in (-1, 20, 30) else lane


def is_plain(plan: RS274Plan) -> bool:
    """Whether a block has only motion words with plain numbers, and no coordinate lacks a decimal point."""
    if plan.fixed or plan.unread or plan.command or plan.unknown_text or plan.computed:
        return False
    if not plan.letters <= LANE_LETTERS | ARC_LETTERS:
        return False
    points = PLACES.isdisjoint(plan.pointless)
    return points and all(isinstance(item, Word | Comment | Opaque) for item in plan.template.items)
