"""Modal groups: which codes exclude each other, which of them a dialect knows, and the codes that it adds.

Sources: LinuxCNC documentation, "G-code modal groups"; for ISO controls the lists of G codes in the Fanuc 30i, Haas
and Okuma programming manuals. Codes are in tenths: G38.2 is 382.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Set
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any, cast

from ncfix.control.expressions import Evaluate
from ncfix.text.dialect import CodeOperation, CycleTable, tenths
from ncfix.text.tree import Expression
from ncfix.values import frozen
from ncfix_iso.rs274.parameters import compiled

if TYPE_CHECKING:
    from ncfix.control.operations import Like
    from ncfix.text.dialect import Dialect


NON_MODAL = "non-modal"
MOTION = "motion"
PLANE = "plane"
DISTANCE = "distance mode"
ARC_DISTANCE = "arc distance mode"
FEED_MODE = "feed mode"
UNITS = "units"
CUTTER = "cutter compensation"
LENGTH = "tool length offset"
RETRACT = "retract mode"
SYSTEM = "coordinate system"
CONTROL = "path control mode"
SPINDLE_MODE = "spindle speed mode"
DIAMETER = "lathe diameter mode"
ROTATION = "coordinate rotation"
UNFOLLOWED = "scaling, mirroring, polar coordinates, tilted planes"
HIGH_SPEED = "high-speed machining"

STOP = "stop"
INPUT_OUTPUT = "input and output"
TOOL = "tool change"
SPINDLE = "spindle and state"
COOLANT = "coolant"
OVERRIDE = "override"
USER = "user-defined"
CALL = "subprogram"

OWN = "code of the dialect's own "
"""Beginning of the group name of a code added by a dialect; each such code has its own group."""

CYCLES = (730, 740, 810, 820, 830, 840, 850, 860, 870, 880, 890)
DYNAMIC_OFFSETS = (431, 432)
"""G43.1 and G43.2, which use the axis words of blocks without a motion code."""

ARCS = (20, 30)
PROBES = (382, 383, 384, 385)
SPLINES = (50, 51, 52)
THREADS = (330, 331, 760)
TURNING_CYCLES = (700, 710, 711, 712, 720, 721, 722)
DIN_UNITS = {700: 200, 710: 210}
"""G70 and G71 of DIN 66025, and the codes with the same meaning."""


def grouped(**codes: tuple[int, ...]) -> dict[int, str]:
    """Code -> group, from keyword arguments named like the constants above."""
    return {code: globals()[name] for name, members in codes.items() for code in members}


LINUXCNC_G = grouped(
    NON_MODAL=(40, 53, 100, 280, 281, 300, 301, 520, 530, 920, 921, 922, 923),
    MOTION=(0, 10, 20, 30, *SPLINES, *THREADS, *PROBES, *TURNING_CYCLES, 800, *CYCLES),
    PLANE=(170, 180, 190, 171, 181, 191),
    DISTANCE=(900, 910),
    ARC_DISTANCE=(901, 911),
    FEED_MODE=(930, 940, 950),
    UNITS=(200, 210),
    CUTTER=(400, 410, 411, 420, 421),
    LENGTH=(430, 431, 432, 490),
    RETRACT=(980, 990),
    SYSTEM=(540, 550, 560, 570, 580, 590, 591, 592, 593),
    CONTROL=(610, 611, 640),
    SPINDLE_MODE=(960, 970),
    DIAMETER=(70, 80),
)

ISO_G = {code: group for code, group in LINUXCNC_G.items() if code not in (70, 80, *SPLINES, 53)} | grouped(
    NON_MODAL=(220, 310, 600),
    LENGTH=(434, 435, 440),
    SYSTEM=(541,),
    ROTATION=(680, 690),
    UNFOLLOWED=(121, 131, 1120, 1130, 150, 160, 500, 501, 510, 511, 682, 683, 684),
    HIGH_SPEED=(50,),
)

ISO_HARMLESS_G = frozenset(code * 10 for code in (8, 9, 11, 23, 25, 26, 62, 63, 103, 187, 332)) | {51, 53}
"""Codes of ISO controls that move nothing and change no coordinates: exact stop, look-ahead, smoothing, limits.

