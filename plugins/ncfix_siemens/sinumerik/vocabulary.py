"""The vocabulary of SINUMERIK: names by their meaning for the interpreter; word values of a block; modal states.

Source: Siemens, "SINUMERIK 840D sl, NC programming": tables of statements. All names are in lower case.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import field

from ncfix.control.coordinates import INDEX, LETTERS
from ncfix.control.frames import ZEROS
from ncfix.values import frozen, mutable

_SETTERS = """
    movt ar ap rp cr turn rnd rndm chf chr frc frcm ang offn lead tilt theta psi phi nut disr discl disc adis adispos
    ovr ovrra fl fb fz fprda spos sposa meas meaw meawa measa po pl pw sd prio rpl lims disrp dism
"""
SETTERS = frozenset(_SETTERS.split())
"""Names that are addresses, `CR=5`; other names with a value are variables."""

POLAR = frozenset({"AP", "RP"})
"""Polar coordinates: angle and radius about the pole."""

POLES = frozenset({1100, 1110, 1120})
"""Codes, in tenths, that set the pole: G110 and its like."""

VECTOR = ("A3", "B3", "C3")
ANGLES = ("A2", "B2", "C2")
NORMALS = frozenset(["A4", "B4", "C4", "A5", "B5", "C5"])
"""Surface normals, by which the control offsets the contour (CUT3D) and leads the tool (ORIPATH)."""

ALONG_TOOL = "MOVT"
"""Motion along the tool direction."""

OTHERS = frozenset(["A6", "B6", "C6", "A7", "B7", "C7", "LEAD", "TILT", "THETA", "PSI", "PHI", "NUT"])
"""Other words for the orientation of the tool, which are not followed."""

_ARCS = frozenset({"CR", "AR", "TURN", "I1", "J1", "K1"})
PATH_WORDS = POLAR | NORMALS | OTHERS | _ARCS | {*INDEX, *VECTOR, *ANGLES, ALONG_TOOL, "ANG"}
"""The words that cause a motion with any motion code."""

ABSOLUTE, INCREMENTAL, SHORTEST_WAY = "ac", "ic", "dc"
TURNING = frozenset({SHORTEST_WAY, "acp", "acn"})
FORMS = TURNING | {ABSOLUTE, INCREMENTAL}
"""Forms of a word, `X=IC(10)`: absolute, incremental, or an angle by the shortest way or in a given sense."""
HALF_A_TURN = 180.0 - 1e-6
"""Angle, degree, from which rounding decides which way is the shorter one."""
FORM = re.compile(r"\s*(?P<form>[A-Z]+)\s*\(\s*(?P<value>.*?)\s*\)\s*\Z", re.IGNORECASE | re.DOTALL)

MOTIONS = {"cip": 1000, "ct": 1010, "poly": 1020, "aspline": 1030, "bspline": 1040, "cspline": 1050}
MOTIONS |= dict.fromkeys(("invcw", "invccw"), 1060) | dict.fromkeys(("oemipo1", "oemipo2"), 1070)
"""Names of the group of G0 to G3 -> internal motion code, for the column `modal`."""

CT_LEFT, CT_RIGHT = MOTIONS["ct"], MOTIONS["ct"] + 1
"""Internal motion codes of an arc by CT, counter-clockwise and clockwise."""

UNFOLLOWED_MOTIONS = {
    1020: "polynomials (POLY)",
    1030: "splines (ASPLINE)",
    1040: "splines (BSPLINE)",
    1050: "splines (CSPLINE)",
    1060: "involutes (INVCW, INVCCW)",
    1070: "motions of the machine builder (OEMIPO1, OEMIPO2)",
    330: "threading (G33)",
    331: "rigid tapping (G331)",
    332: "rigid tapping (G332)",
    340: "threading (G34)",
    350: "threading (G35)",
    3310: "rigid tapping (G331)",
    3320: "rigid tapping (G332)",
    3350: "threading (G335)",
    3360: "threading (G336)",
}

_HARMLESS = """
    msg stopre waitp waits waitm waitmc waite setal clralm setm clearm getd get release write read delete isfile mmc
    fnorm flin fcub fpo ffwon ffwof brisk soft drive briska softa drivea jerka sblof sblon displof displon
    stopfifo startfifo fifoctrl setint enable disable clrint liftfast alf lfon lfof walimon walimof
    walcs0 walcs1 walcs2 walcs3 setms spcon spcof cdon cdof cdof2 dynnorm dynpos dynrough dynsemifin dynfinish dynprec
    compof compcurv compcad compon compsurf upath spath stamac rmi rmb rme rmn cfc cftcp cfin fgroup fgref
    cut2d cut2df cut3dc cut3df cut3dff cut3dfs kontc kontt normal gwpson gwpsof tmon tmof fpr fpraon fpraof newconf
    cancel group_begin group_end group_addend punchacc sof soff pdelayon pdelayof spif1 spif2
    coupdef coupdel waitc ctabdel resetmon tang adisposa
    protd protz proa cutconon cutconof rtlion rtliof delt getselt delobj
    oric orid orirota orirotr orirott orirotc orison orisof oriaxpos
    drfof delayfston delayfstof fendnorm icycof icycon eauto enat etan bauto bnat btan prepro
    workpiece setpiece norm kont sons cprecon cprecof spath lftxt lfwp lfpos clearm init start isvar
    tangdel tlift cut3dcc cut3dccd cut2dd cut2dfd cut3dcd cut3dfd rmbbl rmibl rmebl rmnbl
    osof osc oss osse osd ost
    scc deltoolenv toolenv towstd towmcs towwcs towbcs towtcs towkcs walcs4 walcs5 walcs6 walcs7 walcs8 walcs9 walcs10
    iptrlock iptrunlock actblocno extopen extclose protdef cprot cprotdef nprot nprotdef prots collpair
    afison afisof auxfudel auxfudelg auxfumseq auxfusync axtochan blsync callpath chandata coupres ctablock
    ctabunlock deldl delmt deltc esrr esrs fctdef finea coarsea ipobrka lock unlock polfa polfmask polfmlin qeclrnon
    qeclrnof rdisable sirelin sirelout splinepath stopreof comppath dyn3d cycle62 waitenc ipoenda
