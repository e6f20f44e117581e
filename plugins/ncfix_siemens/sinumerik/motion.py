"""The motion of one block: lines, arcs, machine coordinates, reference points, refused motions; synchronized actions.

A synchronized action may be executed at any time during the blocks that follow.
"""

from __future__ import annotations

import re

from ncfix.control.control import AFTER_THAT
from ncfix.control.coordinates import CENTRE_LETTERS, INDEX, mask_of
from ncfix.control.moves import MotionEnd, MotionKind, Pass, Passing
from ncfix_siemens.sinumerik.circles import OF_ARCS, OF_CIP, arc, misled, tangential, through_point
from ncfix_siemens.sinumerik.cycles.drilling import TO_A_HOLE, drill, hole_after
from ncfix_siemens.sinumerik.destination import destination, doubtful_polar, machine_destination
from ncfix_siemens.sinumerik.framing import mind_carried, take_up
from ncfix_siemens.sinumerik.orientation import oriented
from ncfix_siemens.sinumerik.state import GEOMETRY, Sinumerik
from ncfix_siemens.sinumerik.vocabulary import ALONG_TOOL, MOTIONS, UNFOLLOWED_MOTIONS, BlockWordValues

_ACTION = r"""
    \$A_\w+(?:\[[^\]]*\])?=\S+
    | \$AC_(?:OVR|VC|MARKER|PARAM|TIMER|FIFO\d*)(?:\[[^\]]*\])?=\S+ | \$AA_(?:OVR|VC)\[\w+\]=\S+
    | [MHS]\d*=?[\d.]+ | (?:SETAL|LOCK|UNLOCK|RESET|CANCEL)\([^()]*\) | RDISABLE
"""
HARMLESS = re.compile(rf"(?:(?:{_ACTION})\s*)+", re.IGNORECASE | re.VERBOSE)
"""Actions that move no axis, and change no coordinates and no variable that the program uses."""

DO = re.compile(r"\bDO\b", re.IGNORECASE)
AROUND_EQUALS = re.compile(r"\s*=\s*")


def is_harmless(text: str) -> bool:
    """Whether a synchronized action cannot affect anything that is followed."""
    _, *actions = DO.split(AROUND_EQUALS.sub("=", text.split(";")[0]), maxsplit=1)
    return bool(actions) and HARMLESS.fullmatch(actions[0].strip()) is not None


EVERY_BLOCK = re.compile(r"[ \t]*IDS?[ \t]*=", re.IGNORECASE)
WITHIN_A_BLOCK = re.compile(r"\$AC_(?:PATHN|PLT[BE]B|DT[BE][BW]|TIME[CS]{0,2})(?!\w)", re.IGNORECASE)
"""System variables of the progress of a block, in path or time."""


def watch(control: Sinumerik, text: str) -> None:
    """Take a harmless synchronized action into force: for the next block, or with ID for all that follow."""
    control.acting |= EVERY_BLOCK.match(text) is None
    if WITHIN_A_BLOCK.search(text):
        control.modes.by_block |= {"actions"}


MACHINE = "machine coordinates ({})"
MEASURING = Passing(Pass.PROBING, "measuring (MEAS)")
DWELL = Passing(Pass.DWELL, "dwell")
AFTER_MEASURING = "the position of the axis {} after measuring is known only at run time"
REFERENCE = {
    code: Passing(Pass.REFERENCE_POINT, words)
    for code, words in ((740, "reference point (G74)"), (750, "fixed point (G75)"), (7510, "fixed point (G751)"))
}
AFTER_REFERENCE = "the position of the axis {} after a reference or fixed point is not given"
SOFT_APPROACH = frozenset({1470, 1480, 2470, 2480, 3470, 3480})
BY_ANGLE = "a contour that is given by an angle (ANG)"
AFTER_APPROACH = "the position of the axis {} after a soft approach or retraction is not known"
CORNERS = frozenset({"RND", "CHF", "CHR"})
"""Words of a rounding or chamfer at the end of the block."""

CIP, CT = MOTIONS["cip"], MOTIONS["ct"]
OTHER_WAYS = UNFOLLOWED_MOTIONS.keys() | {20, 30, CIP, CT}
"""Motion codes whose motions are no straight lines."""


TAKING = {20: ("G2", OF_ARCS), 30: ("G3", OF_ARCS), CIP: ("CIP", OF_CIP), CT: ("CT", frozenset({"TURN"}))}
"""Motion code -> its name, and the arc words that it takes."""


def moved(control: Sinumerik, words: BlockWordValues, special: frozenset[str]) -> None:
    """Execute the motion of a block; special: statements for this block only (`supa`, `meas`, ...)."""
    code = control.modal.motion
    if code in (0, 10):
        control.modal.straight = code
    if ALONG_TOOL in words.values:
        control.refuse_here(f"a motion along the tool ({ALONG_TOOL})")
        return
    take_up(control)
    machine = next((name for name in ("supa", "g53", "g153") if name in special), "")
    if not machine:
        mind_carried(control)
    corner = control.modes.rounds or control.contour or not CORNERS.isdisjoint(words.values)
    control.at_corner = not machine and (corner or control.cornered)
    words.whole = words.whole or control.at_corner or is_one_piece(control, words)
    oriented(control, words)
    drilling = control.modes.modal_cycle
    if drilling is not None and not special and code not in OTHER_WAYS:
        control.use_all_start_positions()
        drill(control, words, destination(control, words), drilling, refusal=refusal_of(control, words), modal=True)
    else:
        words.refusal = words.refusal or (TO_A_HOLE if drilling is not None else "")
        by_itself(control, words, special, machine)
        if drilling is not None:
            hole_after(control, words)
    control.wrap()
    control.cornered, control.at_corner, control.acting = corner, False, False


