"""Statements of every language with subsets of their words, each in a short program, and what must come of them.

A statement that leads somewhere must never be passed over: it is a motion, or the block is named with a reason. Which
ones do is said here from the manuals, of the text alone; where a corrected program goes, other controls than the
product say (`differential.tnc`, `sinumerik`, `fanuc`).
"""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import kinematics_of
from ncfix.control.moves import MotionKind
from ncfix.control.trace import trace
from ncfix.diagnostics import NcfixError
from ncfix.testing.judging import SETUP, shifted_machine
from ncfix.testing.language import address, every_block
from ncfix.text.reader import read

MACHINE = shifted_machine()
THERE = 0.6
SURE = 0.95
"""How likely a word is there that a code takes, and one that it needs."""


@dataclass(frozen=True, slots=True)
class Family:
    """The statements of one language.

    heads   what a block begins with
    words   what may stand behind; of one address only one
    before  the programs before it, several modes; after: what follows
    leads   (head, words, mode) whether the manuals say that the block moves axes, or that the control stops at it
    takes   head -> the addresses or words that it takes, those that it needs in capitals; a control that stops at all
            others would hardly ever be asked for more without it
    stray   how many of these statements have one word that their code does not take
    """

    dialect: str
    heads: tuple[str, ...]
    words: tuple[str, ...]
    before: tuple[str, ...]
    after: str
    leads: Callable[[str, Sequence[str], int], bool]
    takes: Mapping[str, str] = field(default_factory=dict)
    stray: float = 0.5

    def cases(self) -> Iterator[Case]:
        """Every head with every subset of the words, behind every mode."""
        for mode, head, words in every_block(len(self.before), self.heads, self.words):
            yield Case(self, head, words, mode)

    def some(self, count: int, seed: int) -> list[Case]:
        """So many of them at random; all for none."""
        dice = random.Random(seed)
        if count and self.takes:
            return [self.taken(dice) for _ in range(count)]
        found = list(self.cases())
        return found if not count else dice.sample(found, min(count, len(found)))

    def taken(self, dice: random.Random) -> Case:
        """A head with some of the words that it takes, and now and then one that it does not."""
        head, mode = dice.choice(self.heads), dice.randrange(len(self.before))
        takes = (self.takes.get(head) or self.takes[f"mode {mode}"]).split()
        likely = {each.lower(): THERE if each.islower() else SURE for each in takes}
        by_address: dict[str, list[str]] = {}
        for word in self.words:
            by_address.setdefault(address(word), []).append(word)
        chosen, others = [], []
        for name, forms in by_address.items():
            taken = [word for word in forms if {name.lower(), word.lower()} & likely.keys()]
            others += [word for word in forms if word not in taken]
            if taken and dice.random() < max(likely.get(name.lower(), 0.0), likely.get(taken[0].lower(), 0.0)):
                chosen.append(dice.choice(taken))
        if dice.random() < self.stray:
            chosen.append(dice.choice(others))
        return Case(self, head, tuple(chosen), mode)


