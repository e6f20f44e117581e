"""Milling cycles of SINUMERIK: their arguments by name, what they mean, and random programs that call them.

Source: Siemens, "SINUMERIK 840D sl/828D, Job planning", "Programming cycles externally"; calls of older controls are
the same without the last arguments. A cycle works at the place and depth that it names; nothing else of it is judged.
"""

from __future__ import annotations

import itertools
import math
import random
from typing import NamedTuple

from differential.sinumerik_holes import AFTER, HEAD

_NEW = "UMODE FS ZFS GMODE DMODE AMODE"
_NUMBERED = "FFD FFP1 MID CDIR FAL VARI MIDF FFP2 SSF"
_NAMES = {
    "POCKET1": f"LENG WID CRAD PA PO STA {_NUMBERED}",
    "POCKET2": f"PRAD PA PO {_NUMBERED}",
    "POCKET3": f"LENG WID CRAD PA PO STA MID FAL FALD FFP1 FFD CDIR VARI MIDA AP1 AP2 AD RAD1 DP1 {_NEW}",
    "POCKET4": f"PRAD PA PO MID FAL FALD FFP1 FFD CDIR VARI MIDA AP1 AD RAD1 DP1 {_NEW}",
    "SLOT1": f"NUM LENG WID PA PO RAD STA INDA {_NUMBERED} FALD STA2 DP1 {_NEW}",
    "SLOT2": f"NUM AFSL WID PA PO RAD STA INDA {_NUMBERED} FFCP {_NEW}",
    "LONGHOLE": "NUM LENG PA PO RAD STA INDA FFD FFP1 MID VARI UMODE GMODE DMODE AMODE",
    "CYCLE61": "PA PO LENG WID MID MIDA FALD FFP1 VARI LIM DMODE AMODE",
    "CYCLE71": "PA PO LENG WID STA MID MIDA FDP FALD FFP1 VARI FDP1",
    "CYCLE76": f"LENG WID CRAD PA PO STA MID FAL FALD FFP1 FFD CDIR VARI AP1 AP2 {_NEW[6:]}",
    "CYCLE77": f"PRAD PA PO MID FAL FALD FFP1 FFD CDIR VARI AP1 {_NEW[6:]}",
    "CYCLE90": "DIATH KDIAM PIT FFR CDIR TYPTH PA PO",
}
BOTH = ("POCKET1", "POCKET2", "SLOT1", "SLOT2", "LONGHOLE", "CYCLE76", "CYCLE77", "CYCLE90")
"""Cycles that have DPR behind DP."""
NAMES = {
    name: ("RTP", "RFP", "SDIS", "DP", *(("DPR",) if name in BOTH else ()), *names.split())
    for name, names in _NAMES.items()
}
OLDER = {name: names.index("UMODE") for name, names in NAMES.items() if "UMODE" in names}
OLDER |= {"CYCLE76": 20, "CYCLE77": 16, "LONGHOLE": 15}
"""How many arguments the calls of older controls have."""


class Milling(NamedTuple):
    """A call: the height at which it ends, that of its bottom, and the place in the plane, in program units."""

    clear: float
    bottom: float
    place: tuple[float, float]


def milling(name: str, values: list[float | None]) -> Milling:
    """What a call means."""
    given = {key: value or 0.0 for key, value in zip(NAMES[name], values, strict=False)}
    mode = int(given.get("AMODE", 0.0))
    bottom = given["DP"]
    if given.get("DPR"):
        bottom = given["RFP"] - given["DPR"]
    elif mode % 10 == 1:
        bottom = given["RFP"] - given["DP"]
    x, y = given.get("PA", 0.0), given.get("PO", 0.0)
    if name in ("CYCLE61", "CYCLE71"):
        across, along = given["LENG"], given["WID"]
        if name == "CYCLE61":
            across -= x if mode // 100 % 10 else 0.0
            along -= y if mode // 1000 % 10 else 0.0
        turn = math.radians(given.get("STA", 0.0))
        x += (across * math.cos(turn) - along * math.sin(turn)) / 2
        y += (across * math.sin(turn) + along * math.cos(turn)) / 2
    return Milling(given["RTP"], bottom, (x, y))