def by_itself(control: Sinumerik, words: BlockWordValues, special: frozenset[str], machine: str) -> None:
    """Execute a motion without a hole; machine: the statement of machine coordinates, or ""."""
    if machine:
        to_machine_position(control, words, machine.upper())
    elif "meas" in special:
        measure(control, words)
    elif "soft" in special:
        refused(control, words, control.modal.motion, "a soft approach or retraction (G147, G148, ...)")
        control.lose(GEOMETRY, AFTER_APPROACH)
    elif "g63" in special:
        refused(control, words, control.modal.motion, "tapping (G63)")
    else:
        as_coded(control, words, control.modal.motion)


def straight(control: Sinumerik, words: BlockWordValues, code: int) -> None:
    """Execute a straight motion, G0 or G1."""
    end = destination(control, words)
    control.go(MotionKind.FEED if code else MotionKind.RAPID, words, end, code, refusal=refusal_of(control, words))
    if "ANG" in words.values:
        plane = control.modal.plane
        control.lose([i for i in (plane.first, plane.second) if not words.axes >> i & 1], AFTER_THAT.format(BY_ANGLE))


def is_one_piece(control: Sinumerik, words: BlockWordValues) -> bool:
    """Whether a motion must not be split: because of its time or feed, REPEAT, or effects that act by blocks."""
    timed = control.modal.feed_mode == 93 and control.modal.motion != 0 and "F" not in words.values
    by_block = control.acting or bool(control.modes.by_block)
    return timed or "FB" in words.values or words.block in control.solitary or by_block


def as_coded(control: Sinumerik, words: BlockWordValues, code: int) -> None:
    """Execute the words by the motion code in force."""
    name, taken = TAKING.get(code, (f"G{code // 10}", frozenset({*CENTRE_LETTERS, "ANG"})))
    why = "" if code in UNFOLLOWED_MOTIONS else misled(control, words, name, taken)
    if why:
        refused(control, words, code, why)
        control.lose(GEOMETRY, AFTER_THAT.format(why))
    elif code in (20, 30):
        arc(control, words, code)
    elif code == CIP:
        through_point(control, words, code)
    elif code == CT:
        tangential(control, words)
    elif code in UNFOLLOWED_MOTIONS:
        refused(control, words, code, UNFOLLOWED_MOTIONS[code])
    else:
        straight(control, words, 10 if code not in (0, 10) else code)


def refusal_of(control: Sinumerik, words: BlockWordValues) -> str:
    """Why a straight motion is refused though its end is known; "" if it is not."""
    if words.values.keys() & {"RND", "RNDM", "CHF", "CHR", "ANG"} and words.unknown("RND", "RNDM", "CHF", "CHR"):
        return "a rounding or chamfer is known only at run time"
    if "ANG" in words.values:
        return BY_ANGLE
    return doubtful_polar(control, words)


def refused(control: Sinumerik, words: BlockWordValues, code: int, why: str) -> None:
    """Add a refused motion, of which only the end is followed."""
    control.use_all_start_positions()
    control.go(MotionKind.FEED, words, destination(control, words), code, refusal=why)


def to_machine_position(control: Sinumerik, words: BlockWordValues, name: str) -> None:
    """Execute a motion in machine coordinates: SUPA, G53, G153."""
    end = machine_destination(control, words)
    code = control.modal.motion if control.modal.motion in (0, 10) else control.modal.straight
    kind = MotionKind.RAPID if code == 0 else MotionKind.FEED
    control.go(kind, words, end, code, passing=Passing(Pass.MACHINE_COORDINATES, MACHINE.format(name)), by_machine=True)


def measure(control: Sinumerik, words: BlockWordValues) -> None:
    """Execute MEAS: a motion towards the words until the probe switches; the end is unknown."""
    end = destination(control, words)
    moved = [i for i in control.axis_indices if end.target[i] != control.position[i] or i in end.unknown]
    gone = dict.fromkeys(moved, AFTER_MEASURING)
    lost = end.lost | control.along_frame(gone)
    ends = MotionEnd(end.target, end.unknown | gone, lost)
    control.go(MotionKind.FEED, words, ends, control.modal.motion, passing=MEASURING)


def to_reference(control: Sinumerik, words: BlockWordValues, code: int) -> None:
    """Execute G74, G75 and G751: the named axes (also `X1=0`) move to a fixed point of the machine."""
    named = [INDEX[address[0]] for address in words.values if address[:1] in INDEX]
    gone = tuple(index for index in dict.fromkeys(named) if index in control.axis_indices)
    reasons = dict.fromkeys((*gone, *(GEOMETRY if gone and control.tcp else ())), AFTER_REFERENCE)
    reasons = {index: why for index, why in reasons.items() if index in control.axis_indices}
    lost = control.lost_in_frame() | control.along_frame(reasons)
    words = BlockWordValues(words.block, axes=mask_of(gone))
    end = MotionEnd(control.position[:], dict(control.unknown) | reasons, lost)
    control.go(MotionKind.RAPID, words, end, control.modal.motion, passing=REFERENCE[code], by_machine=True)


def dwell(control: Sinumerik, words: BlockWordValues) -> None:
    """Execute G4, a dwell: F seconds, or S revolutions."""
    control.go(MotionKind.DWELL, BlockWordValues(words.block), control.here(), control.modal.motion, passing=DWELL)
