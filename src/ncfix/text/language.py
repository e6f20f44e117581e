"""A family of controls, as the functions in which they differ: how its texts are read, and where their words stand.

The tree, the motions, the frames and the walk of the emitter are the same for all. What a line is, what a number is,
what a block means and how a corrected motion is put into words is a family's own, and a `Dialect` names its family.
`control.interpreter` adds how its programs are followed, and `writer.language` how they are written.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Protocol, TypeVar

from ncfix.plugins import called, handed, nearest, useless
from ncfix.text.reach import runs_straight_on
from ncfix.values import frozen

if TYPE_CHECKING:
    from ncfix.arrays import Ints
    from ncfix.text.build import Parsed
    from ncfix.text.dialect import Dialect
    from ncfix.text.shapes import Scan
    from ncfix.text.spelling import Spelling
    from ncfix.text.tree import Anchor, Program, Span, Template, Word


class BlockLayout(Protocol):
    """Where things stand in a motion block; what else there is, only the family's own writer knows."""

    @property
    def motion(self) -> Word | None:
        """The word that says which kind of motion it is, if the block has one."""


@frozen
class ArcLayout:
    """Where the words that say where the centre of an arc is stand in the blocks of one shape.

    centre  I J K -> which of the block's numbers each has
    fixed   which of them count from the origin, whatever else is in force
    radius  which of them R has, and where that word stands, with the blank before it; None without
    alone   none of this is known: `BlockWriter` writes the arc, once the motions around it are written
    """

    centre: Mapping[str, int]
    radius: tuple[int, Span] | None = None
    fixed: frozenset[str] = frozenset()
    alone: bool = False


@frozen
class BulkLayout:
    """Where things stand in the blocks of one shape, for motions that are written many at a time.

    slots     axis letter -> which of the block's numbers its word has
    words_at  where missing axis words go
    blank     what stands before them: a blank or nothing
    lower     addresses are in lower case
    further   further pieces of such a motion may follow as lines of nothing but axis words
    lead      of languages in which such lines begin with more than that: what of the block's own beginning they repeat
    opening   what stands on such lines before the axis words
    closing   what stands on them behind these
    only_named_rotary  a rotary axis that has no word gets none
    by_vector  rotary axes go where other words of the block lead them, exactly; they have none of their own
    arc       what there is of arcs; None where these are written one by one
    """

    slots: Mapping[str, int]
    words_at: Anchor
    blank: str
    lower: bool
    further: bool = False
    lead: Anchor | None = None
    opening: str = ""
    closing: str = ""
    only_named_rotary: bool = False
    by_vector: bool = False
    arc: ArcLayout | None = None


@frozen(kw_only=True)
class Language:
    """How the texts of one family of controls are read.

    split     source -> (n, 2) start and stop byte of each block, line ends not included
    end       (source, blocks) -> the block that ends the program's text: what follows is passed over; len(blocks) if
              nothing does
    scan      (source, blocks) -> shapes and numbers of the blocks, without understanding them
    parse     (dialect, text) -> one block by its grammar; raises `BlockError`
    lenient   a block that cannot be read, and that the control may never get to, is no error until it does
    layout    (program, block) -> the parts of a motion block that may be written; None where nothing may
    same_per_shape  those of all blocks of a shape are the same
    spelling  program -> how what is put into it is spelled
    bulk      (program, block) -> what `writer` would need to know to write motions like this one many at a time; None
              for blocks that it has to write one by one
    renumber  a text with its blocks numbered anew; None where blocks need no numbers
    straight  a program with blocks of this shape may come in parts: they have nothing to do with others elsewhere
    semantics  the rule sets that the family has, by the names that `Dialect.semantics` may give
    own_codes  it takes the codes, cycles and keywords that a dialect adds
    """

    split: Callable[[bytes], Ints]
    end: Callable[[bytes, Ints], int]
    scan: Callable[[bytes, Ints], Scan]
    parse: Callable[[Dialect, str], Parsed]
    layout: Callable[[Program, int], BlockLayout | None]
    spelling: Callable[[Program], Spelling]
    same_per_shape: bool = False
    lenient: bool = False
    bulk: Callable[[Program, int], BulkLayout | None] | None = None
    renumber: Callable[[bytes], bytes] | None = None
    straight: Callable[[Template], bool] = runs_straight_on
    semantics: frozenset[str] = frozenset({""})
    own_codes: bool = False


L = TypeVar("L", bound=Language)


def language_of(dialect: Dialect, part: type[L]) -> L:
    """The language of a dialect, as far as its user needs to know it; imported when it is first needed.

    Raises `PluginError`: NCF507 if the import fails, NCF508 if what it names is not that or has no such semantics.
    """
    language = loaded(dialect)
    if not isinstance(language, part):
        handed("dialects", dialect.name, language, part)
        raise TypeError(f"{dialect.language} is no {part.__name__}")
    return language


@lru_cache(maxsize=32)
def loaded(dialect: Dialect) -> Language:
    """What a dialect names as its language, imported once; raises as `language_of`."""
    language: Language = called("dialects", dialect.name, resolve_name, dialect.language, gives=Language)
    assert isinstance(language, Language), f"{dialect.language} is no Language"
    if dialect.semantics not in language.semantics:
        text = f"the dialect {dialect.name!r} has the semantics {dialect.semantics!r}, which its language does not know"
        raise useless("dialects", dialect.name, text, nearest(dialect.semantics, language.semantics))
    if (dialect.codes or dialect.cycles or dialect.keywords) and not language.own_codes:
        text = f"the dialect {dialect.name!r} has codes of its own, and its language takes none"
        raise useless("dialects", dialect.name, text, "languages of the RS274 and Fanuc families take them")
    return language
