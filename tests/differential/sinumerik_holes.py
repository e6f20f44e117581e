"""Random SINUMERIK programs that drill: in frames of all kinds, where axes are unsaid, by words for some axes."""

from __future__ import annotations

import itertools
import random

PLANES = ("none", "cycle800", "arot", "traori")
BEHIND = ("nothing", "g40", "supa", "tool")
CALLS = ("modal", "single")
NAMED = ("one", "both", "all")
COMBINATIONS = tuple(itertools.product(PLANES, BEHIND, CALLS, NAMED))
"""In which frame, behind what, how the cycle is called, and for which axes of the plane the blocks have words."""

CYCLES = (
    "CYCLE81({clear},0,2,{deep})",
    "CYCLE82({clear},0,2,,{way},0.3)",
    "CYCLE83({clear},0,2,{deep},,-3,,2,0,0,1,0)",
    "CYCLE84({clear},0,2,{deep},,,3,,1.25,,200,200)",
    "CYCLE85({clear},0,2,{deep},,0,100,300)",
    "CYCLE86({clear},0,2,{deep},,0,3,1,0,0,45)",
    "CYCLE87({clear},0,2,{deep},,3)",
    "CYCLE88({clear},0,2,{deep},,0,3)",
    "CYCLE89({clear},0,2,,{way},1)",
    "CYCLE840({clear},0,2,{deep},,0.5,4,3,1,8)",
    "CYCLE81({clear},R1,R2,R3)",
)
HEAD = ("G17 G40 G90 G94 G710", "T1 D1 M6", "G54", "G0 X0 Y0 Z60 A0 C0 F1000", "R1=0", "R2=2", "R3=-6")
AFTER = {
    "nothing": (),
    "g40": ("G41 G1 X=AC(5) Y=AC(5)", "G1 X=AC(25)", "G40 G1 X=AC(30) Y=AC(30)"),
    "supa": ("SUPA G0 Z=AC(250)",),
    "tool": ("T2 D1 M6",),
}


def word(chance: random.Random, axis: str, place: str) -> str:
    """An axis word in one of its forms; heights are above the part."""
    if axis == "Z":
        return f"Z{chance.choice((30, 45.5))}"
    return chance.choice(
        (f"{axis}{place}", f"{axis}{place}", f"{axis}={place}", f"{axis}=AC({place})", f"{axis}=IC({place[:3]})")
    )


def program(seed: int, plane: str, behind: str, call: str, named: str) -> str:
    """One program: into the frame, what comes before, holes, and on."""
    chance = random.Random(seed)

    def place(low: float = -35.0, high: float = 35.0) -> str:
        return f"{chance.uniform(low, high):.{chance.randint(0, 3)}f}"

    def tilt() -> str:
        return ",".join(place(-30, 30) for _ in range(3))

    into = {
        "none": (),
        "cycle800": (f'CYCLE800(1,"T",200000,57,{place(-9, 9)},{place(-9, 9)},{place(-9, 9)},{tilt()},0,0,0,-1)',),
        "arot": (f"{chance.choice(('ROT', 'AROT'))} X{place(-25, 25)} Z{place(-60, 60)}",),
        "traori": ("TRAORI", "G54", f"AROT X{place(-25, 25)} Y{place(-25, 25)}", f"G0 A{place(-40, 40)} C{place()}"),
    }[plane]
    before = ("G0 X0 Y0 Z60",) if chance.random() < 0.5 else ()
    first, last = (into, AFTER[behind]) if chance.random() < 0.5 or behind == "g40" else (AFTER[behind], into)
    lines = [*HEAD, *first, *before, *last]
    clear, deep = chance.choice((20, 40)), chance.choice((-4, -7.5, -12))
    cycle = chance.choice(CYCLES).format(clear=clear, deep=deep, way=-deep)
    lines += [f"MCALL {cycle}"] if call == "modal" else []
    for _ in range(chance.randint(2, 4)):
        axes = {"one": chance.choice(("X", "Y")), "both": "XY", "all": "XYZ"}[named]
        words = [word(chance, axis, place()) for axis in axes]
        lines.append(chance.choice(("", "G0 ", "G0 ", "G1 ", "N70 ")) + " ".join(words))
        lines += [cycle] if call == "single" else []
    return "\n".join([*lines, *(["MCALL"] if call == "modal" else []), "G0 X=AC(1) Y=AC(2) Z=AC(60)", "M30"]) + "\n"
