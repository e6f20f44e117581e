"""A dialect's grammar: where its file is, and one block of text made into a tree by it.

The `.lark` file is the only definition of what a block is. Blanks mean nothing outside comments, so they are taken
out before the parser sees the text (`squeeze`), and every position is put back where it was in the block.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lark import Lark, Token, Tree

    from ncfix.program.dialect import Dialect

PACKAGE = Path(__file__).resolve().parents[1]

FOLDERS = (PACKAGE / "grammars", PACKAGE.parents[1] / "grammars")
"""Where grammars are: inside an installed package, and beside `src` in a source tree."""

PIECE = re.compile(r"\([^()]*\)|;.*|[^ \t]", re.DOTALL)
"""What squeezing keeps: comments whole, and single characters that are not blank."""


@dataclass(frozen=True, slots=True)
class Squeezed:
    """A block without the blanks outside comments.

    code    what is left
    places  place in the block of each character of `code`
    """

    code: str
    places: list[int]

    def span(self, start: int, stop: int) -> tuple[int, int]:
        """Where a stretch of `code` starts and stops in the block."""
        if start == stop:
            return 0, 0
        return self.places[start], self.places[stop - 1] + 1


def squeeze(text: str) -> Squeezed:
    """Take out the blanks outside comments."""
    kept = [match.span() for match in PIECE.finditer(text)]
    code = "".join(text[start:stop] for start, stop in kept)
    return Squeezed(code, [place for span in kept for place in range(*span)])


def find_grammar(name: str) -> Path:
    """The file of a grammar: a path of its own (a plugin's), or a name of those that ship with ncfix.

    Raises FileNotFoundError: an installation without its grammars, or a plugin that names a wrong one.
    """
    for path in (Path(name), *(folder / name for folder in FOLDERS)):
        if path.is_file():
            return path
    raise FileNotFoundError(f"no grammar {name!r} in {', '.join(map(str, FOLDERS))}")


@lru_cache(maxsize=32)
def parser(name: str) -> Lark:
    """The LALR parser of a grammar, made when it is first asked for (about 0.05 s) and kept."""
    from lark import Lark

    return Lark.open(
        str(find_grammar(name)),
        parser="lalr",
        start="block",
        propagate_positions=True,
        maybe_placeholders=False,
        import_paths=[str(folder) for folder in FOLDERS],
    )


def parse(dialect: Dialect, code: str) -> Tree[Token]:
    """The tree of one squeezed block; raises Lark's own `UnexpectedInput`."""
    return parser(dialect.grammar).parse(code)
