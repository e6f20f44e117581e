"""Free contours (FK) of a program: reading their blocks, working them out (`free`), and writing plain lines and arcs.

A free contour is worked out as a whole when its first element is reached. Its blocks are refused, since a corrected
element would contradict the data of the others; --flatten writes them as plain lines and arcs.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping

from ncfix.control.coordinates import PLANES, X, Y, dot, rotated
from ncfix.control.expressions import Unknown, Value, nominal, scaled
from ncfix.text.spelling import value_of
from ncfix_heidenhain.klartext.arcs import IN_PLANE, somewhere
from ncfix_heidenhain.klartext.control import FREELY, KlartextControl
from ncfix_heidenhain.klartext.free import ContourElement, Element, solved
from ncfix_heidenhain.klartext.layout import CORNERS
from ncfix_heidenhain.klartext.plans import QParameters
from ncfix_heidenhain.klartext.targets import command_of, here, pole_frame
from ncfix_heidenhain.klartext.units import KlartextUnit

FREE_CONTOUR = "free contour programming (FK): the control calculates the contour"
WRITTEN_OUT = "a free contour (FK): with --flatten ncfix writes it as lines and arcs"
MAX_GAP_MM = 1e-3
"""By how much the data of a contour may contradict each other: drawings have three decimals."""

FUNCTION = re.compile(r"F(?P<arc>C|L)(?P<tangential>T?)(?=\s|$)", re.IGNORECASE)
VALUE = r"[+-]?\s*(?:Q[LR]?\d+|\d+[.,]?\d*|[.,]\d+)"
WORD = re.compile(rf"(?<![A-Z0-9])(X|Y|AN|LEN|CCX|CCY|CCA|R)\s*({VALUE})(?![\w.,])", re.IGNORECASE)
SENSE = re.compile(r"(DR|CLSD)\s*([+-])(?!\s*[\d.,Q])", re.IGNORECASE)
REST = re.compile(
    rf"\b(R0(?![\d.,])|R[LR]\b|F\s*MAX|F\s*AUTO|F\s*{VALUE}|M\s*(?:[0134578]|9|13|14)(?!\d))", re.IGNORECASE
)
"""What a block may have besides geometry, and keeps when it is rewritten: compensation, feed, some M codes."""

LEFT_OUT = re.compile(r";[^\r\n]*|~(?=[ \t\r]*(?:\n|\Z))")
"""What is taken out of a statement before it is read: comments, and `~` at the end of a line."""

OF_LINES, OF_ARCS = frozenset({"X", "Y", "AN", "LEN"}), frozenset({"X", "Y", "CCX", "CCY", "CCA", "R"})


def solved_element(control: KlartextControl, unit: KlartextUnit, block: int) -> ContourElement | None:
    """The element of a block, worked out with its whole contour; None if the contour is not certain."""
    known = control.path.free
    if (unit.external, block) not in known:
        known.clear()
        known |= worked_out(control, unit, block)
    return known[unit.external, block]


def follow_free(control: KlartextControl, unit: KlartextUnit, block: int) -> None:
    """Execute an element of a free contour: it is refused, and the motion before must end where the program says.

    The element lies in the working plane, so after one that is not certain only X and Y are not known.
    """
    element = solved_element(control, unit, block)
    control.path.free.pop((unit.external, block))
    where = here(control)
    if element is None:
        where.unknown |= {X: FREELY, Y: FREELY}
        somewhere(control, 0, command_of(control, where, IN_PLANE), FREE_CONTOUR)
        return
    where.inner[X], where.inner[Y] = control.scale[X] * element.end.real, control.scale[Y] * element.end.imag
    somewhere(control, 0, command_of(control, where, IN_PLANE), WRITTEN_OUT)
    x, y, z = rotated(control.rotation, [element.heading.real, element.heading.imag, 0.0])
    control.path.tangent = x, y, z


# -- from blocks to elements ------------------------------------------------------------------------------------------


def worked_out(
    control: KlartextControl, unit: KlartextUnit, first: int
) -> dict[tuple[str, int], ContourElement | None]:
    """(program, block) -> element, for the contour that begins with a block; all None if it is not certain."""
    blocks = list(blocks_of_contour(unit, first))
    keys = [(unit.external, block) for block in blocks]
    control.use_start_positions((X, Y))
    path = control.path  # arcs are written about poles of their own: could the one in force not be put back?
    other = path.pole is not None and (path.plane != PLANES[170] or path.pole_in != pole_frame(control))
    lost = X in control.unknown or Y in control.unknown or other
    if lost or control.cycle.modal or any(unit.plan(block).skip for block in blocks):
        return dict.fromkeys(keys)
    elements = [element_of(control, statement_text(unit, block)) for block in blocks]
    known = [element for element in elements if element is not None]
    begin = here(control).inner
    start = complex(begin[X] / control.scale[X], begin[Y] / control.scale[Y])
    near = MAX_GAP_MM / control.stretch
    found = solved(known, start, heading_of(control), near) if len(known) == len(blocks) else None
    return dict.fromkeys(keys) if found is None else dict(zip(keys, found, strict=True))


def blocks_of_contour(unit: KlartextUnit, first: int) -> Iterator[int]:
    """The blocks with elements of a contour; corners and empty blocks may stand between them."""
    for block in range(first, unit.stop):
        plan = unit.plan(block)
        if plan.statement is not None and FUNCTION.match(statement_text(unit, block)):
            yield block
        elif not plan.empty and plan.name not in CORNERS:
            return


def statement_text(unit: KlartextUnit, block: int) -> str:
    """The statement of a block without comments."""
    statement = unit.plan(block).statement
    assert statement is not None
    return LEFT_OUT.sub(" ", unit.program.slice(block, statement[1])).strip()


def heading_of(control: KlartextControl) -> complex | None:
    """The direction in the working plane in which the element before ends; None if it is not known."""
    tangent = control.path.tangent
    if tangent is None:
        return None
    ahead = complex(dot(control.inverse[X], tangent), dot(control.inverse[Y], tangent))
    return ahead / abs(ahead) if abs(ahead) > math.sqrt(0.5) else None


def element_of(control: KlartextControl, text: str) -> Element | None:
    """The data that a block gives of its element; None if some are not understood, or known only at run time."""
    found = FUNCTION.match(text)
    if found is None:
        return None
    arc, rest = found["arc"].upper() == "C", text[found.end() :]
    if SENSE.sub(" ", WORD.sub(" ", REST.sub(" ", rest))).strip():
        return None
    words, parameters = WORD.findall(REST.sub(" ", rest)), control.scope.parameters
    pairs = [(name.upper(), number(value, parameters)) for name, value in words]
    signs = {name.upper(): 1 if sign == "+" else -1 for name, sign in SENSE.findall(rest)}
    if any(isinstance(value, Unknown) for _, value in pairs):
        return None
    values = {name: nominal(value) for name, value in pairs}
    fits = values.keys() <= (OF_ARCS if arc else OF_LINES) and len(values) == len(pairs) and (arc or "DR" not in signs)
    if not fits or ("CCX" in values) != ("CCY" in values):
        return None
    return Element(
        arc,
        bool(found["tangential"]),
        x=values.get("X"),
        y=values.get("Y"),
        angle=in_radians(values, "AN"),
        length=values.get("LEN"),
        centre=complex(values["CCX"], values["CCY"]) if "CCX" in values else None,
        radius=values.get("R"),
        sense=signs.get("DR", 0) if arc else 0,
        turn=in_radians(values, "CCA"),
        opens=signs.get("CLSD") == 1,
        closes=signs.get("CLSD") == -1,
    )


def number(text: str, parameters: QParameters) -> Value:
    """The value of a number or a Q parameter, with its sign."""
    bare = "".join(text.split()).lstrip("+-")
    value = parameters.get(bare.upper()) if bare[0] in "Qq" else value_of(bare)
    return scaled(-1.0 if text.startswith("-") else 1.0, value)


def in_radians(values: Mapping[str, float], name: str) -> float | None:
    """The value of an address in degrees as rad; None without it."""
    return math.radians(values[name]) if name in values else None


# -- written out ------------------------------------------------------------------------------------------------------


def written_out(control: KlartextControl, unit: KlartextUnit, block: int, place: Callable[[complex], str]) -> list[str]:
    """Plain blocks for an element, which restore the pole; none if the element is not certain.

    place  writes a point as words
    """
    statement = unit.plan(block).statement
    if statement is None or not FUNCTION.match(statement_text(unit, block)):
        return []
    element = solved_element(control, unit, block)
    if element is None:
        return []
    others = " ".join("".join(word.split()) for word in REST.findall(statement_text(unit, block)))
    if element.circle is None:
        return [f"L {place(element.end)} {others}".rstrip()]
    sense = "DR+" if element.circle.sense > 0 else "DR-"
    blocks = [f"CC {place(element.circle.centre)}", f"C {place(element.end)} {sense} {others}".rstrip()]
    pole = control.path.pole
    if pole is not None:
        blocks.append(f"CC {place(complex(pole[0] / control.scale[X], pole[1] / control.scale[Y]))}")
    return blocks
