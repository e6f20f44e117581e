"""The grammar of a dialect: its file, its parser, and the parse of one block into a tree.

The `.lark` file is the only definition of what a block is. Blanks have no meaning outside comments, so they are removed
before parsing (`squeeze`); positions are then mapped back to the block.
"""

from __future__ import annotations

import os
import re
import sys
from contextlib import suppress
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

from ncfix.host import cache_folders
from ncfix.plugins import describe, working
from ncfix.values import frozen

if TYPE_CHECKING:
    from lark import Lark, Token, Tree, UnexpectedInput

    from ncfix.text.dialect import Dialect

PACKAGE = Path(__file__).resolve().parents[1]

FOLDERS = (PACKAGE / "grammars", PACKAGE.parents[1] / "grammars")
"""Folders of grammars: inside an installed package, and beside `src` in a source tree."""

PIECE = re.compile(r"\([^()]*\)|;.*|[^ \t]", re.DOTALL)
"""What squeezing keeps: whole comments, and single characters other than blanks."""


@frozen
class UnspacedBlock:
    """A block without the blanks outside comments.

    code    the remaining characters
    places  for each character of `code`, its index in the block
    """

    code: str
    places: list[int]

    def span(self, start: int, stop: int) -> tuple[int, int]:
        """Start and stop in the block of a range of `code`."""
        if start == stop:
            return 0, 0
        return self.places[start], self.places[stop - 1] + 1


def squeeze(text: str, piece: re.Pattern[str] = PIECE) -> UnspacedBlock:
    """Remove the blanks outside comments; `piece`: pattern of what is kept."""
    spans = [match.span() for match in piece.finditer(text)]
    code = "".join(text[start:stop] for start, stop in spans)
    return UnspacedBlock(code, [place for span in spans for place in range(*span)])


def find_grammar(name: str) -> Path:
    """The file of a grammar: a path (of a plugin), or the name of a grammar that ships with ncfix.

    Raises FileNotFoundError: the installation lacks its grammars, or a plugin names a wrong one.
    """
    for path in (Path(name), *(folder / name for folder in FOLDERS)):
        if path.is_file():
            return path
    where = "" if Path(name).is_absolute() else f" in {', '.join(map(str, FOLDERS))}"
    raise FileNotFoundError(f"no grammar {name!r}{where}")


def place_of_tables(grammar: Path) -> str | None:
    """The file for a grammar's parser tables: in a cache folder beside this module, or in the user's cache.

    None if neither can be written. Lark reuses the tables only for the same grammar, including its imports, and the
    same versions of Python and Lark.
    """
    name = f"{grammar.stem}.{sha256(str(grammar).encode()).hexdigest()[:12]}.{sys.implementation.cache_tag}.tables"
    for folder in cache_folders(__file__):
        with suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            if (folder / name).exists() or os.access(folder, os.W_OK):
                return str(folder / name)
    return None


@lru_cache(maxsize=32)
def parser(name: str) -> Lark:
    """The LALR parser of a grammar; its tables are computed once (0.1 s) and kept on disk."""
    return parser_of(name, place_of_tables(find_grammar(name)))


def parser_of(name: str, tables: str | None = None) -> Lark:
    """A new LALR parser of a grammar, with its tables read from the file `tables`, or written to it."""
    from lark import Lark

    return Lark.open(
        str(find_grammar(name)),
        cache=tables or False,
        parser="lalr",
        start="block",
        propagate_positions=True,
        maybe_placeholders=False,
        import_paths=[str(folder) for folder in FOLDERS],
    )


class UnparsedError(Exception):
    """The grammar does not match the block; `place`: where the parser stopped (at the end: something is missing)."""

    def __init__(self, place: int) -> None:
        super().__init__(place)
        self.place = place


def parse(dialect: Dialect, code: str) -> Tree[Token]:
    """The tree of one squeezed block; raises `UnparsedError`."""
    from lark import UnexpectedInput

    try:
        grammar = parser(dialect.grammar)
    except Exception as error:
        with working("dialects", dialect.name):  # a grammar that is missing, or is none, is the fault of whose it is
            if isinstance(error, FileNotFoundError):
                raise
            raise ValueError(f"{Path(dialect.grammar).name}: {describe(error)}") from error
    try:
        return grammar.parse(code)
    except UnexpectedInput as error:
        raise UnparsedError(_place(error, len(code))) from None


def _place(error: UnexpectedInput, length: int) -> int:
    from lark.exceptions import UnexpectedCharacters, UnexpectedToken

    if isinstance(error, UnexpectedToken) and error.token.type == "$END":
        return length
    known = isinstance(error, UnexpectedCharacters | UnexpectedToken)
    return length if not known or error.pos_in_stream is None else int(error.pos_in_stream)
