"""Milling along a contour (CYCLE72), followed as a plunge at its start, then block by block at the bottom depth.

So each point of the contour is corrected at its position. The contour is a subprogram of the text, or the blocks
between two labels; CYCLE62 may name it.
Source: Siemens, "SINUMERIK 840D sl, NC programming": CYCLE62, CYCLE72.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy

from ncfix.control.control import MOVED_AS_A_WHOLE
from ncfix.control.coordinates import CENTRE_LETTERS, LETTERS, Plane, mask_of
from ncfix_siemens.sinumerik.cycles.drilling import at_height, drill, lead_to, made
from ncfix_siemens.sinumerik.cycles.milling import milling_of, said_in
from ncfix_siemens.sinumerik.flow import SinumerikFlow, Stretch
from ncfix_siemens.sinumerik.framing import mind_carried, take_up
from ncfix_siemens.sinumerik.plans import Branching, Calling, SinumerikPlan
from ncfix_siemens.sinumerik.state import GEOMETRY, Sinumerik
from ncfix_siemens.sinumerik.unit import SinumerikUnit
from ncfix_siemens.sinumerik.vocabulary import BlockWordValues, Drilling

CONTOUR_WORDS = frozenset({*CENTRE_LETTERS, "CR", "AR", "RND", "CHF", "CHR", "F"})
CONTOUR_CODES = frozenset({0, 10, 20, 30, 400, 900})
CONTOUR_NAMES = frozenset({"diamof", "ret"})
ENDS = frozenset({20, 170})
"""M2 and M17."""
CONTOURS = {0: "{0}", 1: "E_LAB_A_{0}:E_LAB_E_{0}", 2: "{1}:{2}"}
"""Second argument of CYCLE62 -> form of the contour: a subprogram, a contour of the editor, two labels."""

NO_CONTOUR = "the contour of {} is not found: it must be a subprogram, or between two labels"
NOT_REWRITTEN = "{} or its contour is in the file of a subprogram, which ncfix does not rewrite"
OTHER_BLOCK = "the contour of {} has a block that is more than a line or an arc in the plane in force"
NO_START = "the contour of {} does not begin with G0 or G1 to a position with both words as plain numbers"
NOT_ALONE = "{} must be called in a block by itself, in G90 and G40, and not under MCALL"
ALONG = (
    "{} is corrected at each point of its contour, for its bottom; its depth is corrected at the start of the contour"
)


def mill_along(
    control: Sinumerik,
    flow: SinumerikFlow,
    step: Calling,
    words: BlockWordValues,
    block: int,
    find: Callable[[str], SinumerikUnit | None],
    evaluate: Callable[[SinumerikPlan, int], BlockWordValues],
) -> None:
    """Execute a cycle that mills along a contour: plunge at its start, then follow it block by block.

    words     the words of the cycle's block
    find      name -> subprogram
    evaluate  plan and index of a block -> its words, with numbers from the text that `control` reads
    """
    called, name, drilling = step.name.upper(), contour_named(control, step), milling_of(control, step, modal=False)
    fault, found = drilling.fault, flow.stretch(name, find)
    if words.axes or control.modal.incremental or control.modal.compensated or control.modes.modal_cycle is not None:
        fault = fault or NOT_ALONE
    if found is not None and (control.external or found.unit.external):
        fault = fault or NOT_REWRITTEN
    first, wrong = (None, NO_CONTOUR) if found is None else first_of(found, control.modal.plane)
    place = None
    if found is not None and first is not None:
        control.numbers, control.first = found.unit.numbers, found.unit.first[first]
        place = place_in(evaluate(found.unit.plan(first), first), control.modal.plane)
    if found is None or place is None or fault or wrong:
        made(control, block, refusal=(fault or wrong or NO_START).format(called))
        return
    control.warn(MOVED_AS_A_WHOLE, ALONG.format(called))
    flow.go_along(found, name, along_contour(control, block, drilling, place))


def first_of(contour: Stretch, plane: Plane) -> tuple[int | None, str]:
    """The block that leads to the start of a contour; else None and the reason why it cannot be followed."""
    blocks = range(contour.start, contour.stop)
    plans = [contour.unit.plan(block) for block in blocks]
    end = next((place for place, plan in enumerate(plans) if "ret" in plan.names or not ENDS.isdisjoint(plan.m)), None)
    if not all(may_be_contour(plan, plane) for plan in plans[: None if end is None else end + 1]):
        return None, OTHER_BLOCK
    first = next((place for place, plan in enumerate(plans) if plan.axes), None)
    if first is None or plans[first].axes != plane.axes or {0, 10}.isdisjoint(plans[first].g):
        return None, NO_START
    return blocks[first], ""


def place_in(words: BlockWordValues, plane: Plane) -> tuple[float, float] | None:
    """The position in the plane that a block names, in program units; None if unknown."""
    one, two = (words.values.get(letter) for letter in plane.of(LETTERS))
    return None if one is None or two is None or words.forms else (one, two)


def may_be_contour(plan: SinumerikPlan, plane: Plane) -> bool:
    """Whether a block has at most a line or an arc in the plane, and no other effect."""
    for step in plan.steps:
        match step:
            case Calling(name) if name in CONTOUR_NAMES:
                continue
            case Branching("label"):
                continue
        return False
    others = {setting.address for setting in plan.settings} - CONTOUR_WORDS - {*plane.of(LETTERS)}
    quiet = plan.skip is None and plan.opaque <= {"program head"} and ENDS.issuperset(plan.m)
    return quiet and not others and plan.axes & ~plane.axes == 0 and CONTOUR_CODES | {plane.code} >= {*plan.g}


def contour_named(control: Sinumerik, step: Calling) -> str:
    """Name of the contour of a CYCLE72: its argument, or the single CYCLE62 before it; "" if there is none."""
    said, _ = said_in(control, step)
    name = said[0] if said and isinstance(said[0], str) else ""
    if not name and len(control.contours) == 1:
        name = control.contours[0]
    control.milled = True
    return name


def contour_call(control: Sinumerik, step: Calling) -> None:
    """CYCLE62: one more contour for the next cycle."""
    said, _ = said_in(control, step)
    name, kind, first, last = (*said, *[None] * 4)[:4]
    form = CONTOURS.get(round(kind) if isinstance(kind, float) else 0, "")
    control.contours = [] if control.milled else control.contours
    control.contours.append(form.format(name or "", first or "", last or ""))
    control.milled = False


def along_contour(control: Sinumerik, block: int, drilling: Drilling, place: tuple[float, float]) -> Callable[[], None]:
    """Move down to the bottom of a contour at its first block; returns what to call after its last block."""
    take_up(control)
    mind_carried(control)
    control.use_all_start_positions()
    assert drilling.depth is not None
    named, over, _ = lead_to(control, block, place, drilling.name)
    control.builder.rests(mask_of(index for index in control.axis_indices if index not in GEOMETRY))
    modal, stated, down = copy(control.modal), control.stated, at_height(control, over, drilling.depth)
    drill(control, named, over, drilling)
    up = control.here()
    control.stand(down.target, down.unknown, down.lost)
    control.contour = True

    def leave() -> None:
        control.modal, control.stated, control.contour = modal, stated, False
        control.stand(up.target, up.unknown, up.lost)

    return leave
