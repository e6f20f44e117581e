"""Corners that the control rounds (,R) or breaks (,C): the corner itself is corrected, the control puts in the rest.

The two motions that meet must lie in one plane, and neither may be split: what they name between them is that plane,
and words of other axes are not added to them.
Source: Fanuc 30i operator's manual (machining centre), "Optional chamfering and corner R".
"""

from __future__ import annotations

from collections.abc import Iterable

from ncfix.text.layout import AXIS_LETTERS, CENTRE_LETTERS
from ncfix.text.tree import Program, Template, Word

CORNER = frozenset((",R", ",C"))
AXES = frozenset(AXIS_LETTERS)
MOTION = AXES | frozenset(CENTRE_LETTERS)


def letters_of(template: Template) -> frozenset[str]:
    """The addresses of the words of a shape."""
    return frozenset(item.address for item in template.items if isinstance(item, Word))


def has_corners(program: Program) -> bool:
    """Whether the control puts in corners anywhere in a program."""
    return any(CORNER & letters_of(template) for template in program.templates)


def axes_of_corner(program: Program, block: int) -> frozenset[str] | None:
    """The axes that a block at a corner may name, None for other blocks."""
    own = letters_of(program.templates[int(program.template[block])])
    before = neighbour(program, range(block - 1, -1, -1))
    named = own | before if CORNER & before else frozenset()
    if CORNER & own:
        named |= own | neighbour(program, range(block + 1, len(program)))
    return named & AXES if named else None


def neighbour(program: Program, blocks: Iterable[int]) -> frozenset[str]:
    """The addresses of the first of these blocks that has a motion."""
    found = (letters_of(program.templates[int(program.template[each])]) for each in blocks)
    return next((letters for letters in found if letters & MOTION), frozenset())
