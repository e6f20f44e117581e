"""A family of controls, as the functions in which they differ: how a text is read, followed and written.

The tree, the motions, the frames and the walk of the emitter are the same for all. What a line is, what a number is,
what a block means and how a corrected motion is put into words is a family's own, and a `Dialect` names its family.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, Protocol

from ncfix.plugins import called, nearest, useless
from ncfix.text.reach import runs_straight_on

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ncfix.control.control import ProgramControl
    from ncfix.control.flatten import FlatLine
    from ncfix.control.interpreter import Interpreter
    from ncfix.control.moves import Kinematics, Moves
    from ncfix.control.setup import Setup
    from ncfix.text.build import Parsed
    from ncfix.text.dialect import Dialect
    from ncfix.text.shapes import Scan
    from ncfix.text.spelling import Spelling
    from ncfix.text.tree import Anchor, Program, Span, Template, Word
    from ncfix.writer.pieces import Pieces
    from ncfix.writer.target import Rendered, Target

Resolve = Callable[[str], bytes | None]
"""Gives the text of a subprogram file by its name; None if there is none."""


class BlockLayout(Protocol):
    """Where things stand in a motion block; what else there is, only the family's own writer knows."""

    @property
    def motion(self) -> Word | None:
        """The word that says which kind of motion it is, if the block has one."""


class Writer(Protocol):
    """Writes one motion into one block."""

    def write(self) -> Rendered:
        """What is written; called once."""


@dataclass(frozen=True, slots=True)
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


@dataclass(frozen=True, slots=True)
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
    turns_named  a rotary axis that has no word gets none
    led       rotary axes go where other words of the block lead them, exactly; they have none of their own
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
    turns_named: bool = False
    led: bool = False
    arc: ArcLayout | None = None


@dataclass(frozen=True, slots=True)
class Run:
    """What a program is followed with; see `trace`, which has the same arguments."""

    setup: Setup
    axes: tuple[str, ...]
    rotary: frozenset[str]
    resolve: Resolve | None = None
    kinematics: Kinematics | None = None

    def budget(self, program: Program) -> int:
        """Blocks that may be executed before a program, or a part of one, counts as endless."""
        return self.setup.most_blocks + len(program.blocks)


@dataclass(frozen=True, slots=True)
class Language:
    """How one family of controls is read, followed and written.

    split     source -> (n, 2) start and stop byte of each block, line ends not included
    end       (source, blocks) -> the block that ends the program's text: what follows is passed over; len(blocks) if
              nothing does
    scan      (source, blocks) -> shapes and numbers of the blocks, without understanding them
    parse     (dialect, text) -> one block by its grammar; raises `BlockError`
    lenient   a block that cannot be read, and that the control may never get to, is no error until it does
    control   what the control keeps while it follows a program of a dialect
    interpreter  (control, program, run) -> the walk through a program; `in_parts`: this is the first of its parts
    layout    (program, block) -> the parts of a motion block that may be written; None where nothing may
    same_per_shape  those of all blocks of a shape are the same
    writer    (program, block, layout, target, spelling) -> what writes the motion of a block: `BlockWriter`, or a
              class of its kind with what no other control has
    spelling  program -> how what is put into it is spelled
    arc_pieces  `writer` can write an arc as several (`Target.arcs`)
    bulk      (program, block) -> what `writer` would need to know to write motions like this one many at a time; None
              for blocks that it has to write one by one
    one_by_one  (program, moves, pieces, first piece of each motion) -> (n,) motions that `writer` has to write one by
              one for what else there is about them; None: none
    renumber  a text with its blocks numbered anew; None where blocks need no numbers
    unroll    (interpreter, least increments, limit) -> the blocks of a program as they are executed, see `flatten`;
              None if the language cannot write them
    straight  a program with blocks of this shape may come in parts: they have nothing to do with others elsewhere
    semantics  the rule sets that the family has, by the names that `Dialect.semantics` may give
    own_codes  it takes the codes and cycles that a dialect adds (`Dialect.codes`, `Dialect.cycles`)
    """

    split: Callable[[bytes], NDArray[np.int64]]
    end: Callable[[bytes, NDArray[np.int64]], int]
    scan: Callable[[bytes, NDArray[np.int64]], Scan]
    parse: Callable[[Dialect, str], Parsed]
    control: Callable[[Run, Dialect], ProgramControl]
    interpreter: Callable[..., Interpreter[Any]]
    layout: Callable[[Program, int], BlockLayout | None]
    writer: Callable[[Program, int, Any, Target, Spelling], Writer]
    spelling: Callable[[Program], Spelling]
    same_per_shape: bool = False
    lenient: bool = False
    arc_pieces: bool = False
    bulk: Callable[[Program, int], BulkLayout | None] | None = None
    one_by_one: Callable[[Program, Moves, Pieces, NDArray[np.int64]], NDArray[np.bool_]] | None = None
    renumber: Callable[[bytes], bytes] | None = None
    unroll: Callable[[Any, Mapping[str, float], int], Sequence[FlatLine]] | None = None
    straight: Callable[[Template], bool] = runs_straight_on
    semantics: frozenset[str] = frozenset({""})
    own_codes: bool = False


@lru_cache(maxsize=32)
def language_of(dialect: Dialect) -> Language:
    """The language of a dialect, imported when it is first needed.

    Raises `PluginError`: NCF507 if the import fails, NCF508 if what it names is no `Language` or has no such semantics.
    """
    language: Language = called("dialects", dialect.name, resolve_name, dialect.language, gives=Language)
    assert isinstance(language, Language), f"{dialect.language} is no Language"
    if dialect.semantics not in language.semantics:
        text = f"the dialect {dialect.name!r} has the semantics {dialect.semantics!r}, which its language does not know"
        raise useless("dialects", dialect.name, text, nearest(dialect.semantics, language.semantics))
    if (dialect.codes or dialect.cycles) and not language.own_codes:
        text = f"the dialect {dialect.name!r} has codes of its own, and its language takes none"
        raise useless("dialects", dialect.name, text, "languages of the RS274 and Fanuc families take them")
    return language
