"""Programs in which a block has only one of AP and RP: the other is the one that was written last.

A corrected block has X and Y instead, so the control would remember an older word. Hence all blocks with polar words
are written anew, or none.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ncfix.control.moves import Moves, Rule
from ncfix.text.tree import Program, Template
from ncfix_siemens.sinumerik.vocabulary import POLAR

POLES = frozenset({1100, 1110, 1120})
ALL_OR_NONE = "polar coordinates of which only one is written, where another block with such words has to stay"


def polar_words(template: Template) -> frozenset[str]:
    """The polar words of a motion: AP, RP."""
    if not POLES.isdisjoint(template.g_codes):
        return frozenset()
    return frozenset(word.address for word in template.words) & POLAR


def has_partial(program: Program) -> bool:
    """Whether a block relies on a polar word that was written before."""
    return any(len(polar_words(template)) == 1 for template in program.templates)


def all_or_none(moves: Moves, program: Program) -> Moves:
    """The motions, with all that have polar words refused where one of them cannot be corrected."""
    if not has_partial(program):
        return moves
    shapes = [index for index, template in enumerate(program.templates) if polar_words(template)]
    polar = np.isin(program.template[moves.block], shapes)
    if not (polar & (moves.rule != Rule.CORRECT)).any():
        return moves
    rows = polar & (moves.rule == Rule.CORRECT)
    reasons = (*moves.reasons, ALL_OR_NONE)
    reason = np.where(rows, len(moves.reasons), moves.reason).astype(np.int16)
    return replace(moves, rule=np.where(rows, Rule.REFUSE, moves.rule).astype(np.int8), reason=reason, reasons=reasons)