G5.3 P selects the surface smoothness on Hurco, G332 R the balance of speed and accuracy on DMG MORI.
"""

LINUXCNC_M = grouped(
    STOP=(0, 10, 20, 300, 600),
    INPUT_OUTPUT=(620, 630, 640, 650, 660, 670, 680),
    TOOL=(60, 610),
    SPINDLE=(30, 40, 50, 190, 700, 710, 720, 730),
    COOLANT=(70, 80, 90),
    OVERRIDE=(480, 490, 500, 510, 520, 530),
    USER=tuple(range(1000, 2000, 10)),
    CALL=(980, 990),
)

TOOL_CHANGE = 60
"""M6. Of two tools that Mazak names with it, the first is loaded, the second only prepared for the next change."""


DRILLING = tuple(code for code in CYCLES if code >= 810)


@frozen
class Uses:
    """The codes that use an address: motion codes, other G codes, and M codes of the block; in tenths."""

    motions: frozenset[int] = frozenset()
    g_codes: frozenset[int] = frozenset()
    m_codes: frozenset[int] = frozenset()


def uses(motions: tuple[int, ...] = (), g: tuple[int, ...] = (), m: tuple[int, ...] = ()) -> Uses:
    """`Uses` from tuples; turning cycles use every address."""
    return Uses(frozenset((*motions, *TURNING_CYCLES)), frozenset(g), frozenset(m))


USER_M = tuple(range(1000, 2000, 10))
CUTTER_WORDS = (410, 411, 420, 421)

USED_BY: dict[str, Uses] = {
    "D": uses(g=(*CUTTER_WORDS, 960)),
    "E": uses((760,), m=(660, 670, 680)),
    "H": uses((760,), g=(430, 432)),
    "I": uses((*ARCS, 50, 51, 331, 760, 870), g=(100,)),
    "J": uses((*ARCS, 50, 51, 760, 870), g=(100,)),
    "K": uses((*ARCS, 330, 331, 760, 870)),
    "L": uses((52, 730, 760, *DRILLING), g=(100, *CUTTER_WORDS), m=(660, 980)),
    "P": uses(
        (*ARCS, 50, 52, 740, 760, 820, 840, 860, 880, 890),
        g=(40, 100, 640),
        m=(190, 500, 510, 520, 530, 620, 630, 640, 650, 660, 980, *USER_M),
    ),
    "Q": uses((50, 730, 760, 830), g=(100, 640), m=(190, 610, 660, 670, 680, *USER_M)),
    "R": uses((*ARCS, 730, 740, 760, *DRILLING), g=(100, 411, 421), m=(190,)),
}


def unused_word(letters: Set[str], motion: int | None, g_codes: Set[int], m_codes: Set[int]) -> str | None:
    """The first address that no code of the block uses; None if there is none."""
    for letter, users in USED_BY.items():
        used = motion in users.motions or g_codes & users.g_codes or m_codes & users.m_codes
        if letter in letters and not used:
            return letter
    return None


@frozen
class Rules:
    """The meaning that a dialect gives to codes.

    strict      whatever LinuxCNC's interpreter refuses is an error: unknown codes, unused words, missing feed
    g_groups    group of each G code that is followed
    harmless_g  G codes that are ignored
    m_groups    group of each M code that is followed
    steps       G code -> its step, if it differs from that in `order`
    cycles      G codes of canned cycles
    repeats     addresses of the repeat count of a canned cycle
    takes       further G codes, besides those of `plans`, that use the axis words of their block themselves
    radius_first  of R and a centre in one block R is used; otherwise both together are an error
    length_by_h_alone  H without G43 may change the tool length, depending on the control
    din_units   G70 and G71 alone are inches and millimetres, as in DIN 66025
    adds_rotations  in G91 the angle of G68 is added to the one in force
    scales_named  scaling (G51) acts only on the axes named in its block
    one_local   G52 is one shift for all work offsets; otherwise each may have its own
    offset_group  group number of the work offset codes: 14 where #4014 contains the one in force
    system      number -> whether this parameter belongs to the control, so that assigning to it has an effect
    lasting     number -> whether this parameter keeps its value after the program
    compiled    (expression, its address) -> function that computes it
    aliases     (G or M, code) -> code of the family for which a dialect's own code stands
    operations  (G or M, code) -> operations of a dialect's own code
    tables      G code -> drilling cycle of a dialect's own code
    """

    strict: bool
    g_groups: dict[int, str]
    harmless_g: frozenset[int]
    m_groups: Mapping[int, str] = field(default_factory=lambda: LINUXCNC_M)
    steps: Mapping[int, Callable[[Any, Any, int], None]] = field(default_factory=dict)
    cycles: frozenset[int] = frozenset(CYCLES)
    repeats: str = "LK"
    takes: frozenset[int] = frozenset()
    radius_first: bool = False
    length_by_h_alone: bool = False
    din_units: bool = False
    adds_rotations: bool = False
    scales_named: bool = False
    one_local: bool = False
    offset_group: int = 14
    system: Callable[[int], bool] = lambda number: 5161 <= number <= 5390
    lasting: Callable[[int], bool] = lambda number: False
    compiled: Callable[[Expression, str], Evaluate] = compiled
    aliases: Mapping[tuple[str, int], Like] = field(default_factory=dict)
    operations: Mapping[tuple[str, int], tuple[CodeOperation, ...]] = field(default_factory=dict)
    tables: Mapping[int, CycleTable] = field(default_factory=dict)


LINUXCNC = Rules(True, LINUXCNC_G, frozenset(), repeats="L")
ISO = Rules(False, ISO_G, ISO_HARMLESS_G, takes=frozenset({40, 921}), length_by_h_alone=True, din_units=True)
RULES = {"iso": ISO, "linuxcnc": LINUXCNC}
"""Rules by `Dialect.semantics`."""


def with_own_codes(rules: Rules, dialect: Dialect) -> Rules:
    """The rules of a dialect: those of its family with its own codes added."""
    for name, operations in dialect.codes:
        letter, code = name[0], tenths(name)
        if len(operations) == 1 and operations[0].alone:
            rules = replace(rules, aliases={**rules.aliases, (letter, code): cast("Like", operations[0])})
        elif letter == "M":
            rules = with_m_code(rules, code, operations)
        else:
            rules = with_g_code(rules, code, operations)
    for name, table in dialect.cycles:
        rules = with_cycle(rules, tenths(name), table)
    return rules


def with_m_code(rules: Rules, code: int, operations: tuple[CodeOperation, ...]) -> Rules:
    """The rules with an M code that performs `operations`."""
    m_groups = {**rules.m_groups, code: f"{OWN}M{code}"}
    return replace(rules, m_groups=m_groups, operations={**rules.operations, ("M", code): operations})


def with_g_code(rules: Rules, code: int, operations: tuple[CodeOperation, ...]) -> Rules:
    """The rules with a G code that performs `operations`; without any it is ignored."""
    known = {known: group for known, group in rules.g_groups.items() if known != code}
    takes = {code} if any(operation.takes for operation in operations) else set[int]()
    return replace(
        rules,
        g_groups=known | ({code: f"{OWN}G{code}"} if operations else {}),
        harmless_g=rules.harmless_g - {code} if operations else rules.harmless_g | {code},
        operations={**rules.operations, ("G", code): operations},
        takes=(rules.takes - {code}) | takes,
    )


def with_cycle(rules: Rules, code: int, table: CycleTable) -> Rules:
    """The rules with a drilling cycle."""
    return replace(
        rules,
        g_groups={**rules.g_groups, code: MOTION},
        harmless_g=rules.harmless_g - {code},
        cycles=rules.cycles | {code},
        takes=rules.takes - {code},
        tables={**rules.tables, code: table},
    )