@dataclass(frozen=True, slots=True)
class Case:
    """One statement in its program."""

    family: Family
    head: str
    words: tuple[str, ...]
    mode: int

    @property
    def block(self) -> str:
        return " ".join((self.head, *self.words)).strip()

    @property
    def line(self) -> int:
        return self.family.before[self.mode].count("\n") + 1

    @property
    def text(self) -> str:
        return f"{self.family.before[self.mode]}{self.block}\n{self.family.after}"

    @property
    def leads(self) -> bool:
        return self.family.leads(self.head, self.words, self.mode)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a statement: "motion", "named", "stopped", "nothing", or a fault of the product."""

    what: str
    text: str = ""
    named: frozenset[int] = frozenset()


def outcome(case: Case) -> Outcome:
    """Correct the program and look at the statement."""
    source = case.text.encode()
    try:
        program = read(source, "part", case.family.dialect)
        moves = trace(program, SETUP, MACHINE.axis_names, frozenset(), kinematics=kinematics_of(MACHINE)).moves
        fixed = fix_program(program, MACHINE, SETUP, FixOptions(tolerance_um=50.0, figures=False))
    except NcfixError as error:
        places = [message.place for message in error.messages]
        return Outcome("stopped" if any(p is None or p.line >= case.line for p in places) else f"elsewhere: {error}")
    except Exception as error:
        return Outcome(f"NCF000 {type(error).__name__}: {error}")
    refused = frozenset(each.line for each in fixed.report.refused)
    rows = [row for row, block in enumerate(moves.block.tolist()) if block + 1 == case.line]
    passed = frozenset(
        int(moves.block[row]) + 1
        for row in range(len(moves))
        if moves.rule[row] == 1 and moves.kind[row] != MotionKind.DWELL
    )
    if case.line in refused:
        return Outcome("named", fixed.text.decode(), refused | passed)
    motions = [row for row in rows if moves.kind[row] != MotionKind.DWELL]
    return Outcome("motion" if motions else "nothing", fixed.text.decode(), refused | passed)


# -- Klartext ---------------------------------------------------------------------------------------------------------

PATHS = ("C", "CP", "CR", "CT", "CTP")
TURNS = ("APPR LT", "APPR LN", "APPR CT", "APPR LCT", "APPR PLT", "APPR PLCT", "DEP LT", "DEP LN", "DEP CT", "DEP LCT")
CALLS = ("CYCL CALL", "CYCL CALL POS")


def klartext_leads(head: str, words: Sequence[str], mode: int) -> bool:
    """Path functions but for L, LP and LN need no words; M99 calls a cycle where the tool stands."""
    if head in ("RND", "CHF", "CC"):
        return False
    ends = any(re.match(r"I?[XYZ]|I?P[AR]|TX", word) for word in words)
    return head in (*PATHS, *TURNS, *CALLS) or "M99" in words or ends


KLARTEXT = Family(
    dialect="heidenhain",
    heads=("", "L", "LP", "LN", *PATHS, *TURNS, *CALLS, "RND", "CHF", "CC"),
    words=(
        *("X+30", "X+10", "IX+5", "Y+40", "Y+20", "IY-4", "Z+5", "IZ-2", "PR+20", "IPR+3", "PA+30", "IPA-60"),
        *("R+25", "R-25", "R0", "LEN10", "CCA90", "DR-", "DR+", "FMAX", "F100", "M99", "M91", "M3"),
    ),
    before=tuple(
        "BEGIN PGM T MM\nTOOL CALL 0 Z S1000\nCYCL DEF 200 D Q200=2 Q201=-15 Q203=+1 Q204=50\n" + each
        for each in (
            "L X+10 Y+20 Z+3 R0 FMAX\nCC X+30 Y+20\n",
            "L X+8 Y+20 Z+3 R0 FMAX\nCC X+30 Y+20\nL X+10 F200\n",
        )
    ),
    after="L X+1 Y+2 Z+30 F100\nL X+3\nM30\nEND PGM T MM\n",
    leads=klartext_leads,
    takes={
        "L": "x y z f fmax r0 m99 m91 m3",
        "LP": "PR pa z f",
        "LN": "X Y z f",
        "C": "X+30 Y+40 dr- dr+ f",
        "CP": "PA dr- dr+ f z",
        "CR": "X Y r+25 r-25 DR- dr+ f",
        **dict.fromkeys(("CT", "APPR LCT", "DEP LCT", "CYCL CALL POS"), "X Y z f r+25 m3"),
        **dict.fromkeys(("CTP", "APPR PLT", "APPR PLCT"), "PR PA f LEN10 r+25"),
        **dict.fromkeys(("APPR LT", "APPR LN", "APPR CT"), "X Y LEN10 r+25 cca90 f"),
        **dict.fromkeys(("DEP LT", "DEP LN", "DEP CT"), "LEN10 cca90 r+25 f"),
        "RND": "R+25 f",
        "CC": "x y",
        "CYCL CALL": "m3 fmax",
        "mode 0": "x y z fmax m99 m3",
        "mode 1": "x y z f m3",
    },
)

# -- ISO, Fanuc, LinuxCNC ---------------------------------------------------------------------------------------------

TAKING = ("G4", "G92", "G52", "G10 L2 P1", "G10 L20 P1", "G43.1", "G64", "M3 S500")
"""What takes axis words of its block for itself, or no words but its own; other modes leave them to the motion."""
SETTLING = ("G17", "G90", "G40", "G43", "M3", "G61", "G54", "G94")
"""Modes, with which a block leads where its axis words say."""
CYCLES = ("G73", "G81", "G82", "G83", "G85", "G86", "G89")
LINUXCNC_TAKES = {
    **dict.fromkeys(("G0", "G1", "G91 G1", "G91 G0"), "x y z f"),
    **dict.fromkeys(("G2", "G3"), "x y z i j r f p"),
    **dict.fromkeys(("G18 G2", "G18 G3"), "x y z i k r f"),
    **dict.fromkeys(("G28", "G30"), "x y z"),
    **dict.fromkeys(("G53 G0", "G53 G1"), "X Y z f"),
    **dict.fromkeys(("G81", "G85", "G86"), "x y Z R l f"),
    **dict.fromkeys(("G82", "G89"), "x y Z R l P f"),
    **dict.fromkeys(("G73", "G83"), "x y Z R Q l f"),
    **dict.fromkeys(("G93 G1",), "x y z F"),
    "G33": "Z K",
    "G38.2": "x y Z f",
    "G31": "x y Z f",
    "G4": "P",
    "G92": "X y z",
    "G52": "x y z",
    "G10 L2 P1": "x y z",
    "G10 L20 P1": "x y z",
    "G43.1": "Z",
    "G41 D1": "X y",
    "G43": "h x y z f",
    "M3 S500": "f",
    "G64": "p",
    "mode 0": "x y z f",
    "mode 1": "x y z i j r f p",
    "mode 2": "x y z r l f",
    **dict.fromkeys(("G17", "G90", "G40", "M3", "G61", "G54", "G94"), ""),
}
"""Of each code the addresses that LinuxCNC takes with it; what is not here takes those of the mode."""


def iso_leads(head: str, words: Sequence[str], mode: int) -> bool:
    """Axis words lead somewhere unless a code takes them; arcs about a centre need none."""
    if head in ("G28", "G30"):
        return True
    if head in TAKING:
        return False
    arc = head.endswith(("G2", "G3")) or (mode == 1 and head in ("", *SETTLING))
    return any(word[0] in "XYZ" for word in words) or (arc and any(word[0] in "IJ" for word in words))


def iso(dialect: str) -> Family:
    """The statements of a dialect of RS274."""
    heads = ("", "G0", "G1", "G2", "G3", "G28", "G30", "G53 G0", "G53 G1", *CYCLES, "G33", "G91 G1", "G93 G1")
    strict = ("G18 G2", "G18 G3", "G38.2", "G43.1", "G64", "G61", "G94", "G54", "G10 L20 P1", "G41 D1", "M3 S500")
    fanuc = ("G31", "G52") if dialect == "fanuc" else ()
    taking = ("G4", "G92", "G10 L2 P1", "G17", "G90", "G40", "G43", "M3")
    return Family(
        dialect=dialect,
        heads=(*heads, *taking, *(strict if dialect != "fanuc" else fanuc)),
        words=(
            *("X30.", "X50.", "X10.", "Y40.", "Y20.", "Z5.", "I20.", "J0.", "J10.", "K1.", "R25."),
            *("P1", "Q3.", "L2", "F100.", "H1"),
        ),
        before=tuple(
            f"G21 G17 G90 G40 G49 G80 G94 G98\nT1 M6\nG54 G43 H1 G0 X0. Y10. Z40.\nF200. S100 M3\n{each}"
            for each in ("G1 X10. Y20.\n", "G2 X10. Y20. I5. J5.\n", "G81 X10. Y20. Z-5. R26.\n")
        ),
        after="G80\nG40 G90 G94 G17 G1 X1. Y2. Z30. F100.\nX3.\nM30\n",
        leads=iso_leads,
        takes=LINUXCNC_TAKES if dialect != "fanuc" else {},
        stray=0.1,
    )


# -- SINUMERIK --------------------------------------------------------------------------------------------------------

FRAMES = ("TRANS", "ATRANS", "ROT", "MIRROR", "G4", "G110", "G111", "G17", "G90")
SPLINES = ("ASPLINE", "BSPLINE", "CSPLINE", "POLY", "INVCW", "G33", "G331")


def siemens_leads(head: str, words: Sequence[str], mode: int) -> bool:
    """Axes, polar words and positioning axes lead somewhere; circles need no end point."""
    if head in FRAMES:
        return False
    if head.startswith(("CYCLE", "G74")):
        return head.startswith("CYCLE") or any(word[0] in "XYZ" for word in words)
    starts = {re.match(r"[A-Z]+(?:\d(?==))?", word)[0] for word in words}
    circle = (head in ("G2", "G3") or (mode == 1 and head == "")) and starts & {"I", "J", "AR", "CR", "TURN"}
    through = (head == "CIP" or (mode == 2 and head == "")) and starts & {"I1", "J1", "K1", "I", "J", "K", "AR", "CR"}
    return bool(starts & {"X", "Y", "Z", "AP", "RP", "POS", "PO", "ANG"} or circle or through)


SIEMENS = Family(
    dialect="siemens",
    heads=("", "G0", "G1", "G2", "G3", "CIP", "CT", *SPLINES, "SUPA G0", "G74", "CYCLE81(10,0,2,-5)", *FRAMES),
    words=(
        *("X30", "X10", "X=IC(5)", "Y40", "Y20", "Y=AC(7)", "Z5", "I20", "J0", "J10", "I=AC(30)", "K1", "CR=25"),
        *("AR=90", "TURN=1", "I1=20", "J1=30", "K1=3", "AP=30", "RP=20", "RND=1", "ANG=45", "F100"),
        *("POS[X]=30", "PO[X]=(30,2)"),
    ),
    before=tuple(
        f"G17 G90 G40 G71 G94 G54\nT1 D1 M6\nS100 M3\nG0 X0 Y10 Z3 F200\nG111 X30 Y20\n{each}"
        for each in ("G1 X10 Y20\n", "G1 X0\nG2 X10 Y20 I=AC(10) J=AC(10)\n", "CIP X10 Y20 I1=4 J1=17\n")
    ),
    after="G1 G90 X1 Y2 Z30 F100\nX3\nM30\n",
    leads=siemens_leads,
    takes={
        **dict.fromkeys(("G0", "G1", "mode 0"), "x y z f rnd ap rp"),
        **dict.fromkeys(("G2", "G3", "mode 1"), "x30 y40 i20 i=ac(30) j0 z cr f"),
        **dict.fromkeys(("CIP", "mode 2"), "X30 y40 i1 j1 k1=3 z f"),
        "CT": "X Y z f",
        "SUPA G0": "x y z",
        "G33": "Z K f",
        "G4": "f",
        **dict.fromkeys(("ASPLINE", "BSPLINE", "CSPLINE", "INVCW", "G331"), "X Y z f"),
        "POLY": "po[x] y f",
        **dict.fromkeys(("TRANS", "ATRANS", "G74"), "x y z"),
        "ROT": "x z",
        "MIRROR": "x y",
        "G110": "x y",
        "G111": "X Y",
        "CYCLE81(10,0,2,-5)": "f",
    },
)

FAMILIES = (KLARTEXT, SIEMENS, iso("fanuc"), iso("linuxcnc"), iso("iso"))
