"""The text of one hole: the position over it, and its depth.

Cycles of the 200s count their depth from a surface, Q203, which is moved for one hole. The old ones count it from where
the tool stands, so that gets a word.
"""

from __future__ import annotations

from ncfix.text.spelling import value_of
from ncfix.text.tree import Word
from ncfix_heidenhain.klartext.control import BY_DEPTH
from ncfix_heidenhain.klartext.words_text import WordWriter

SURFACE = "Q203"


class HoleWriter(WordWriter):
    """Puts a block right that executes a drilling cycle."""

    def _over_the_hole(self) -> None:
        """The position over a hole, and its depth."""
        target = self.target
        across = target.spatial[2]
        position = target.start.copy()
        polar = self._polar_columns()
        for column, letter in self.columns:
            word = self.layout.axes.get(letter)
            if column == across or (self.layout.name == "cycl call" and self._is_rotary(column)):
                continue
            if word is not None:
                self._present(position, column, target.ends[0][column], word)
            elif not self._left_alone(column):
                self._absent(position, column, target.ends[0][column], column in polar)
        position[across] = self._bottom(across)
        if polar:
            self._straightened()
        if self.layout.name == "cycl call" and self.added:
            self._positioned()
        self.out.ends.append(position)

    def _is_rotary(self, column: int) -> bool:
        return bool(self.target.rotary) and self.target.rotary[column]

    def _positioned(self) -> None:
        """CYCL CALL executes the cycle where the block before led to, M99 at the end of a block of its own."""
        words = [text.strip() for text in self.added]
        self._function(" ".join(["L", *words, *([] if self.layout.rapid else ["FMAX"]), "M99"]))
        self.added.clear()

    def _bottom(self, across: int) -> float:
        """Where the hole ends, as it is written."""
        target, word = self.target, self.layout.axes.get("Z")
        lower = float(target.nominal[across])
        off = float(target.ends[0][across]) - lower
        if target.code == BY_DEPTH:
            return lower + self._sunk(off, across)
        return lower + self._lifted(off, across, word)

    def _sunk(self, off: float, across: int) -> float:
        """Move the surface from which the cycle counts its depth, for this hole only; by how much.

        A change of Q203 itself counts for the calls that follow (TNC 640, "Cycle programming": define the parameter of
        the cycle directly). It is taken back after the block, so other holes and formulas find the value they knew.
        """
        if abs(off) < self.half[across] or SURFACE in self.program.text_of(self.block):
            return 0.0
        text = self._number(off, across)
        start = int(self.program.blocks[self.block, 0])
        before = f"{self._prefix()}FN 1: {SURFACE} = +{SURFACE} + {text}{self._line_end()}"
        self.out.edits.append((start, start, before))
        self._line([f"FN 2: {SURFACE} = +{SURFACE} - {text}"])
        return value_of(text)

    def _lifted(self, off: float, across: int, word: Word | None) -> float:
        """Call an old cycle from a height that makes its depth right; by how much that is another height.

        Without a word the height is that of the hole before, which had its own; so it is said each time.
        """
        height = float(self.target.origin[2]) if word is None else self._said(across, word)
        if word is not None and abs(off) < self.half[across]:
            return 0.0
        if word is not None:
            return self._rewrite(word, height + off, int(self.target.decimals[across])) - height
        text = self._number(height + off, across)
        self.added.append(self.layout.blank + self.target.letters[across] + text)
        return value_of(text) - height
