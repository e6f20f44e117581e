"""The text of one hole: the words that lead over it, and a call of its cycle with a depth of its own.

The call goes in before the motion, in the same place of the flow: number and label of the block stay before it. Behind
the hole the call of the program comes back, so what is executed next finds the depth that it knew. A cycle that is
called where the axes stand, and shall drill a little beside, becomes a modal one for the motion to there.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from ncfix.control.moves import CycleCall
from ncfix.text.spelling import NumberStyle
from ncfix.text.tree import Program, Word
from ncfix.writer.target import LINE, Rendered, Target
from ncfix_siemens.sinumerik.flatten import BARE, argument
from ncfix_siemens.sinumerik.layout import END_OF_SUBPROGRAM, SinumerikLayout
from ncfix_siemens.sinumerik.render import SinumerikRenderer

FloatArray = NDArray[np.float64]

PLAIN = re.compile(r"\s*[-+]?(?:\d+\.?\d*|\.\d+)\s*")
CYCLE = re.compile(r"(?P<name>\w+)\s*\((?P<arguments>.*)\)", re.DOTALL)
REFERENCE = 1
"""The place of the height that the cycle counts from (RFP)."""

RAPID = 0
ENDS_HERE = "the hole needs a line behind it, and the subprogram ends in its block"


def render(program: Program, block: int, layout: SinumerikLayout, target: Target) -> Rendered:
    """The text of a corrected motion, which may be that to a hole."""
    renderer = SinumerikRenderer if target.call is None else HoleRenderer
    return renderer(program, block, layout, target).render()


class HoleRenderer(SinumerikRenderer):
    """Renders one hole. `across`: the column of the axis along which it is drilled."""

    def render(self) -> Rendered:
        """Write the hole."""
        call, target = self.target.call, self.target
        assert call is not None
        self.across = target.letters.index(call.across)
        off = float(target.ends[0][self.across] - target.nominal[self.across])
        if abs(off) < self.half[self.across]:
            off = 0.0
        arguments, sunk = shifted(call, off, int(target.decimals[self.across]))
        if call.bound or self._is_inside_out(call, sunk):
            arguments, sunk = None, 0.0
        position = self._led_to(call, arguments) if call.modal else self._called(call, arguments)
        position[self.across] = target.nominal[self.across] + sunk
        self.out.ends.append(position)
        self.out.edits.sort(key=lambda edit: edit[:2])
        return self.out

    # -- behind a motion that leads to it -----------------------------------------------------------------------------

    def _led_to(self, call: CycleCall, arguments: list[str] | None) -> FloatArray:
        """The words of the motion, and the call before and behind it."""
        position = self._first_piece(self.target.start.copy(), self.target.ends[0])
        if self.added:
            at = self.program.position(self.block, self.layout.words_at)
            self.out.edits.append((at, at, "".join(self.added)))
        if arguments is not None:
            self._check(call)
            at, prefix = self.program.position(self.block, self.layout.begins), self._prefix()
            opening = f"MCALL {call.name}({','.join(arguments)}){self._line_end()}{prefix}"
            self.out.edits.insert(0, (at, at, opening))
            self.out.opens, self.out.closing = (
                True,
                f"{prefix}MCALL {call.name}({','.join(map(argument, call.arguments))})",
            )
        return position

    def _check(self, call: CycleCall) -> None:
        """Whether lines may be put before and behind the block."""
        codes = (self._value(word, np.nan) for word in self.layout.after)
        ends = ENDS_HERE if END_OF_SUBPROGRAM.intersection(codes) else ""
        self.out.conflict = self.out.conflict or call.fixed or ends

    def _is_inside_out(self, call: CycleCall, sunk: float) -> bool:
        """Whether the hole would end on the other side of the height that its cycle counts from."""
        reference = call.arguments[REFERENCE] if len(call.arguments) > REFERENCE else None
        nominal = float(self.target.nominal[self.across])
        return isinstance(reference, float) and (nominal - reference) * (nominal + sunk - reference) <= 0.0

    # -- where the axes stand -----------------------------------------------------------------------------------------

    def _called(self, call: CycleCall, arguments: list[str] | None) -> FloatArray:
        """The call itself, modal for a motion of its own where the hole is beside the place where the axes stand."""
        target, position = self.target, self.target.start.copy()
        for column, _ in self.columns:
            if column != self.across:
                self._absent_axis(position, column, target.ends[0][column])
        if arguments is None and not self.added:
            return position
        self._check(call)
        assert self.layout.cycle is not None
        start, stop = self.program.span(self.block, self.layout.cycle)
        text = self.program.source[start:stop].decode("latin-1")
        if arguments is not None:
            text = with_depths(text, call, arguments)
        if self.added:
            text, prefix, led = f"MCALL {text}", self._prefix(), "".join(self.added).strip()
            if target.active_code != RAPID and (target.active_code != LINE or target.inverse_time):
                led, self.out.code = f"G0 {led}", RAPID
            self.out.lines += [prefix + led, prefix + "MCALL"]
        self.out.edits.append((start, stop, text))
        return position

    # -- words --------------------------------------------------------------------------------------------------------

    def _absent_axis(self, position: FloatArray, column: int, end: float) -> None:
        if column != self.across:
            super()._absent_axis(position, column, end)

    def _present_axis(self, position: FloatArray, column: int, end: float, word: Word) -> None:
        """A word along the tool says where it goes before it drills, and stays."""
        if column != self.across:
            super()._present_axis(position, column, end, word)

    def _plane_columns(self) -> NDArray[np.bool_]:
        columns = super()._plane_columns()
        columns[self.across] = False
        return columns

    def _prefix(self) -> str:
        return self.program.slice(self.block, self.layout.prefix) + " " if self.layout.prefix else ""

    def _line_end(self) -> str:
        return self.program.line_end.decode()


def shifted(call: CycleCall, off: float, decimals: int) -> tuple[list[str] | None, float]:
    """The arguments of a call whose hole ends `off` higher, as written, and by how much it then does.

    None where that changes nothing.
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


def number_of(call: CycleCall, place: int) -> float:
    """An argument that is a number."""
    value = call.arguments[place]
    assert isinstance(value, float)
    return value


def with_depths(text: str, call: CycleCall, arguments: list[str]) -> str:
    """A call as the program writes it, with the depths of `arguments`, in the style of its numbers where it has any."""
    found = CYCLE.fullmatch(text)
    assert found is not None
    parts = in_parts(found["arguments"])
    for place, _ in call.depths:
        part = parts[place]
        plain = PLAIN.fullmatch(part)
        blank = part[: len(part) - len(part.lstrip())]
        style = NumberStyle.of(part) if plain else NumberStyle()
        decimals = len(arguments[place].partition(".")[2])
        parts[place] = blank + style.write(float(arguments[place]), decimals)
    start, stop = found.span("arguments")
    return text[:start] + ",".join(parts) + text[stop:]


def in_parts(text: str) -> list[str]:
    """Arguments as written, parted at the commas that stand in no brackets and no text."""
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
