"""How a language that says the codes of this family in words is written: MOVE X=10 FEED=500 for G1 X10 F500.

It is read by its own grammar, with `Dialect.keywords`. Every line that is put in says its motion, as such languages
have no motion in force.
"""

from __future__ import annotations

from functools import cached_property

from ncfix.text.dialect import Dialect
from ncfix.text.grammar import parser
from ncfix.text.tree import Word
from ncfix.writer.block import BlockWriter

NO_KEYWORD = "the correction needs a word for {}, and the language has none"


def has_keywords(dialect: Dialect) -> bool:
    """Whether blocks of a dialect look otherwise than letters with numbers."""
    return bool(dialect.keywords or dialect.assign or dialect.signed)


def reads_codes(dialect: Dialect) -> bool:
    """Whether blocks of a dialect may have G codes as well as its keywords."""
    return any(terminal.name.endswith("CODE") for terminal in parser(dialect.grammar).terminals)


class KeywordWriter(BlockWriter):
    """Writes one motion into one block, with the keywords of the dialect for codes and addresses."""

    @cached_property
    def spelled(self) -> dict[str, str]:
        """Code or address -> its keyword; the first of several."""
        return {meaning: word for word, meaning in reversed(self.program.dialect.keywords)}

    def _cased(self, address: str) -> str:
        return super()._cased(self.spelled.get(address, address)) + self.program.dialect.assign

    def _code(self, number: str) -> str:
        """A G code as the language says it; a conflict where it has no word for that."""
        if not self.program.dialect.keywords:
            return super()._cased("G") + number
        word = self.spelled.get(f"G{number}", "")
        if not word and reads_codes(self.program.dialect):
            return super()._cased("G") + number
        if not word:
            self.out.conflict = self.out.conflict or NO_KEYWORD.format(f"G{number}")
        return word

    def _restate(self, word: Word, number: str) -> None:
        if self.program.dialect.keywords:
            self.out.edits.append((*self.program.span(self.block, word.span), self._code(number)))
        else:
            super()._restate(word, number)

    def _opening(self, wanted: int) -> list[str]:
        """What a further line begins with: the motion, as nothing is in force there."""
        if not self.program.dialect.keywords:
            return super()._opening(wanted)
        self.code = self.code if self.target.arcs is None else wanted
        return [self._code(f"{self.code // 10}")]

    def _feed_mode(self, number: str) -> None:
        word = self.layout.feed_mode
        if word is None or not self.program.dialect.keywords:
            super()._feed_mode(number)
        else:
            self._restate(word, number)