def call(name: str, chance: random.Random, *, modal: bool = False) -> str:
    """A call with arguments by chance; a modal one names no place."""
    names = NAMES[name]
    older = name in OLDER and chance.random() < 0.4
    names = names[: OLDER[name]] if older else names
    way = "AMODE" in names and chance.random() < 0.5
    deep, reference = chance.choice((4, 7.5, 12)), chance.choice((0, 0, 1.5, 10))
    said: dict[str, str] = {each: f"{chance.choice((0, 1, 2, 5, 0.5))}" for each in names[4:]}
    said |= {"RTP": f"{chance.choice((30, 45.5))}", "RFP": f"{reference}", "SDIS": f"{chance.choice((1, 2.5))}"}
    said |= {"DP": f"{reference - deep:g}", "NUM": "4", "VARI": f"{chance.choice((1, 2, 11, 21))}"}
    said |= {"LENG": f"{chance.choice((15, 22.5))}", "WID": f"{chance.choice((8, 12))}"}
    said |= {"DMODE": f"{chance.choice((0, 1, 11, 111))}", "STA": f"{chance.choice((0, 30))}"}
    digits = chance.choice((0, 10, 100, 110)) if name != "CYCLE61" else chance.choice((0, 10, 110, 1110))
    said["AMODE"] = f"{digits + (1 if way else 2 if 'DPR' in names and chance.random() < 0.5 else 0)}"
    if "DPR" in names:
        way = way or (said["AMODE"][-1] == "0" and chance.random() < 0.5)
        said |= {"DP": "", "DPR": f"{deep}"} if way else {"DPR": ""}
    elif way:
        said["DP"] = f"{deep}"
    for axis in ("PA", "PO"):
        said[axis] = "" if modal else f"{chance.uniform(-35, 35):.{chance.randint(0, 3)}f}"
    return f"{name}({','.join(said[each] for each in names)})"


WAYS = ("single", "modal")
KINDS = tuple(itertools.product(NAMES, ("none", "cycle800", "arot", "traori"), WAYS))


def program(seed: int, name: str, plane: str, way: str) -> str:
    """One program: into the frame, some calls, and on."""
    chance = random.Random(f"{seed} {name} {plane} {way}")

    def place(size: float) -> str:
        return f"{chance.uniform(-size, size):.{chance.randint(0, 3)}f}"

    tilt = ",".join(place(30) for _ in range(3))
    into = {
        "none": (),
        "cycle800": (f'CYCLE800(1,"T",200000,57,{place(9)},{place(9)},{place(9)},{tilt},0,0,0,-1)',),
        "arot": (f"{chance.choice(('ROT', 'AROT'))} X{place(25)} Z{place(60)}",),
        "traori": ("TRAORI", "G54", f"AROT X{place(25)} Y{place(25)}", f"G0 A{place(40)} C{place(35)}"),
    }[plane]
    lines = [*HEAD, *into, *AFTER[chance.choice(("nothing", "tool"))]]
    lines += ["G0 X0 Y0 Z60"] if chance.random() < 0.5 else []
    for _ in range(2):
        if way == "single":
            lines += [call(name, chance), f"G0 X{place(30)} Y{place(30)}", "G1 Z45", "G1 X0 Y=IC(2)"]
        else:
            lines += [
                f"MCALL {call(name, chance, modal=True)}",
                *(f"X{place(30)} Y{place(30)}" for _ in range(2)),
                "MCALL",
            ]
    return "\n".join([*lines, "G0 X=AC(1) Y=AC(2) Z=AC(60)", "M30"]) + "\n"
