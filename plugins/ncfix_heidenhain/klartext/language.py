"""Heidenhain Klartext as a `Language`."""

from __future__ import annotations

from ncfix.text.language import Language
from ncfix.text.reach import whole_text
from ncfix_heidenhain.klartext.blocks import parse_block, renumbered, scan, split
from ncfix_heidenhain.klartext.bulk import in_bulk, one_by_one
from ncfix_heidenhain.klartext.control import KlartextControl
from ncfix_heidenhain.klartext.flatten import unrolled
from ncfix_heidenhain.klartext.interpreter import KlartextInterpreter
from ncfix_heidenhain.klartext.layout import layout_of
from ncfix_heidenhain.klartext.writing import KlartextWriter, spelling_of

KLARTEXT = Language(
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
