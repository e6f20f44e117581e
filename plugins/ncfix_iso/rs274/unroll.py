"""Blocks of the RS274 family written down as they are executed, for a flat program.

A block of plain words goes out as it stands, without its number. Expressions give way to their values, rounded to the
least increment (in increments the rest is carried to the next block), assignments, flow control and calls fall away,
and the holes of a cycle with increments or repeats get a block each, in absolute coordinates.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ncfix.control.coordinates import CENTRE_LETTERS, INDEX, LETTERS, Vector, X, Y
from ncfix.control.faults import Fault
from ncfix.control.flat_lines import Change, FlatLines, changed
from ncfix.control.flatten import RUNTIME, FlatLine
from ncfix.control.places import mask_of
from ncfix.diagnostics import SourceError
from ncfix.text.number_style import decimals_for
from ncfix.text.tree import Assignment, Comment, Constant, Flow, Item, Literal, Opaque, Parameter, Word
from ncfix_iso.rs274.control import RUNTIME_BRANCH, Block, Control
from ncfix_iso.rs274.plans import POLAR, Codes, Plan, RS274Unit

if TYPE_CHECKING:
    from ncfix_iso.rs274.interpreter import RS274Interpreter

DROPPED_CODES = {"G": frozenset({150, 160, 670}), "M": frozenset({970, 980, 990, 1980})}
"""Codes, in tenths, that a flat program has no use for."""

SCALING = frozenset({500, 510})
"""Those whose other words it has no use for, either."""

CALL_WORDS = frozenset("PLQ")
KEPT = frozenset({"program name", "control character", "command"})
"""Opaque text that a flat program keeps."""

OTHER_DECIMALS, VARIABLE_DECIMALS = 4, 6
LENGTHS = frozenset((*CENTRE_LETTERS, "R", "Q"))


@dataclass(slots=True)
class Recorder:
    """Writes blocks down.

    steps  axis letter -> least increment of its axis, mm or degree
    out    the lines so far
    carry  axis letter -> what rounding has left over, program units
    headed  a program number has been written
    """

    control: Control
    steps: Mapping[str, float]
    out: FlatLines
    carry: dict[str, float] = field(default_factory=dict)
    headed: bool = False
    line: int = 1

    # -- what the interpreter tells -----------------------------------------------------------------------------------

    def write(self, text: str) -> None:
        """One line."""
        self.out.write(text, self.line)

    def whole(self, unit: RS274Unit, block: int) -> None:
        """A block as it stands."""
        self.line = unit.program.line(block) if not unit.external else self.line
        self.write(unit.program.text_of(block))

    def head(self, unit: RS274Unit, block: int, keyword: str) -> None:
        """The number of the main program; those of others, and all other flow control, fall away."""
        if keyword == "program" and not self.headed and not unit.external:
            self.headed = True
            self.whole(unit, block)

    def stretch(self, unit: RS274Unit, start: int, count: int) -> None:
        """Blocks of plain words."""
        for block in range(start, start + count):
            self.line = unit.program.line(block) if not unit.external else self.line
            self.put(unit, block, [self.removal(unit, block, word) for word in numbers_of(unit, block)])

    def words(self, unit: RS274Unit, index: int, plan: Plan, codes: Codes, block: Block) -> None:
        """A block of words that has been executed."""
        self.line = unit.program.line(index) if not unit.external else self.line
        self.check(plan, block)
        if self.control.left_out:
            words = [word for word in unit.program.templates[unit.template[index]].words if not is_setting(word)]
            self.put(unit, index, [self.removal(unit, index, word) for word in words])
            self.control.left_out = False
            return
        holes, self.control.ends = self.control.ends or [], []
        changes = [self.of_item(unit, index, item, codes, block) for item in unit.program.items_of(index)]
        made = [change for change in changes if change is not None]
        made += self.absent(unit, index, plan, block)
        motion = self.control.modal.motion if codes.motion is None else codes.motion
        drills = holes and motion in self.control.rules.cycles and not codes.takes
        polar = bool(block.values.keys() & POLAR)
        if drills and (polar or len(holes) > 1 or self.control.modal.incremental):
            self.cycle(unit, index, plan, block, made, holes)
        elif polar:
            self.polar(unit, index, block, made)
        else:
            self.put(unit, index, made)

    def polar(self, unit: RS274Unit, index: int, block: Block, changes: list[Change]) -> None:
        """A block with polar words: X and Y of where it leads, absolute."""
        incremental = self.control.modal.incremental
        written = unit.program.templates[unit.template[index]].words
        words = [w for w in written if w.address in POLAR or w.address in INDEX or (incremental and is_distance(w))]
        stop = end_of_words(unit, index)
        if incremental or not {"@", "^"} <= block.values.keys():
            self.must_stand(mask_of((X, Y)))
        others = "".join(x for x in LETTERS if x in self.steps and (x in "XY" or block.axes >> INDEX[x] & 1))
        text = (" G90" if incremental else "") + self.place(self.control.position, others)
        self.put(unit, index, [*self.without(unit, index, words, changes), Change(stop, stop, text)])
        if incremental:
            self.write("G91")

    def must_stand(self, axes: int) -> None:
        """Raise `Fault` where absolute words would have to say where an axis stands, and the program has not."""
        adrift = self.control.places.adrift & axes
        index = next((index for index in self.control.machine if adrift >> index & 1), None)
        if index is not None:
            what = f"the program has not said where the axis {LETTERS[index]} stands"
            raise Fault(RUNTIME, f"{what}, so it cannot be written out flat")

    def check(self, plan: Plan, block: Block) -> None:
        """Raise `Fault` where the values of a block depend on the machine at run time."""
        if block.runtime or self.control.refusal == RUNTIME_BRANCH:
            what = f"the word {min(block.runtime)}" if block.runtime else "which blocks are executed"
            raise Fault(RUNTIME, f"{what} is known only at run time, so the program cannot be written out flat")

    # -- items --------------------------------------------------------------------------------------------------------

    def of_item(self, unit: RS274Unit, index: int, item: Item, codes: Codes, block: Block) -> Change | None:
        """What becomes of an item: None if it stays as it is."""
        match item:
            case Word():
                return self.of_word(unit, index, item, codes, block)
            case Assignment():
                return self.of_assignment(unit, index, item)
            case Flow():
                return self.removal(unit, index, item)
            case Opaque(kind, _) if kind not in KEPT:
                return self.removal(unit, index, item)
        return None

    def of_assignment(self, unit: RS274Unit, index: int, item: Assignment) -> Change:
        """An assignment falls away, unless the control does something with it (offsets, for one) or keeps it."""
        target, rules = item.target, self.control.rules
        if isinstance(target, Parameter) and isinstance(target.index, Literal):
            number = round(float(unit.program.values_of(index)[target.index.slot]))
            if rules.system(number) or rules.lasting(number):
                return Change(*unit.program.span(index, item.span), f"#{number}={self.value_of(number)}")
        return self.removal(unit, index, item)

    def value_of(self, number: int) -> str:
        """The value of a parameter as text; raises `Fault` where it depends on the machine at run time."""
        parameters = self.control.parameters
        if number in parameters.numbers.runtime:
            what = f"what #{number} is set to"
            raise Fault(RUNTIME, f"{what} is known only at run time, so the program cannot be written out flat")
        value = parameters.numbered(number)
        return "#0" if math.isnan(value) else trimmed(value, VARIABLE_DECIMALS)

    def of_word(self, unit: RS274Unit, index: int, word: Word, codes: Codes, block: Block) -> Change | None:
        """What becomes of a word."""
        letter = word.address
        called = not DROPPED_CODES["M"].isdisjoint(codes.m.values())
        if letter == "N" or (called and letter in CALL_WORDS):
            return self.removal(unit, index, word)
        if letter in "GM":
            return self.of_code(unit, index, word)
        if letter not in block.values:
            return self.removal(unit, index, word)
        written = isinstance(word.value, Literal) and not self.is_changed(unit, index, word, block)
        if written:
            return None
        return Change(*unit.program.span(index, word.value_span), self.number(letter, block.values[letter]))

    def is_changed(self, unit: RS274Unit, index: int, word: Word, block: Block) -> bool:
        """Whether a word with a plain number means another value than what is written (polar coordinates)."""
        if not isinstance(word.value, Literal) or word.value.pointless:
            return word.address in "XYZ" and "polar" in self.control.suspended
        return bool(unit.program.values_of(index)[word.value.slot] != block.values[word.address])

    def of_code(self, unit: RS274Unit, index: int, word: Word) -> Change | None:
        """What becomes of a G or M word."""
        if isinstance(word.value, Constant):
            dropped = round(10 * word.value.value) in DROPPED_CODES[word.address]
            return self.removal(unit, index, word) if dropped else None
        value = self.control.rules.compiled(word.value, word.address)(self.control)
        if math.isnan(value):
            return self.removal(unit, index, word)
        return Change(*unit.program.span(index, word.value_span), f"{value:g}")

    def removal(self, unit: RS274Unit, index: int, item: Item) -> Change:
        """Take an item out, with the blank before it."""
        start, stop = unit.program.span(index, item.span)
        first = int(unit.program.blocks[index, 0])
        if start > first and unit.program.source[start - 1 : start] in (b" ", b"\t"):
            start -= 1
        return Change(start, stop)

    def absent(self, unit: RS274Unit, index: int, plan: Plan, block: Block) -> list[Change]:
        """Words that a block means and does not have: the other coordinate of a polar one."""
        letters = [letter for letter in block.values if letter not in plan.letters and letter in INDEX]
        stop = end_of_words(unit, index)
        return [Change(stop, stop, " " + letter + self.number(letter, block.values[letter])) for letter in letters]

    # -- numbers ------------------------------------------------------------------------------------------------------

    def number(self, letter: str, value: float) -> str:
        """A value as text; a coordinate is rounded to the least increment, and the rest is carried."""
        if letter not in self.steps:
            decimals = self.decimals("X") if letter in LENGTHS else OTHER_DECIMALS
            return trimmed(value, decimals)
        carried = value + (self.carry.get(letter, 0.0) if self.control.modal.incremental else 0.0)
        text = trimmed(carried, self.decimals(letter))
        self.carry[letter] = carried - float(text)
        return text

    def decimals(self, letter: str) -> int:
        """Digits after the point that the least increment needs."""
        unit = 1.0 if letter in INDEX and self.control.rotary[INDEX[letter]] else self.control.modal.unit
        return decimals_for(self.steps.get(letter, min(self.steps.values())) / unit)

    # -- cycles -------------------------------------------------------------------------------------------------------

    def cycle(
        self, unit: RS274Unit, index: int, plan: Plan, block: Block, changes: list[Change], holes: list[Vector]
    ) -> None:
        """The holes of a block, one block each, in absolute coordinates."""
        drop = [word for word in plan.template.words if is_place(word, self.control)]
        stop = end_of_words(unit, index)
        incremental = self.control.modal.incremental
        level = self.control.modal.cycle.level / self.control.modal.unit
        over, depth = self.letters_of_holes(block)
        mode = " G90" if incremental or any(is_distance(word) for word in drop) else ""
        first = mode + self.place(holes[0], over + depth) + " R" + self.number_at("R", level)
        self.put(unit, index, [*self.without(unit, index, drop, changes), Change(stop, stop, first)])
        for hole in holes[1:]:
            self.write(self.place(hole, over).strip())
        if incremental:
            self.write("G91")

    def letters_of_holes(self, block: Block) -> tuple[str, str]:
        """The letters that say where a hole is in the plane, and what else the first one needs, its depth last.

        Raises `Fault` where an increment would have to become a word for an axis that the program has not placed.
        """
        plane = self.control.modal.plane
        if self.control.modal.incremental:
            self.must_stand(block.axes | 1 << plane.across)
        adrift = self.control.places.adrift & ~block.axes
        known = [i for i in (plane.first, plane.second) if not adrift >> i & 1]
        over = "".join(LETTERS[i] for i in known if LETTERS[i] in self.steps)
        across = LETTERS[plane.across]
        named = "".join(x for x in LETTERS if block.axes >> INDEX[x] & 1 and x in self.steps and x not in over)
        return over, named.replace(across, "") + across

    def place(self, hole: Vector, letters: str) -> str:
        """The words of a hole for some letters."""
        control = self.control
        position, control.position = control.position, hole
        program = control.program_position()
        control.position = position
        values = {letter: program[INDEX[letter]] / control.scale[INDEX[letter]] for letter in letters}
        return "".join(f" {letter}{self.number_at(letter, value)}" for letter, value in values.items())

    def number_at(self, letter: str, value: float) -> str:
        """An absolute value as text."""
        self.carry[letter] = 0.0
        return trimmed(value, self.decimals(letter if letter in self.steps else "Z"))

    # -- lines --------------------------------------------------------------------------------------------------------

    def without(self, unit: RS274Unit, index: int, words: list[Word], changes: list[Change]) -> list[Change]:
        """The changes of a block from which some words fall away."""
        spans = {unit.program.span(index, word.span) for word in words}
        kept = [change for change in changes if not inside(change, spans)]
        return kept + [self.removal(unit, index, word) for word in words]

    def put(self, unit: RS274Unit, index: int, changes: list[Change]) -> None:
        """Write a block with changes made; not if nothing is left of it."""
        text = changed(unit.program, index, changes)
        if text.strip() or not (changes or text):
            self.write(text.strip() if changes else text)


def unrolled(interpreter: RS274Interpreter, steps: Mapping[str, float], limit: int) -> list[FlatLine]:
    """Run an interpreter and write down what it executes; raises SourceError where no flat program can say it."""
    recorder = Recorder(interpreter.control, steps, FlatLines(limit))
    interpreter.recorder, interpreter.control.ends = recorder, []
    interpreter.run()
    if why := interpreter.control.unwritten:
        raise SourceError.of(RUNTIME, f"{why}, so the program cannot be written out flat", interpreter.place())
    lines = recorder.out.lines
    begins, ends = (lines[at].text.lstrip()[:1] == "%" if lines else False for at in (0, -1))
    if begins and (not ends or len(lines) == 1):
        recorder.write("%")
    return lines


def trimmed(value: float, decimals: int) -> str:
    """A number with at most so many decimals, and always with a point."""
    text = f"{value:.{decimals}f}"
    if "." in text:
        text = text.rstrip("0")
    text = text if "." in text else text + "."
    return "0." if text in ("-0.", "-.") else text


def numbers_of(unit: RS274Unit, block: int) -> list[Word]:
    """The N word of a block, if it has one."""
    return [word for word in unit.program.templates[unit.template[block]].words if word.address == "N"]


def end_of_words(unit: RS274Unit, index: int) -> int:
    """Where further words of a block go: after its last word, before a comment."""
    items = unit.program.items_of(index)
    words = [unit.program.span(index, item.span)[1] for item in items if not isinstance(item, Comment)]
    return max(words, default=int(unit.program.blocks[index, 0]))


def is_setting(word: Word) -> bool:
    """Whether a word stays though its block has no place in a flat program: another code, F, S or T."""
    scaling = isinstance(word.value, Constant) and round(10 * word.value.value) in SCALING
    return word.address in "GMFST" and not (word.address == "G" and scaling)


def is_distance(word: Word) -> bool:
    """Whether a word is G90 or G91."""
    return word.address == "G" and isinstance(word.value, Constant) and word.value.value in (90.0, 91.0)


def is_place(word: Word, control: Control) -> bool:
    """Whether a word of a cycle says where its holes are, how many, or in which mode: that is written anew."""
    if word.address in "GM":
        return is_distance(word)
    return (
        word.address in INDEX or word.address in POLAR or word.address == "R" or word.address in control.rules.repeats
    )


def inside(change: Change, spans: set[tuple[int, int]]) -> bool:
    """Whether a change lies in a stretch that is taken out."""
    return any(start <= change.start and change.stop <= stop for start, stop in spans)