"""
HARMLESS = frozenset(_HARMLESS.split())
"""Names that move no geometry axis and change no coordinates; ignored."""

UNFOLLOWED = {
    "transmit": "face transformation (TRANSMIT)",
    "tracyl": "cylinder transformation (TRACYL)",
    "traang": "oblique axis (TRAANG)",
    "tracon": "chained transformations (TRACON)",
    "trafoon": "a transformation (TRAFOON)",
    "torot": "a frame along the tool (TOROT)",
    "torotx": "a frame along the tool (TOROTX)",
    "toroty": "a frame along the tool (TOROTY)",
    "torotz": "a frame along the tool (TOROTZ)",
    "toframe": "a frame along the tool (TOFRAME)",
    "toframex": "a frame along the tool (TOFRAMEX)",
    "toframey": "a frame along the tool (TOFRAMEY)",
    "toframez": "a frame along the tool (TOFRAMEZ)",
    "tcoabs": "a tool carrier (TCOABS)",
    "tcofr": "a tool carrier (TCOFR)",
    "tcofrx": "a tool carrier (TCOFRX)",
    "tcofry": "a tool carrier (TCOFRY)",
    "tcofrz": "a tool carrier (TCOFRZ)",
    "parot": "a frame along the table (PAROT)",
    "settcor": "a tool offset that the program sets (SETTCOR)",
    "addframe": "a frame that the program adds (ADDFRAME)",
    "e_head": "a program of ShopMill (E_HEAD)",
    "f_head": "a program of ShopTurn (F_HEAD)",
    "corrtrafo": "a corrected transformation (CORRTRAFO)",
    "tca": "a tool that is called by TCA",
    "axctswe": "exchanged axes (AXCTSWE)",
    "axctswed": "exchanged axes (AXCTSWED)",
    "geoax": "exchanged geometry axes (GEOAX)",
    "preseton": "a preset position (PRESETON)",
    "presetons": "a preset position (PRESETONS)",
    "toffon": "an online tool offset (TOFFON)",
    "ftocon": "an online tool offset (FTOCON)",
    "trailon": "coupled axes (TRAILON)",
    "leadon": "coupled axes (LEADON)",
    "coupon": "an axis that follows another (COUPON)",
    "couponc": "an axis that follows another (COUPONC)",
    "egon": "an electronic gear (EGON)",
    "egonsyn": "an electronic gear (EGONSYN)",
    "egonsyne": "an electronic gear (EGONSYNE)",
    "tangon": "tangential control (TANGON)",
    "ctabdef": "a curve table, whose motions are not executed (CTABDEF)",
    "contpron": "a contour table, whose motions are not executed (CONTPRON)",
    "contdcon": "a contour table, whose motions are not executed (CONTDCON)",
    "execstring": "text that is executed as a block (EXECSTRING)",
    "corrtc": "a corrected tool carrier (CORRTC)",
    "ptp": "motion from point to point (PTP)",
    "ptpg0": "motion from point to point (PTPG0)",
    "ptpwoc": "motion from point to point (PTPWOC)",
    "extcall": "an external program (EXTCALL)",
    "call": "a program whose name is a text (CALL)",
    "isocall": "a program in another language (ISOCALL)",
    **dict.fromkeys(("diamona", "diamofa", "diam90a", "diamchan", "diamchana"), "diameters axis by axis (DIAMONA)"),
    **dict.fromkeys(("diamcycof", "diacycofa"), "radii of a cycle (DIAMCYCOF)"),
}
"""Names that change coordinates in a way that is not followed -> description; motions after them are refused."""

ENDED_BY = {
    "trafoof": frozenset({"traori", "transmit", "tracyl", "traang", "tracon", "trafoon"}),
    "torotof": frozenset({"torot", "torotx", "toroty", "torotz", "toframe", "toframex", "toframey", "toframez"}),
    "parotof": frozenset({"parot"}),
    "cp": frozenset({"ptp", "ptpg0", "ptpwoc"}),
    "execute": frozenset({"contpron", "contdcon"}),
    "ctabend": frozenset({"ctabdef"}),
    "toffof": frozenset({"toffon"}),
    "ftocof": frozenset({"ftocon"}),
    "trailof": frozenset({"trailon"}),
    "leadof": frozenset({"leadon"}),
    "coupof": frozenset({"coupon", "couponc"}),
    "coupofs": frozenset({"coupon", "couponc"}),
    "tangof": frozenset({"tangon"}),
    "egofs": frozenset({"egon", "egonsyn", "egonsyne"}),
}
"""Name -> names of `UNFOLLOWED` that it ends; others stay in force to the end of the program."""

ASYNCHRONOUS = {
    "posa": "a positioning axis that the program does not wait for (POSA)",
    "posp": "a positioning axis that goes in steps (POSP)",
    "ax": "an axis whose name is a variable (AX)",
    "os": "an axis that oscillates (OS)",
    "mov": "an axis that is started (MOV)",
    "oscill": "an axis that oscillates (OSCILL)",
}
"""Names that, with an axis as index, `OS[Z]=1`, move it by itself -> description."""

COUPLED = frozenset({"coupon", "couponc"})
"""Names of `UNFOLLOWED` that concern spindles, unless their first argument is an axis."""

COUPLING = re.compile(r"cpl?on$")
"""Names whose assignment switches a generic coupling on: `CPON=X`, `CPLON[X]=Y`."""

POLYNOMIAL = "po"
GO_SOMEWHERE = frozenset({"pos", "posa", "posp", "ax"})
BY_THEMSELVES = frozenset(ASYNCHRONOUS) | GO_SOMEWHERE | {POLYNOMIAL}
"""Names that, with an axis as index, move it by itself, `POS[X]=100`, or give its end, `PO[X]=(10,2)`."""
UNSEEN = {"fxs": "travel to a fixed stop (FXS)", "g": "a G code that is named by its group (G[..])"}
"""Names that, with an index, change later motions in a way that is not followed -> description."""

OF_THE_CONTROL = re.compile(
    r"\$(?:p_\w*fr|n[tk]_|tc_(?:dp|[se]cp|adpt|carr)|m[nca]_|aa_(?:off|etrans)|ac_trans|sn_cec_)|toff|tcarr$|cutmodk?$|mtl$"
    r"|\$sc_(?:mirror_tool|wear_|tool_length_(?:type|const_t$)|tool_temp|tocarr|toframe)"
)
"""Names, lower case, whose assignment changes frames, tool lengths, kinematic chains or machine data."""

TURNS_OF_THE_TOOL = frozenset({"orivect", "oriaxes", "oriplane", "oripath", "oripaths", "oricurve"})
TURNS_OF_THE_TOOL |= {"oriconcw", "oriconccw", "oriconio", "oriconto"}
"""The G code names for the interpolation of the tool orientation."""

STROKES = "strokes"
PUNCHING = {**dict.fromkeys(("pon", "pons", "son", "sons"), frozenset({STROKES})), "spof": frozenset[str]()}
"""Names that switch punching on or off -> the new state; with it every block ends with a stroke."""

PROBING = frozenset({"measa", "meawa", "meac"})
"""Names that, with an axis as index, make the motion of the block measure."""

DRILLING = frozenset({*(f"cycle{number}" for number in range(81, 90)), "cycle840"})
"""Cycles whose first arguments are RTP, RFP, SDIS, DP, DPR and that drill where the axes stand."""

MADE_BY_THE_CONTROL = re.compile(r"(?:cycle|holes|pocket|slot)\d+|longhole")
"""Cycles of the control, whose motions it generates, unless a subprogram of that name is at hand."""

MEASURING = re.compile(r"cycle(?:961|97[1346789]|982|99[4-8]|9960)")
"""Measuring cycles."""

CALIBRATING = frozenset({"cycle971", "cycle973", "cycle976", "cycle982"})
"""Measuring cycles for the probe or a tool, which set no frame."""

RESULTS = {"read": 4, "getselt": 0}
"""Names that only change variables -> index of the first argument that they change."""

DEEP, FIRST_DEPTH = "cycle83", (5, 6)
"""Deep-hole drilling, and the indices of its first depth: as a height (FDEP), or incremental (FDPR)."""

RTP, RFP, SDIS, DP, DPR = range(5)


# -- word values of a block --------------------------------------------------------------------------------------------


@mutable
class BlockWordValues:
    """The words of a block while it is executed.

    block    the block in its program
    values   address -> number, in program units; None if known only at run time
    forms    address -> form of the word (`ac`, `ic`, `dc`, ...), if it has one
    axes     bit mask of the axis words
    texts    address -> text, as in T="DRILL"
    refusal  why the motion of the block is refused; "" if it is not
    whole    the motion must not be split
    """

    block: int
    values: dict[str, float | None] = field(default_factory=dict)
    forms: dict[str, str] = field(default_factory=dict)
    axes: int = 0
    texts: dict[str, str] = field(default_factory=dict)
    refusal: str = ""
    whole: bool = False

    def refuse(self, reason: str, rotary: Sequence[int]) -> None:
        """Refuse the motion of the block, with an unknown end of these rotary axes."""
        self.refusal = reason
        for index in rotary:
            self.values[LETTERS[index]] = None
            self.forms[LETTERS[index]] = ABSOLUTE

    def get(self, address: str, default: float = 0.0) -> float:
        """The number of a word; the default if it is absent or unknown."""
        value = self.values.get(address)
        return default if value is None else value

    def unknown(self, *addresses: str) -> bool:
        """Whether one of these words is present but known only at run time."""
        return any(address in self.values and self.values[address] is None for address in addresses)


@frozen
class Drilling:
    """The call of a drilling or milling cycle.

    name    lower case
    clear   height of retraction (RTP), in program units; None if known only at run time
    depth   height of the bottom, in program units; None if unknown
    fault   why its holes are refused; "" if they are not
    values  values of its arguments
    sure    whether all written arguments are known
    external  the file in which it is called; "": the program itself
    depths  see `CycleCall`
    place   position of a milling cycle in program units; None: where the axes stand
    points  arguments of that position: (index, axis of the plane, 0 or 1)
    """

    name: str
    clear: float | None
    depth: float | None
    fault: str
    values: tuple[float | str | None, ...]
    sure: bool
    external: str
    depths: tuple[tuple[int, int], ...]
    place: tuple[float, float] | None = None
    points: tuple[tuple[int, int], ...] = ()


@mutable
class Modes:
    """Modal state of SINUMERIK, in addition to that of all controls.

    added        additive part (ATRANS, G59) of the shift of the programmable frame, mm and rad; None if unknown
    fine         whether G59 has set that part
    diameter     "", "DIAMON" or "DIAM90"
    said         whether program or setup has stated if X is a diameter
    pole         pole of polar coordinates in the program's frame, mm; None until one is set
    carried      TRAORI or TRAFOOF, if it came after the settable frame and before any motion
    in_plane     whether the plane is still the first one, so that an unset pole is the zero point
    polar        the last AP, rad, and RP, mm
    transformed  whether TRAORI is on
    swivelled    whether CYCLE800 has tilted the plane
    modal_cycle  the cycle that MCALL executes after each motion block
    orientation  interpolation of the tool orientation, ORIAXES, ORIVECT, ..., lower case
    orientation_in_machine  whether ORIMKS is in force
    rounds       whether RNDM rounds all corners
    angles       meaning of A2 B2 C2: ORIEULER, ORIRPY or ORIRPY2, lower case
    by_block     effects that depend on the division into blocks: punching, synchronized actions
    """

    added: Sequence[float] | None = ZEROS
    fine: bool = False
    diameter: str = ""
    said: bool = False
    pole: tuple[float, float] | None = None
    carried: str = ""
    in_plane: bool = True
    polar: tuple[float | None, float | None] = (None, None)
    transformed: bool = False
    swivelled: bool = False
    modal_cycle: Drilling | None = None
    orientation: str = ""
    orientation_in_machine: bool = False
    rounds: bool = False
    angles: str = ""
    by_block: frozenset[str] = frozenset()


@mutable
class NamedTools:
    """Internal numbers of tools that are called by name, beyond those of a magazine."""

    numbers: dict[str, int] = field(default_factory=dict)

    def number(self, name: str) -> int:
        """The internal number of a tool name."""
        return self.numbers.setdefault(name, 1_000_000 + len(self.numbers))

    def name(self, number: int) -> str:
        """The name of a tool by its number, or the number as text."""
        return next((name for name, known in self.numbers.items() if known == number), str(number))
