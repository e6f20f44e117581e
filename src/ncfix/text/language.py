"""A language: the functions in which a family of controls differs from others, such as how its texts are read.

Tree, motions, frames and the emitter are common to all families. What a line, a number and a block mean, and how a
corrected motion is put into words, is defined by the family; a `Dialect` names its family. `control.interpreter` adds
how programs are followed, and `writer.language` how they are written.
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
    """The writable places of a motion block; only the family's own writer knows more of it."""

    @property
    def motion(self) -> Word | None:
        """The word with the motion code; None if the block has none."""


@frozen
class ArcLayout:
    """Places of the words that give an arc's centre, in the blocks of one shape.

    centre  I J K -> slot of its number in the block
    fixed   letters of those that count from the origin, whatever mode is in force
    radius  slot of R, and the span of its word with the blank before it; None without R
    alone   the places are not known: `BlockWriter` writes the arc, after the motions around it
    """

    centre: Mapping[str, int]
    radius: tuple[int, Span] | None = None
    fixed: frozenset[str] = frozenset()
    alone: bool = False


@frozen
class BulkLayout:
    """Places in the blocks of one shape, for writing many motions at once.

    slots     axis letter -> slot of its word's number in the block
    words_at  where missing axis words go
    blank     separator before them: a blank or nothing
    lower     addresses are in lower case
    further   a split motion may continue in lines that contain only axis words
    lead      the beginning of the block up to here is repeated in such lines; None: it is not
    opening   text of such lines before the axis words
    closing   text of such lines after the axis words
    only_named_rotary  a rotary axis without a word gets none
    by_vector  other words of the block define the rotary axes exactly; they have no words of their own
    arc       places of arc words; None: arcs are written one by one
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
    """How texts of one family of controls are read.

    split     source -> (n, 2) start and stop byte of each block, without line ends
    end       (source, blocks) -> the block that ends the program text, after which text is ignored; else len(blocks)
    scan      (source, blocks) -> shapes and numbers of the blocks, without parsing them
    parse     (dialect, text) -> one block, parsed by its grammar; raises `BlockError`
    lenient   an unreadable block that the control may never reach is an error only when it is reached
    layout    (program, block) -> the writable parts of a motion block; None if nothing may be written
    same_per_shape  the layout is the same for all blocks of a shape
    spelling  program -> how inserted text is spelled
    bulk      (program, block) -> what the writer needs to write motions of this shape many at a time; None for blocks
              that must be written one by one
    renumber  text -> the text with its blocks renumbered; None if blocks need no numbers
    straight  template -> whether a program with such blocks may be processed in parts: they refer to no other blocks
    semantics  names of its rule sets, for `Dialect.semantics`
    own_codes  whether dialects may add codes, cycles and keywords
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
    """The language of a dialect as an instance of `part`; imported when it is first needed.

    Raises `PluginError`: NCF507 if the import fails, NCF508 if the object is no `part` or lacks the dialect's
    semantics.
    """
    language = loaded(dialect)
    if not isinstance(language, part):
        handed("dialects", dialect.name, language, part)
        raise TypeError(f"{dialect.language} is no {part.__name__}")
    return language


@lru_cache(maxsize=32)
def loaded(dialect: Dialect) -> Language:
    """The language object that a dialect names, imported once; raises as `language_of`."""
    language: Language = called("dialects", dialect.name, resolve_name, dialect.language, gives=Language)
    assert isinstance(language, Language), f"{dialect.language} is no Language"
    if dialect.semantics not in language.semantics:
        text = f"the dialect {dialect.name!r} has the semantics {dialect.semantics!r}, which its language does not know"
        raise useless("dialects", dialect.name, text, nearest(dialect.semantics, language.semantics))
    if (dialect.codes or dialect.cycles or dialect.keywords) and not language.own_codes:
        text = f"the dialect {dialect.name!r} has codes of its own, and its language takes none"
        raise useless("dialects", dialect.name, text, "languages of the RS274 and Fanuc families accept them")
    return language
