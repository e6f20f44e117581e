"""A program in parts: read and followed one after the other, so that its length does not matter to the memory.

A part ends between two blocks of plain words, where nothing else can be under way. Its lines are those of the file, and
templates, frames and reasons have the same numbers in all parts, so that parts can be put together.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ncfix.control.moves import Moves
from ncfix.text.dialect import Dialect
from ncfix.text.dialects import check_content, check_zeros, header_length
from ncfix.text.language import Language, language_of
from ncfix.text.reader import ProgramReading
from ncfix.text.tree import Program, Skip, Template

TABLES = frozenset({"axes", "rotary", "frames", "reasons", "pointing", "angles", "calls"})
"""The fields of `Moves` that are the same for all rows."""


class NotInPartsError(Exception):
    """The program cannot be taken part by part: it has to be read as a whole."""


@dataclass(slots=True)
class PartReader:
    """Reads parts of one program.

    head        the first bytes of the text, by which it is told what it is; those of the first part, if not given
    first_line  the line on which the next part begins
    line_end    the first line end of the first part
    plain       shape -> whether a part may end before or after a block of it
    """

    path: str
    dialect: Dialect
    head: bytes = b""
    first_line: int = 1
    line_end: bytes = b""
    language: Language = field(init=False)
    templates: list[Template] = field(default_factory=list)
    index: dict[bytes | None, int] = field(default_factory=dict)
    plain: dict[int, bool] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.language = language_of(self.dialect)

    def read(self, source: bytes) -> Program:
        """The part that begins on `first_line`; raises what `reader.read` raises, `NotInPartsError` for o-words."""
        begun = self.first_line > 1
        check_zeros(source, self.path, self.first_line)
        if not begun:
            check_content(self.head or source, self.path, self.dialect)
        blocks = self.language.split(source)
        if not begun:
            blocks[0, 0] = header_length(source)
        end = self._end_later(source, blocks) if begun else self.language.end(source, blocks)
        reading = ProgramReading(
            source, self.path, self.dialect, self.language, blocks, end, self.templates, self.index
        )
        reading.first_line, reading.line_end = self.first_line, self.line_end
        before = len(self.templates)
        program = reading.program()
        self.line_end = program.line_end
        if not all(map(self.language.straight, self.templates[before:])):
            raise NotInPartsError("the program does not run straight from its first line to its last")
        return program

    def _end_later(self, source: bytes, blocks: NDArray[np.int64]) -> int:
        """The block that ends the text, where this is not the first part."""
        if b"%" not in source:
            return len(blocks)
        before = b"X\n"
        return self.language.end(before + source, np.vstack(([[0, 1]], blocks + len(before)))) - 1

    def last_cut(self, program: Program) -> int:
        """The last block before which a part may end; 0 if there is none."""
        pairs = ((block, block - 1) for block in range(len(program) - 1, 0, -1))
        return next((pair[0] for pair in pairs if all(self._is_plain(program, each) for each in pair)), 0)

    def _is_plain(self, program: Program, block: int) -> bool:
        shape = int(program.template[block])
        if shape not in self.plain:
            self.plain[shape] = self._has_plain_shape(program, block)
        return self.plain[shape]

    def _has_plain_shape(self, program: Program, block: int) -> bool:
        template = program.templates[int(program.template[block])]
        if self.language.bulk is None or template.m_codes or any(isinstance(item, Skip) for item in template.items):
            return False
        return self.language.bulk(program, block) is not None


def stretch(program: Program, start: int, stop: int) -> Program:
    """The blocks from `start` up to `stop` as a program of their own, its line end included."""
    ends = (0 if start == 0 else int(program.blocks[start, 0]), len(program.source))
    if stop < len(program):
        ends = ends[0], int(program.blocks[stop, 0])
    numbers = slice(program.first_number[start], program.first_number[stop])
    return Program(
        source=program.source[slice(*ends)],
        path=program.path,
        dialect=program.dialect,
        templates=program.templates,
        template=program.template[start:stop],
        blocks=_behind(program.blocks[start:stop], ends[0]),
        first_number=_behind(program.first_number[start : stop + 1], int(program.first_number[start])),
        number_spans=_behind(program.number_spans[numbers], ends[0]),
        numbers=program.numbers[numbers],
        first_line=program.first_line + program.lines_ended_before(ends[0]),
        line_end=program.line_end,
    )


def _behind(places: NDArray[np.int64], origin: int) -> NDArray[np.int64]:
    """Places as they count from an origin: the same array where they do already."""
    return places - origin if origin else places


def joined(parts: list[Program]) -> Program:
    """Parts that follow each other, as one."""
    if len(parts) == 1:
        return parts[0]
    bytes_before = np.cumsum([0, *(len(part.source) for part in parts)])
    numbers_before = np.cumsum([0, *(len(part.numbers) for part in parts)])
    shifted = list(zip(parts, bytes_before.tolist(), numbers_before.tolist(), strict=False))
    return Program(
        source=b"".join(part.source for part in parts),
        path=parts[0].path,
        dialect=parts[0].dialect,
        templates=parts[-1].templates,
        template=np.concatenate([part.template for part in parts]),
        blocks=np.concatenate([part.blocks + at for part, at, _ in shifted]),
        first_number=np.concatenate([part.first_number[:-1] + n for part, _, n in shifted] + [numbers_before[-1:]]),
        number_spans=np.concatenate([part.number_spans + at for part, at, _ in shifted]),
        numbers=np.concatenate([part.numbers for part in parts]),
        first_line=parts[0].first_line,
        line_end=parts[0].line_end,
    )


def joined_moves(parts: list[Moves], blocks: list[int]) -> Moves:
    """The motions of parts that follow each other; `blocks`: how many blocks each of the parts has."""
    if len(parts) == 1:
        return parts[0]
    before = np.cumsum([0, *blocks[:-1]])
    columns: dict[str, Any] = {
        each.name: _joined_columns(each.name, parts) for each in fields(Moves) if each.name not in TABLES
    }
    shifted = [part.block + at for part, at in zip(parts, before.tolist(), strict=True)]
    columns["block"] = np.concatenate(shifted).astype(np.int32)
    return Moves(**columns, **{name: getattr(parts[-1], name) for name in TABLES})


LACKING: dict[str, Callable[[Moves], NDArray[Any]]] = {
    "held": lambda moves: np.zeros(len(moves), dtype=np.bool_),
    "approach": lambda moves: np.full(moves.end.shape, np.nan),
    "placed": lambda moves: np.ones(moves.end.shape, dtype=np.bool_),
    "spelled": lambda moves: np.zeros(moves.end.shape, dtype=np.bool_),
    "resting": lambda moves: np.zeros(moves.end.shape, dtype=np.bool_),
    "measured": lambda moves: np.zeros(moves.end.shape, dtype=np.bool_),
    "passing": lambda moves: np.zeros(len(moves), dtype=np.int8),
    "beside": lambda moves: np.zeros(len(moves)),
    "across": lambda moves: np.full(len(moves), 2, dtype=np.int8),
    "fixed_centre": lambda moves: np.zeros(len(moves), dtype=np.bool_),
    "call": lambda moves: np.full(len(moves), -1, dtype=np.int32),
    "counted": lambda moves: np.repeat(moves.incremental[:, None], len(moves.axes), axis=1),
}
"""What columns of `Moves` mean that are left out."""


def _joined_columns(name: str, parts: list[Moves]) -> NDArray[Any] | None:
    """One column of parts that follow each other; None if all lack it."""
    columns = [getattr(part, name) for part in parts]
    if all(column is None for column in columns):
        return None
    filled = (LACKING[name](part) if column is None else column for part, column in zip(parts, columns, strict=True))
    return np.concatenate(list(filled))


def last_of(program: Program, moves: Moves) -> tuple[Program, Moves]:
    """The last motion and its block, as copies: the rest need not be kept for them."""
    block = int(moves.block[-1])
    found = stretch(program, block, block + 1)
    columns = ("template", "blocks", "first_number", "number_spans", "numbers")
    alone = replace(found, **{name: getattr(found, name).copy() for name in columns})
    motion = taken(moves, np.array([len(moves) - 1]))
    return alone, replace(motion, block=motion.block - np.int32(block))


def taken(moves: Moves, rows: NDArray[np.intp]) -> Moves:
    """Motions `rows` (k,) alone."""
    columns = ((each.name, getattr(moves, each.name)) for each in fields(Moves) if each.name not in TABLES)
    return replace(moves, **{name: column.take(rows, axis=0) for name, column in columns if column is not None})
