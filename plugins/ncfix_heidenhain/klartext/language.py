"""Heidenhain Klartext as a `WrittenLanguage`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ncfix.control.interpreter import FlatLine
from ncfix.text.reach import whole_text
from ncfix.text.spelling import Spelling
from ncfix.text.tree import Opaque
from ncfix.writer.language import WrittenLanguage
from ncfix_heidenhain.klartext.blocks import parse_block, renumbered, scan, split
from ncfix_heidenhain.klartext.bulk import in_bulk, one_by_one
from ncfix_heidenhain.klartext.control import KlartextControl
from ncfix_heidenhain.klartext.flatten import KlartextFlattener
from ncfix_heidenhain.klartext.interpreter import KlartextInterpreter
from ncfix_heidenhain.klartext.layout import layout_of, uses_comma
from ncfix_heidenhain.klartext.writing import KlartextWriter, spelling_of


def unrolled(interpreter: KlartextInterpreter, steps: Mapping[str, float], limit: int) -> Sequence[FlatLine]:
    """Follow a program and write down its blocks; raises SourceError NCF237 and NCF238."""
    style = Spelling(signed=True, comma=uses_comma(interpreter.main.program.source), point=False)
    flattener = KlartextFlattener(interpreter.control, steps, limit, style)
    interpreter.watcher = flattener
    interpreter.run()
    program = interpreter.main.program
    first = next(block for block in program if "BEGIN" in program.text_of(block).upper())
    last = len(program) - 1
    names = [
        program.slice(block, item.span)
        for block in (first, last)
        for item in program.items_of(block)
        if isinstance(item, Opaque) and item.kind == "program"
    ]
    head = FlatLine(names[0], program.line(first))
    tail = FlatLine(names[0].upper().replace("BEGIN", "END", 1), program.line(last))
    return [head, *flattener.lines, tail]


KLARTEXT = WrittenLanguage(
    split=split,
    end=whole_text,
    scan=scan,
    parse=parse_block,
    control=KlartextControl,
    interpreter=KlartextInterpreter,
    layout=layout_of,
    writer=KlartextWriter,
    spelling=spelling_of,
    arc_pieces=True,
    bulk=in_bulk,
    one_by_one=one_by_one,
    renumber=renumbered,
    unroll=unrolled,
)
