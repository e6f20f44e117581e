"""Writes the blocks of a program of the RS274 family as they are executed, for a flat program.

A block of plain words is kept, without its number. Expressions are replaced by their values, rounded to the least
increment (in increments the rest is carried to the next block). Assignments, flow control and calls are removed. The
holes of a cycle with increments or repeats get a block each, in absolute coordinates.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from ncfix.control.coordinates import CENTRE_LETTERS, INDEX, LETTERS, Vector, X, Y, mask_of
from ncfix.control.expressions import Fault, nominal
from ncfix.control.flatten import Change, Flattener
from ncfix.control.interpreter import RUNTIME, TextUnit
from ncfix.text.spelling import Spelling, decimals_for
from ncfix.text.tree import Assignment, Comment, Constant, Literal, NumberedParameter, Opaque, Word
from ncfix_iso.rs274.control import POLAR, RUNTIME_BRANCH, Block, RS274Control
from ncfix_iso.rs274.cycles import PATTERN_WORDS, repeat_letters
from ncfix_iso.rs274.plans import Codes, RS274Plan

DROPPED_CODES = {"G": frozenset({150, 160, 670}), "M": frozenset({970, 980, 990, 1980})}
"""Codes, in tenths, that a flat program does not need."""

SCALING = frozenset({500, 510})
"""Codes whose other words it does not need either."""

CALL_WORDS = frozenset("PLQ")
KEPT = frozenset({"program name", "control character", "command"})
"""Kinds of opaque text that a flat program keeps."""

COMPUTED_CALL = (
    "a macro that ncfix does not have is called with calculated values, so the program cannot be written out flat"
)
OTHER_DECIMALS, VARIABLE_DECIMALS = 4, 6
PLAIN = Spelling()
LENGTHS = frozenset((*CENTRE_LETTERS, "R", "Q"))


class RS274Flattener(Flattener):
    """See `Flattener`.

    carry   axis letter -> rest left over by rounding, program units
    headed  whether a program number has been written
    plan, codes, values  of the block that has been executed
    """

    with_blank = True
    plan: RS274Plan
    codes: Codes
    values: Block

    def __init__(self, control: RS274Control, steps: Mapping[str, float], limit: int) -> None:
        super().__init__(steps, limit)
        self.control = control
        self.carry: dict[str, float] = {}
        self.headed = False

    # -- what the interpreter tells -----------------------------------------------------------------------------------

    def whole(self, unit: TextUnit[RS274Plan], block: int) -> None:
        """Write a block unchanged."""
        self.watch(unit, block)
        self.write(unit.program.text_of(block))

    def head(self, unit: TextUnit[RS274Plan], block: int, keyword: str) -> None:
        """Write the number of the main program; other program numbers and all flow control are removed."""
        if keyword == "program" and not self.headed and not unit.external:
            self.headed = True
            self.whole(unit, block)

    def stretch(self, unit: TextUnit[RS274Plan], start: int, count: int) -> None:
        """Write blocks of plain words."""
        for block in range(start, start + count):
            self.watch(unit, block)
            self.put([self.dropped(word) for word in self.template_words() if word.address == "N"])

    def call(self, unit: TextUnit[RS274Plan], block: int) -> None:
        """Write the call of a macro that is in the control: unchanged, without its number.

        Raises `Fault` if arguments are computed, because the assignments that they depend on are removed.
        """
        self.watch(unit, block)
        if any(not isinstance(word.value, (Literal, Constant)) for word in self.template_words()):
            raise Fault(RUNTIME, COMPUTED_CALL)
        self.put([self.dropped(word) for word in self.template_words() if word.address == "N"])

    def template_words(self) -> tuple[Word, ...]:
        """The words of the block as written."""
        return self.unit.program.template_of(self.block).words

    def words(self, unit: TextUnit[RS274Plan], index: int, plan: RS274Plan, codes: Codes, block: Block) -> None:
        """Write a block of words that has been executed."""
        self.watch(unit, index)
        self.plan, self.codes, self.values = plan, codes, block
        self.check()
        if self.control.left_out:
            self.put([self.dropped(word) for word in self.template_words() if not is_setting(word)])
            self.control.left_out = False
            return
        holes, self.control.ends = self.control.ends or [], []
        if self.control.pattern:
            self.pattern(self.control.pattern, holes)
            self.control.pattern = 0
            return
        made = [*self.changes(), *self.absent()]
        motion = self.control.modal.motion if codes.motion is None else codes.motion
        drills = holes and motion in self.control.rules.cycles and not codes.takes
        polar = bool(block.values.keys() & POLAR)
        if drills and (polar or len(holes) > 1 or self.control.modal.incremental):
            self.cycle(made, holes)
        elif polar:
            self.polar(made)
        else:
            self.put(made)

    def polar(self, changes: list[Change]) -> None:
        """Write a block with polar words, with X and Y of its end, absolute."""
        incremental, block = self.control.modal.incremental, self.values
        words = [
            word
            for word in self.template_words()
            if word.address in POLAR or word.address in INDEX or (incremental and is_distance(word))
        ]
        stop = self.end_of_words()
        if incremental or not {"@", "^"} <= block.values.keys():
            self.must_stand(mask_of((X, Y)))
        others = "".join(x for x in LETTERS if x in self.steps and (x in "XY" or block.axes >> INDEX[x] & 1))
        text = (" G90" if incremental else "") + self.place(self.control.position, others)
        self.put([*self.without(words, changes), Change(stop, stop, text)])
        if incremental:
            self.write("G91")

    def must_stand(self, axes: int) -> None:
        """Raise `Fault` if an absolute word would be needed for an axis that the program has not placed."""
        unplaced = self.control.places.unplaced & axes
        index = next((index for index in self.control.axis_indices if unplaced >> index & 1), None)
        if index is not None:
            what = f"the program has not yet given the position of the axis {LETTERS[index]}"
            raise Fault(RUNTIME, f"{what}, so it cannot be written out flat")

    def check(self) -> None:
        """Raise `Fault` if the values of a block depend on the machine at run time."""
        block, why = self.values, self.control.unwritten
        if not why and (block.unknown or self.control.refusal == RUNTIME_BRANCH):
            what = f"the word {min(block.unknown)}" if block.unknown else "which blocks are executed"
            why = f"{what} is known only at run time"
        if why:
            raise Fault(RUNTIME, f"{why}, so the program cannot be written out flat")

    # -- items --------------------------------------------------------------------------------------------------------

    def opaque(self, item: Opaque) -> Change | None:
        """See `Flattener`."""
        return None if item.kind in KEPT else self.dropped(item)

    def assignment(self, item: Assignment) -> Change:
        """Remove it, unless the control acts on the parameter (offsets, for example) or keeps it after the program."""
        target, rules = item.target, self.control.rules
        if isinstance(target, NumberedParameter) and isinstance(target.index, Literal):
            number = round(float(self.unit.program.values_of(self.block)[target.index.slot]))
            if rules.system(number) or rules.lasting(number):
                return self.replaced(item.span, f"#{number}={self.value_of(number)}")
        return self.dropped(item)

    def value_of(self, number: int) -> str:
        """The value of a parameter as text; raises `Fault` if it depends on the machine at run time."""
        parameters = self.control.parameters
        if parameters.is_unknown(number):
            what = f"the value of #{number}"
            raise Fault(RUNTIME, f"{what} is known only at run time, so the program cannot be written out flat")
        value = nominal(parameters.numbered(number))
        return "#0" if math.isnan(value) else PLAIN.short(value, VARIABLE_DECIMALS)

    def word(self, word: Word) -> Change | None:
        """The change to a word; None if it stays."""
        letter, values = word.address, self.values.values
        called = not DROPPED_CODES["M"].isdisjoint(self.codes.m.values())
        if letter in "GM":
            return self.code(word)
        if letter == "N" or (called and letter in CALL_WORDS) or letter not in values:
            return self.dropped(word)
        if isinstance(word.value, Literal) and not self.is_changed(word, word.value):
            return None
        return self.replaced(word.value_span, self.number(letter, values[letter]))

    def is_changed(self, word: Word, number: Literal) -> bool:
        """Whether the value of a plain word differs from what is written (polar coordinates)."""
        if number.pointless:
            return word.address in "XYZ" and "polar" in self.control.suspended
        return bool(self.unit.program.values_of(self.block)[number.slot] != self.values.values[word.address])

    def code(self, word: Word) -> Change | None:
        """The change to a G or M word; None if it stays."""
        if isinstance(word.value, Constant):
            dropped = round(10 * word.value.value) in DROPPED_CODES[word.address]
            return self.dropped(word) if dropped else None
        value = nominal(self.control.rules.compiled(word.value, word.address)(self.control))
        return self.dropped(word) if math.isnan(value) else self.replaced(word.value_span, f"{value:g}")

    def absent(self) -> list[Change]:
        """Words that a block implies and does not have: the other coordinate of a polar one."""
        values = self.values.values
        letters = [letter for letter in values if letter not in self.plan.letters and letter in "XYZ"]
        stop = self.end_of_words()
        return [Change(stop, stop, " " + letter + self.number(letter, values[letter])) for letter in letters]

    # -- numbers ------------------------------------------------------------------------------------------------------

    def number(self, letter: str, value: float) -> str:
        """A value as text; a coordinate is rounded to the least increment, and the rest is carried."""
        if letter not in self.steps:
            decimals = self.decimals("X") if letter in LENGTHS else OTHER_DECIMALS
            return PLAIN.short(value, decimals)
        carried = value + (self.carry.get(letter, 0.0) if self.control.modal.incremental else 0.0)
        text = PLAIN.short(carried, self.decimals(letter))
        self.carry[letter] = carried - float(text)
        return text

    def decimals(self, letter: str) -> int:
        """Number of decimals that the least increment needs."""
        unit = 1.0 if letter in INDEX and self.control.rotary[INDEX[letter]] else self.control.modal.unit
        return decimals_for(self.steps.get(letter, min(self.steps.values())) / unit)

    # -- cycles -------------------------------------------------------------------------------------------------------

    def cycle(self, changes: list[Change], holes: list[Vector]) -> None:
        """Write the holes of a block, one block each, in absolute coordinates."""
        code = self.control.modal.motion if self.codes.motion is None else self.codes.motion
        drop = [word for word in self.template_words() if is_place(word, self.control, code)]
        stop = self.end_of_words()
        incremental = self.control.modal.incremental
        level = self.control.modal.cycle.level / self.control.modal.unit
        over, depth = self.letters_of_holes(self.values)
        mode = " G90" if incremental or any(is_distance(word) for word in drop) else ""
        first = (
            mode
            + self.place(holes[0], over + depth)
            + f" {self.control.dialect.cycle_of(code).level}"
            + self.number_at("R", level)
        )
        self.put([*self.without(drop, changes), Change(stop, stop, first)])
        for hole in holes[1:]:
            self.write(self.place(hole, over).strip())
        if incremental:
            self.write("G91")

    def pattern(self, code: int, holes: list[Vector]) -> None:
        """Write the holes of a pattern code, one block each, after the other words of its block."""
        words = self.template_words()
        own = [word for word in words if isinstance(word.value, Constant) and round(10 * word.value.value) == code]
        taken = {*PATTERN_WORDS, "N"}
        self.put([self.dropped(word) for word in words if word in own or word.address in taken])
        for hole in holes:
            self.write(self.place(hole, "XY").strip())

    def letters_of_holes(self, block: Block) -> tuple[str, str]:
        """The letters that position a hole in the plane, and further ones that the first hole needs, its depth last.

        Raises `Fault` if an increment would have to become a word for an axis that the program has not placed.
        """
        plane = self.control.modal.plane
        if self.control.modal.incremental:
            self.must_stand(block.axes | 1 << plane.across)
        unplaced = self.control.places.unplaced & ~block.axes
        known = [i for i in plane.pair if not unplaced >> i & 1]
        over = "".join(LETTERS[i] for i in known if LETTERS[i] in self.steps)
        across = LETTERS[plane.across]
        named = "".join(x for x in LETTERS if block.axes >> INDEX[x] & 1 and x in self.steps and x not in over)
        return over, named.replace(across, "") + across

    def place(self, hole: Vector, letters: str) -> str:
        """The words of a hole for some letters, as text."""
        control = self.control
        position, control.position = control.position, hole
        program = control.program_position()
        control.position = position
        values = {letter: program[INDEX[letter]] / control.scale[INDEX[letter]] for letter in letters}
        return "".join(f" {letter}{self.number_at(letter, value)}" for letter, value in values.items())

    def number_at(self, letter: str, value: float) -> str:
        """An absolute value as text."""
        self.carry[letter] = 0.0
        return PLAIN.short(value, self.decimals(letter if letter in self.steps else "Z"))

    # -- lines --------------------------------------------------------------------------------------------------------

    def without(self, words: list[Word], changes: list[Change]) -> list[Change]:
        """The changes of a block, with some words removed."""
        spans = {self.unit.program.span(self.block, word.span) for word in words}
        return [change for change in changes if not inside(change, spans)] + list(map(self.dropped, words))

    def end_of_words(self) -> int:
        """The place for further words of a block: after its last word, before a comment."""
        program = self.unit.program
        items = [item for item in program.items_of(self.block) if not isinstance(item, Comment)]
        ends = (program.span(self.block, item.span)[1] for item in items)
        return max(ends, default=int(program.blocks[self.block, 0]))

    def put(self, changes: list[Change]) -> None:
        """Write a block with changes made, unless nothing is left of it."""
        text = self.text(changes)
        if text.strip() or not (changes or text):
            self.write(text.strip() if changes else text)


def is_setting(word: Word) -> bool:
    """Whether a word stays although its block is left out of a flat program: another code, F, S or T."""
    scaling = isinstance(word.value, Constant) and round(10 * word.value.value) in SCALING
    return word.address in "GMFST" and not (word.address == "G" and scaling)


def is_distance(word: Word) -> bool:
    """Whether a word is G90 or G91."""
    return word.address == "G" and isinstance(word.value, Constant) and word.value.value in (90.0, 91.0)


def is_place(word: Word, control: RS274Control, code: int) -> bool:
    """Whether a word of a cycle gives the place or number of its holes, or the mode: such words are written anew."""
    if word.address in "GM":
        return is_distance(word)
    placed = word.address in INDEX or word.address in POLAR or word.address == control.dialect.cycle_of(code).level
    return placed or word.address in repeat_letters(control, code)


def inside(change: Change, spans: set[tuple[int, int]]) -> bool:
    """Whether a change lies within a removed span."""
    return any(start <= change.start and change.stop <= stop for start, stop in spans)
