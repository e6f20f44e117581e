"""The codes of controls of the Fanuc family, and their effects where they differ from the common core.

Sources: Fanuc 30i operator's manual (machining centre), "G code list"; Haas mill operator's manual, "G codes";
Mitsubishi M700V programming manual. Codes are in tenths: G68.2 is 682.

Canned cycles differ from those of LinuxCNC: R and the depth stay in force as levels, whatever G90 or G91 says.

Source: Fanuc 30i operator's manual (machining centre), "Canned cycle for drilling": in G91 R counts from the initial
level and the depth from R, in the block that names them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ncfix.control.coordinates import LETTERS
from ncfix.control.expressions import Fault, Unknown
from ncfix.control.operations import BlockValues, Destination, Like, Operation, Refuse
from ncfix.values import frozen
from ncfix_fanuc.macro import coordinates, data, lengths, patterns, tilt
from ncfix_fanuc.macro.variables import compiled, is_lasting, is_system
from ncfix_iso.rs274 import groups
from ncfix_iso.rs274.control import Block, RS274Control
from ncfix_iso.rs274.cycles import BAD_CYCLE, drill, place_hole, repeats
from ncfix_iso.rs274.groups import ISO_G, Rules, grouped
from ncfix_iso.rs274.systems import check_system, preset_system, unfollowed

if TYPE_CHECKING:
    from ncfix.control.control import ProgramControl

MACRO = "macro call"

FOREIGN = frozenset(
    {
        *(171, 181, 191, 281, 301, 591, 592, 593, 901, 911, 922, 923),
        *(*groups.TURNING_CYCLES, *groups.PROBES, 331, 760, 431, 432, 411, 421, 890),
    }
)
"""Codes of LinuxCNC that have no meaning, or another one, on these controls."""

FANUC_G = {code: group for code, group in ISO_G.items() if code not in FOREIGN} | {
    650: MACRO,
    660: MACRO,
    661: MACRO,
    670: MACRO,
    491: groups.LENGTH,
    531: groups.NON_MODAL,
    536: groups.NON_MODAL,
    542: groups.NON_MODAL,
    544: groups.NON_MODAL,
    270: groups.NON_MODAL,
    290: groups.NON_MODAL,
    682: groups.ROTATION,
    683: groups.ROTATION,
    684: groups.ROTATION,
    760: groups.MOTION,
    842: groups.MOTION,
    843: groups.MOTION,
    890: groups.MOTION,
    630: groups.CONTROL,
}

ALL_CYCLES = frozenset((*groups.CYCLES, 760, 842, 843))
"""G76 bores here; G84.2 and G84.3 tap."""

FANUC_HARMLESS = (groups.ISO_HARMLESS_G - {630}) | {54, 401, 502, 805}
"""G5.4 concerns the servo drives; G40.1, G50.2 and G80.5 end functions that are refused where they begin."""

FANUC_M = grouped(
    STOP=(0, 10, 20, 300), TOOL=(60,), SPINDLE=(30, 40, 50, 190), COOLANT=(70, 80, 90), CALL=(970, 980, 990, 1980)
)


def cycle(control: RS274Control, block: Block, code: int) -> None:
    """Drill the holes of one block."""
    modal, across = control.modal, control.modal.plane.across
    if not modal.incremental and not control.offset_checked:
        check_system(control)
    control.use_start_positions(tuple(control.unknown))
    program = control.program_position()
    initial = program[across] if modal.cycle.initial is None else modal.cycle.initial
    take_levels(control, block, initial, control.dialect.cycle_of(code).level)
    modal.cycle.initial, modal.cycle.level, modal.motion = initial, modal.cycle.r, code
    if modal.cycle.r < modal.cycle.depth and code != BACK_BORING:
        levels = f"{modal.cycle.r:g} and {modal.cycle.depth:g} mm"
        raise Fault(BAD_CYCLE, f"R is below the bottom of the hole ({levels})")
    at_level = control.dialect.cycle_of(code).ends_at_level(modal.retract_to_r)
    clear = modal.cycle.r if at_level else max(initial, modal.cycle.r)
    for _ in range(repeats(control, block, code)):
        place_hole(control, block, program)
        drill(control, block, code, program, modal.cycle.depth, modal.cycle.r, clear)


def take_levels(control: RS274Control, block: Block, initial: float, letter: str = "R") -> None:
    """Set R and the depth of the block as levels in the program's frame, mm; those not named stay in force.

    letter  the address of R
    """
    modal, across = control.modal, control.modal.plane.across
    sticky, depth = modal.cycle, LETTERS[across]
    in_force = sticky.initial is not None
    if not in_force:
        sticky.unknown = False
        if depth not in block.values:
            raise Fault(BAD_CYCLE, f"{depth} is missing: a canned cycle cannot begin without it")
        if letter not in block.values:
            sticky.r = initial
    if letter in block.values:
        sticky.r = modal.unit * block.values[letter] + (initial if modal.incremental else 0.0)
    if depth in block.values:
        sticky.depth = control.scale[across] * block.values[depth] + (sticky.r if modal.incremental else 0.0)
    sticky.unknown |= bool(block.unknown & {letter, depth})


FANUC = Rules(
    strict=False,
    g_groups=FANUC_G,
    harmless_g=FANUC_HARMLESS,
    m_groups=FANUC_M,
    steps={
        100: data.set_data,
        150: coordinates.switch_polar,
        160: coordinates.switch_polar,
        270: data.check_reference,
        280: data.to_reference,
        290: data.made,
        **dict.fromkeys((430, 434, 435, 440, 490, 491), lengths.tool_offset),
        500: coordinates.switch_scaling,
        510: coordinates.switch_scaling,
        501: coordinates.mirror,
        511: coordinates.mirror,
        531: tilt.align,
        536: tilt.align,
        542: data.setting_error,
        544: data.setting_error,
        680: tilt.rotate,
        682: tilt.tilt,
        683: tilt.tilt,
        684: tilt.tilt,
        690: tilt.rotate,
        921: preset_system,
        **dict.fromkeys(ALL_CYCLES, cycle),
    },
    cycles=ALL_CYCLES,
    radius_first=True,
    one_local=True,
    takes=frozenset({40, 100, 270, 290, 531, 536, 650, 660, 661, 670, 921}),
    system=is_system,
    lasting=is_lasting,
    compiled=compiled,
)

HAAS_OFFSETS = (1540, *range(1100, 1300, 10))
"""G154 P, and its first twenty by their own names G110 to G129."""

CIRCULAR_POCKETS = (120, 130)
HAAS_PATTERNS, MITSUBISHI_PATTERNS = (700, 710), (340, 350, 360, 371)
HAAS_MADE = (*CIRCULAR_POCKETS, *HAAS_PATTERNS, 470, 720, 1500, data.SQUARE)
"""Circular pockets, engraving, rows of holes, pockets, the turn to a feature: G12, G13, G47, G70 to G72, G150, G253."""
HAAS_FEATURE = (2680, 2690)
"""A feature coordinate system: G268 to G269."""

HAAS_MIRRORS, HAAS_CYLINDER = (1000, coordinates.HAAS_MIRROR), 1070
"""Mirror images about the zero point, G101 and G100, and G107, with which an axis goes round a cylinder."""

HAAS_JUMPS = {
    960: "which blocks are executed after M96 depends on an input of the machine",
    460: "which blocks are executed after M46 depends on the pallet in the machine",
}
HAAS_END, HAAS_QUESTION = 1990, 1090
"""M199, which ends a program, or returns from it while pallets are changed, and M109, which asks the operator."""


@frozen
class Ask(Operation):
    """M109 Pn: variable n gets the code of the key that the operator presses."""

    def carry_out(self, control: ProgramControl, block: BlockValues, destination: Destination) -> None:
        """See `Operation`."""
        if "P" in block.values and isinstance(control, RS274Control):
            control.parameters.assign(round(block.values["P"]), Unknown())


HAAS = replace(
    FANUC,
    g_groups=FANUC_G
    | dict.fromkeys(HAAS_MADE, groups.NON_MODAL)
    | dict.fromkeys(HAAS_OFFSETS, groups.SYSTEM)
    | dict.fromkeys((*HAAS_FEATURE, *HAAS_MIRRORS, HAAS_CYLINDER), groups.UNFOLLOWED)
    | {lengths.HAAS_TIP: groups.LENGTH, tilt.DYNAMIC_ON: groups.ROTATION, tilt.DYNAMIC_OFF: groups.ROTATION},
    steps={
        **FANUC.steps,
        **dict.fromkeys(HAAS_MADE, data.made),
        **dict.fromkeys(CIRCULAR_POCKETS, data.circular_pocket),
        **dict.fromkeys(HAAS_PATTERNS, patterns.pattern),
        **dict.fromkeys(HAAS_OFFSETS, data.extended),
        **dict.fromkeys(HAAS_FEATURE, unfollowed),
        **dict.fromkeys(HAAS_MIRRORS, coordinates.mirror_about_zero),
        HAAS_CYLINDER: coordinates.map_on_cylinder,
        **dict.fromkeys((tilt.DYNAMIC_ON, tilt.DYNAMIC_OFF), tilt.dynamic_offset),
        lengths.HAAS_TIP: lengths.tool_offset,
        280: data.to_reference_without_length,
    },
    takes=FANUC.takes | {*HAAS_MADE, *HAAS_FEATURE, *HAAS_MIRRORS, HAAS_CYLINDER},
    repeats="L",
    radius_first=False,
    adds_rotations=True,
    offset_group=12,
    aliases={("M", HAAS_END): Like("M30")},
)
for _code, _reason in HAAS_JUMPS.items():
    HAAS = groups.with_m_code(HAAS, _code, (Refuse(_reason),))
HAAS = groups.with_m_code(HAAS, HAAS_QUESTION, (Ask(),))
"""Haas has its additional work offsets under G154 Pn (G54.1Pn in the setup), mills texts and pockets on its own, pecks
by I J K, and jumps by M96 P Q while an input is off, by M46 Q P for a pallet."""

MITSUBISHI_MADE = (*CIRCULAR_POCKETS, *MITSUBISHI_PATTERNS)
"""Circular pockets and rows of holes: G12, G13, G34 to G37.1."""
MITSUBISHI = replace(
    FANUC,
    g_groups=FANUC_G | dict.fromkeys(MITSUBISHI_MADE, groups.NON_MODAL),
    steps={
        **FANUC.steps,
        **dict.fromkeys(CIRCULAR_POCKETS, data.circular_pocket_here),
        **dict.fromkeys(MITSUBISHI_PATTERNS, patterns.pattern),
    },
    takes=FANUC.takes | set(MITSUBISHI_MADE),
    scales_named=True,
    one_local=False,
    offset_group=12,
)
"""Mitsubishi also mills circular pockets and drills patterns on its own, and numbers modal groups otherwise."""

RULES = {"fanuc": FANUC, "haas": HAAS, "mitsubishi": MITSUBISHI}
"""The rules of each control, by `Dialect.semantics`."""

BACK_BORING = 870
"""G87 goes down to R, and cuts upwards to its depth."""
