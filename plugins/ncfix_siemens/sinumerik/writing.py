"""The writer of SINUMERIK blocks: polar words, senses of rotation, CIP and cycle calls; and the layout of a block.

A hole with a corrected depth gets its own modal cycle call before its motion, behind number and label of the block.
After the hole the original call is restored, so that later holes have their depth. A cycle called where the axes stand,
but corrected sideways, becomes a modal call with a motion to the corrected place. A milling cycle that names its place
gets other arguments.

`SinumerikLayout` tells which words of a motion block may be rewritten, and where a missing word is inserted.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

import numpy as np

from ncfix.arrays import Array, Mask
from ncfix.control.moves import CycleCall
from ncfix.text.layout import (
    CENTRE_LETTERS,
    CODES_AFTER_MOTION,
    EXACT_STOP,
    FEED_MODES,
    MOTION_CODES,
    BlockWords,
    Layout,
)
from ncfix.text.spelling import Spelling
from ncfix.text.tree import (
    START,
    Anchor,
    Command,
    Comment,
    Constant,
    FunctionCall,
    Item,
    Opaque,
    OWordLine,
    Program,
    Skip,
    Span,
    Tape,
    Word,
)
from ncfix.values import frozen
from ncfix.writer.block import BlockWriter
from ncfix.writer.target import LINE, TANGENTIAL, Target
from ncfix_siemens.sinumerik.circles import VIA, circle_through
from ncfix_siemens.sinumerik.cycles.milling import MILLING
from ncfix_siemens.sinumerik.destination import turned
from ncfix_siemens.sinumerik.scanning import has_partial
from ncfix_siemens.sinumerik.vocabulary import (
    ANGLES,
    DRILLING,
    FORM,
    FORMS,
    HARMLESS,
    INCREMENTAL,
    MOTIONS,
    POLAR,
    RFP,
    RTP,
    SDIS,
    TURNING,
    VECTOR,
)

SPELLING = Spelling(vector=tuple(f"{address}=" for address in VECTOR), vector_digits=7)
BARE = Spelling(point=False)
OTHER_DECIMALS = 5
"""Decimals of words that are no axes."""
ARGUMENT_DECIMALS = 9
"""Decimals of unchanged arguments, enough to reproduce a computed depth."""

CIP = MOTIONS["cip"]
ARCS = frozenset({20, 30})
RAPID = 0

PLAIN = re.compile(r"\s*[-+]?(?:\d+\.?\d*|\.\d+)\s*")
CYCLE = re.compile(r"(?P<name>\w+)\s*\((?P<arguments>.*)\)", re.DOTALL)
ENDS_HERE = "the hole needs a line after it, but the subprogram ends in its block"

END_OF_SUBPROGRAM = frozenset({17.0})
"""M17."""


class SinumerikWriter(BlockWriter):
    """Writes one motion or hole into one block. across: column of the drilling axis of a hole, else -1."""

    layout: SinumerikLayout

    def __init__(
        self, program: Program, block: int, layout: SinumerikLayout, target: Target, spelling: Spelling
    ) -> None:
        super().__init__(program, block, layout, target, spelling)
        self.across = -1 if target.call is None else target.letters.index(target.call.across)
        if target.call is not None:  # a word along the drilling axis is the approach height, and stays
            self.columns = [each for each in self.columns if each[0] != self.across]

    def _write(self) -> None:
        if self.target.call is None:
            super()._write()
        else:
            self._hole(self.target.call)

    # -- axes ---------------------------------------------------------------------------------------------------------

    def _first_piece(self, position: Array, end: Array) -> Array:
        if not self.layout.polar:
            return super()._first_piece(position, end)
        if self._polar_stays(end):
            first = super()._first_piece(position, np.where(self._polar_columns(), position, end))
            return np.where(self._polar_columns(), self.target.nominal, first)
        for word in self.layout.polar.values():
            self._remove(word)
        position = super()._first_piece(position, end)
        if not self.added and not self.layout.axes:
            self._name_a_place(position)
        return position

    def _polar_stays(self, end: Array) -> bool:
        if self.layout.partial_polar or self.target.code in ARCS:
            return False
        near = np.abs(end - self.target.nominal) < self.half
        return len(self.target.ends) == 1 and bool(near[self._polar_columns()].all())

    def _polar_columns(self) -> Mask:
        """Mask of the X, Y, Z columns without a word in a block with polar coordinates."""
        free = [column for column, letter in self.columns if letter in "XYZ" and letter not in self.layout.axes]
        return np.isin(np.arange(len(self.half)), free)

    def _meant(self, column: int, word: Word, *, increment: bool) -> float:
        """As of every writer; a formula in IC is always replaced by a number (NaN: not kept)."""
        formed = self.layout.forms.get(word.address) == INCREMENTAL
        return math.nan if formed else super()._meant(column, word, increment=increment)

    def _arrive(self, position: Array, column: int, start: float, end: float, word: Word) -> None:
        """Write IC instead of DC, ACP or ACN if these would turn a rotary axis the other way."""
        form = self.layout.forms.get(word.address, "")
        if form not in TURNING:
            return
        angle, known = float(position[column]), math.isfinite(start)
        arrival = math.degrees(turned(form, math.radians(start), math.radians(angle), known=known))
        if abs(arrival - angle) > 180.0:
            whole = self.layout.formed[word.address]
            self._take_back(whole)
            text = self.spelling.number(end - start, int(self.target.decimals[column]))
            name = "".join(map(self._cased, INCREMENTAL.upper()))
            self.out.edits.append((*self.program.span(self.block, whole), f"{name}({text})"))
            position[column] = start + float(text)

    # -- codes and arcs -----------------------------------------------------------------------------------------------

    def _motion_code(self) -> None:
        wanted, word = self.code, self.layout.motion
        if word is None and wanted != self.target.code:
            self._put_code(f"{wanted // 10}")
        elif word is not None and word.address != "G" and wanted != CIP:
            self.out.edits.append((*self.program.span(self.block, word.span), self._cased("G") + f"{wanted // 10}"))
        elif wanted == CIP and word is None and self.target.active_code != CIP:
            at = self.program.position(self.block, self.layout.code_at)
            self.out.edits.append((at, at, "CIP "))
        else:
            super()._motion_code()

    def _arc_words(self, start: Array, end: Array) -> None:
        if self.target.arc and self.layout.via:
            self._via(start, end)
            return
        for word in (*self.layout.via.values(), self.layout.angle):
            self._remove(word)
        super()._arc_words(start, end)

    def _has_centre(self) -> bool:
        other = self.layout.angle is not None or self.layout.polar or self.target.code in TANGENTIAL
        return not other and super()._has_centre()

    def _via(self, start: Array, end: Array) -> None:
        """Write the intermediate point of CIP, shifted like the ends in proportion to its distance from them."""
        target, words = self.target, self.layout.via
        begin, finish = self._xyz(start), self._xyz(end)
        nominal_end, via = self._xyz(target.nominal), target.origin.copy()
        for index, address in enumerate(VIA):
            if address in words:
                from_start = self._is_incremental(words[address])
                via[index] = self._value(words[address], np.nan) + (target.origin[index] if from_start else 0.0)
        known = np.where(np.isfinite(via), via, target.origin)
        before, after = (float(np.linalg.norm(arm)) for arm in (known - target.origin, nominal_end - known))
        share = before / max(before + after, 1e-9)
        wanted = known + (1 - share) * (begin - target.origin) + share * (finish - nominal_end)
        for index, address in enumerate(VIA):
            if target.spatial[index] >= 0:
                wanted[index] = self._via_word(address, index, float(wanted[index]), float(begin[index]))
        circle = circle_through(tuple(begin), tuple(wanted), tuple(finish))
        self.out.centre = np.array(circle.centre)

    def _via_word(self, address: str, index: int, wanted: float, begin: float) -> float:
        """Write one word of the intermediate point; returns the value that the control will read."""
        column, word = self.target.spatial[index], self.layout.via.get(address)
        digits, half = int(self.target.decimals[column]), self.half[column]
        base = begin if (self.incremental if word is None else self._is_incremental(word)) else 0.0
        if word is not None:
            written = self._value(word, np.nan)
            near = np.isfinite(written) and abs(written - (wanted - base)) < half
            return base + (written if near else self._rewrite(word, wanted - base, digits))
        if abs(wanted - begin) < half:
            return begin
        text = self.spelling.number(wanted - base, digits)
        self.added.append(f"{self.layout.blank or ' '}{address}={text}")
        return base + float(text)

    def _is_incremental(self, word: Word) -> bool:
        form = self.layout.forms.get(word.address, "")
        return form == INCREMENTAL or (not form and self.incremental)

    # -- holes --------------------------------------------------------------------------------------------------------

    def _hole(self, call: CycleCall) -> None:
        """Write a hole: the words that lead to it, and a cycle call with a corrected depth."""
        across, target = self.across, self.target
        off = float(target.ends[0][across] - target.nominal[across])
        if abs(off) < self.half[across]:
            off = 0.0
        arguments, sunk = shifted(call, off, int(target.decimals[across]))
        if call.bound or self._is_inside_out(call, sunk):
            arguments, sunk = None, 0.0
        if call.points or call.led:
            position = self._placed(call, arguments)
        else:
            position = self._led_to(call, arguments) if call.modal else self._called(call, arguments)
        position[across] = target.nominal[across] + sunk
        self.out.ends.append(position)

    def _placed(self, call: CycleCall, arguments: list[str] | None) -> Array:
        """Write a cycle that names its place: the arguments of place and depth."""
        target, position = self.target, self.target.start.copy()
        for column in map(target.letters.index, call.led):
            position[column] = target.ends[0][column]
        changed = {} if arguments is None else {place: arguments[place] for place, _ in call.depths}
        for place, letter in call.points:
            column = target.letters.index(letter)
            position[column] = target.nominal[column]
            off = float(target.ends[0][column] - target.nominal[column])
            if abs(off) >= self.half[column]:
                value = number_of(call, place)
                changed[place] = BARE.short(value + off, int(target.decimals[column]))
                position[column] = target.nominal[column] + float(changed[place]) - value
        if changed:
            assert self.layout.cycle is not None
            text = with_arguments(self.program.slice(self.block, self.layout.cycle), changed)
            self.out.edits.append((*self.program.span(self.block, self.layout.cycle), text))
        return position

    def _led_to(self, call: CycleCall, arguments: list[str] | None) -> Array:
        """Write a hole of a modal cycle: the words of its motion, between a corrected call and the original one."""
        if arguments is not None:
            self._check(call)
            at, line_end = self.program.position(self.block, self.layout.begins), self.program.line_end.decode()
            opening = f"MCALL {call.name}({','.join(arguments)}){line_end}{self._apart()}"
            self.out.edits.append((at, at, opening))  # first, so that a word taken out keeps the blank before it
            self.out.opens = True
            self.out.closing = f"{self._apart()}MCALL {call.name}({','.join(map(argument, call.arguments))})"
        return self._first_piece(self.target.start.copy(), self.target.ends[0])

    def _check(self, call: CycleCall) -> None:
        """Set a conflict if no lines may be inserted before and after the block."""
        codes = (self._value(word, np.nan) for word in self.layout.after)
        ends = ENDS_HERE if END_OF_SUBPROGRAM.intersection(codes) else ""
        self.out.conflict = self.out.conflict or call.fixed or ends

    def _is_inside_out(self, call: CycleCall, sunk: float) -> bool:
        """Whether a hole sunk by `sunk` would end on the other side of the reference plane (RFP); or, if RFP moves with
        it, whether it would rise above the retraction plane (RTP).
        """
        first = int(bool(call.led))  # behind the name of a contour
        if (first + RFP, 1) in call.depths:
            clear, start, gap = (number_of(call, first + place) for place in (RTP, RFP, SDIS))
            return sunk > max(clear - start - gap, 0.0)
        reference = call.arguments[RFP] if len(call.arguments) > RFP else None
        nominal = float(self.target.nominal[self.across])
        return isinstance(reference, float) and (nominal - reference) * (nominal + sunk - reference) <= 0.0

    def _called(self, call: CycleCall, arguments: list[str] | None) -> Array:
        """Write a cycle called where the axes stand; if the hole is shifted, a modal call and a motion of its own."""
        target, position = self.target, self.target.start.copy()
        for column, _ in self.columns:
            if self._may_add(column):
                self._absent_axis(position, column, target.ends[0][column])
        if arguments is None and not self.added:
            return position
        self._check(call)
        assert self.layout.cycle is not None
        text = self.program.slice(self.block, self.layout.cycle)
        if arguments is not None:
            text = with_arguments(text, {place: arguments[place] for place, _ in call.depths})
        if self.added:
            text, led = f"MCALL {text}", "".join(self.added).strip()
            if target.active_code != RAPID and (target.active_code != LINE or target.inverse_time):
                led, self.out.code = f"G0 {led}", RAPID
            self.out.lines += [self._apart() + led, self._apart() + "MCALL"]
            self.added.clear()
        self.out.edits.append((*self.program.span(self.block, self.layout.cycle), text))
        return position

    def _apart(self) -> str:
        return self.prefix and f"{self.prefix} "


def shifted(call: CycleCall, off: float, decimals: int) -> tuple[list[str] | None, float]:
    """The arguments, as text, of a call whose hole ends higher by `off`; and the exact shift after rounding.

    (None, 0.0) if nothing changes.
    """
    (first, sense), *_ = call.depths
    value = number_of(call, first)
    shown = BARE.short(value + sense * off, decimals)
    sunk = sense * (float(shown) - value) if off else 0.0
    if sunk == 0.0:
        return None, 0.0
    arguments = [argument(value) for value in call.arguments]
    for place, sense in call.depths:
        arguments[place] = BARE.short(number_of(call, place) + sense * sunk, decimals)
    return arguments, sunk


def argument(value: float | str | None) -> str:
    """The text of an argument."""
    if value is None:
        return ""
    return f'"{value}"' if isinstance(value, str) else BARE.short(value, ARGUMENT_DECIMALS)


def number_of(call: CycleCall, place: int) -> float:
    """An argument that is a number."""
    value = call.arguments[place]
    assert isinstance(value, float)
    return value


def with_arguments(text: str, changed: Mapping[int, str]) -> str:
    """The text of a call with some arguments replaced (index -> number), in the style of its own numbers."""
    found = CYCLE.fullmatch(text)
    assert found is not None
    parts = in_parts(found["arguments"])
    for place, number in changed.items():
        part = parts[place]
        blank = part[: len(part) - len(part.lstrip())]
        value, decimals = float(number), len(number.partition(".")[2])
        shown = SPELLING.like(part, value, decimals) if PLAIN.fullmatch(part) else SPELLING.instead(value, decimals)
        parts[place] = blank + shown
    start, stop = found.span("arguments")
    return text[:start] + ",".join(parts) + text[stop:]


def in_parts(text: str) -> list[str]:
    """The text of arguments, split at commas outside brackets and quotes."""
    parts, depth, quoted = [""], 0, False
    for letter in text:
        quoted ^= letter == '"'
        if not quoted:
            depth += (letter in "([") - (letter in ")]")
        if letter == "," and depth == 0 and not quoted:
            parts.append("")
        else:
            parts[-1] += letter
    return parts


# -- where things stand in a motion block of SINUMERIK -----------------------------------------------------------------


@frozen(kw_only=True)
class SinumerikLayout(Layout):
    """The writable parts of a motion block.

    formed  address -> span of the whole value of a word with a form, such as `IC(10)`
    via     I1 J1 K1 by address
    angle   the word AR
    polar   AP and RP by address
    partial_polar  some blocks of the program use AP or RP of an earlier block
    cycle   span of the call of a drilling or milling cycle, if the block holds nothing else
    begins  start of its words, after block skip, number and label
    """

    formed: dict[str, Span]
    via: dict[str, Word]
    angle: Word | None
    polar: dict[str, Word]
    partial_polar: bool
    cycle: Span | None
    begins: Anchor

    @property
    def points(self) -> bool:
        """Whether the block gives the direction of the tool by a vector or angles."""
        return bool(self.vector or self.angles)


def layout_of(program: Program, block: int) -> SinumerikLayout | None:
    """The layout of a motion block; None for control structures, calls, and blocks not understood."""
    words = BlockWords(program, block)
    cycle = drilling_call(words)
    if cycle is None and not all(
        (isinstance(each, Command) and is_quiet(each)) or may_stay(each) for each in words.items
    ):
        return None
    numbered = [word for word in words.words if word.address not in ("N", ":")]
    anchors = list(words.axes.values()) or numbered or words.words
    content = [item.span for item in words.items if not is_prefix(item)]
    if not (anchors or cycle) or not content:
        return None
    words_at, code_at, blank = words.beside(anchors) if anchors else (content[0].stop, content[0].start, " ")
    polar = words.some(sorted(POLAR))
    formed = {word.address: word for word in words.words if form_of(word)}

    def bare(some: dict[str, Word]) -> dict[str, Word]:
        return {address: without_form(program, block, word) for address, word in some.items()}

    return SinumerikLayout(
        axes=bare(words.axes),
        forms={address: form_of(word) for address, word in formed.items()},
        formed={address: word.value_span for address, word in formed.items()},
        centre=bare(words.some(CENTRE_LETTERS)),
        radius=words.by_address.get("CR"),
        turns=words.by_address.get("TURN"),
        feed=words.by_address.get("F"),
        motion=words.g_code(MOTION_CODES) or named_motion(program, block),
        feed_mode=words.g_code(FEED_MODES),
        after=(*words.coded("M", CODES_AFTER_MOTION | END_OF_SUBPROGRAM), *words.coded("G", EXACT_STOP)),
        words_at=words_at,
        code_at=code_at,
        blank=blank,
        prefix=words.skip,
        via=bare(words.some(VIA)),
        angle=words.by_address.get("AR"),
        polar=polar,
        partial_polar=bool(polar) and has_partial(program),
        vector=words.some(VECTOR),
        angles=words.some(ANGLES),
        cycle=cycle,
        begins=min((span.start for span in content), key=lambda anchor: program.position(block, anchor)),
    )


def form_of(word: Word) -> str:
    """The form of a word, `ac`, `ic`, `dc`, ...; "" if it has none."""
    return word.value.name if isinstance(word.value, FunctionCall) and word.value.name in FORMS else ""


def without_form(program: Program, block: int, word: Word) -> Word:
    """A word with the value inside the brackets of its form: `X=IC(10)` as `X=10`."""
    start, stop = program.span(block, word.value_span)
    found = FORM.match(program.source[start:stop].decode("latin-1")) if form_of(word) else None
    if found is None or not isinstance(word.value, FunctionCall):
        return word
    first, last = (start - int(program.blocks[block, 0]) + place for place in found.span("value"))
    value = word.value.arguments[0] if word.value.arguments else None
    span = Span(Anchor(START, first), Anchor(START, last))
    return word if value is None else Word(word.address, value, word.span, span)


def drilling_call(words: BlockWords) -> Span | None:
    """Span of the call of a drilling or milling cycle, if the block holds nothing else but number and comment."""
    items = [item for item in words.items if not (is_prefix(item) or isinstance(item, Comment))]
    match items:
        case [Command(name) as call] if name in DRILLING or name in MILLING:
            return call.span
    return None


def is_prefix(item: Item) -> bool:
    """Block skip, block number, or label."""
    numbered = isinstance(item, Word) and item.address in ("N", ":")
    return numbered or isinstance(item, Skip) or (isinstance(item, OWordLine) and item.keyword == "label")


def is_quiet(item: Command) -> bool:
    """Whether a name neither calls a program nor changes coordinates."""
    return item.name in HARMLESS | {"cycle832"} or item.name in MOTIONS or item.name.startswith("ori")


def may_stay(item: object) -> bool:
    """Whether a block with this item may be rewritten."""
    if isinstance(item, OWordLine):
        return item.keyword == "label"
    return not isinstance(item, (Command, Opaque, Tape))


def named_motion(program: Program, block: int) -> Word | None:
    """CIP or another name in the group of G0 to G3, as a word."""
    for item in program.items_of(block):
        if isinstance(item, Command) and item.name in MOTIONS:
            return Word(item.name.upper(), Constant(MOTIONS[item.name] / 10), item.span, item.span)
    return None
