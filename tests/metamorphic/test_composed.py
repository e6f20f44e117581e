"""Features of a dialect composed at random: the path of a program in plain words is corrected alike.

`NCFIX_PAIRS=500` takes many compositions; a usual run a few of each dialect.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from metamorphic.composed_iso import IsoAuthor
from metamorphic.composed_klartext import KlartextAuthor
from metamorphic.composed_siemens import SiemensAuthor
from metamorphic.composing import COMPOSED, Author, Composition, compose, corrected, difference, shrunk
from metamorphic.harness import OPTIONS, PAIRS
from ncfix.machine import load

AUTHORS: dict[str, type[Author]] = {
    **dict.fromkeys(("iso", "linuxcnc", "fanuc", "haas", "mitsubishi"), IsoAuthor),
    "siemens": SiemensAuthor,
    "heidenhain": KlartextAuthor,
}
REFUSALS = (
    "executed from several states",
    "a refused arc after it",
    "axis words, which are never executed",
    "the duration is not known",
    "the arc needs a pole of its own",
    "beyond its range",
    "in which its errors are known",
)
"""Documented: calls from several states without --flatten, turns alone in programs of two units, poles, travel."""


@pytest.mark.parametrize("dialect", AUTHORS)
def test_a_composition_is_corrected_as_its_path(dialect: str, root: Path, figures: Callable[[str], None]) -> None:
    machines = [load(str(root / f"examples/machines/{name}.toml")) for name in ("wCAYFXZSt", "wCBXFZYSt")]
    for seed in range(PAIRS):
        made = compose(AUTHORS[dialect], dialect, machines, seed)
        if difference(made, REFUSALS):
            least = shrunk(made, lambda each: difference(each, REFUSALS))
            plain, wild = (least.written(wild=wild).text for wild in (False, True))
            pytest.fail(f"seed {seed}: {difference(least, REFUSALS)}\n{plain}\n{wild}\n{least.options}")
    figures(f"composed, {dialect}: {PAIRS} compositions, no difference")


FOUND = {
    "polar words to where the tool stands": """G710 G17 G40 G90 G94
T1 D1 M6
G54
G0 X10.123456 Y0 Z50 A0 C0
G111 X0 Y0
G1 AP=0 RP=10.123456 F500
G1 X0 Y0 Z0
M30
""",
    "a tool direction in a flat program": """%
O1
G21 G90 G94 G54
G0 X0 Y0 Z230. A20. C0
G43.5 H1
G1 X1. Y18. Z55. I0. J-0.5 K0.8 F500.
G49
G1 X0. Y0. Z230. A0. C0.
M98 P7001 L2
M30
O7001
G91 G1 X5. Y3. Z-1.
M99
%
""",
    "arc to a computed increment": """BEGIN PGM R MM
TOOL CALL 1 Z
L X-24.680000 Y-24.733 Z12.981 A+0.000000 C+0.000000 FMAX
CC X-21.630120 Y-27.432922
FN 1: Q10 = -3.954520 + +3
C IXQ10 IY-1.954185 DR- F500
M30
END PGM R MM
""",
    "CR in a subprogram, and no pole anywhere": """BEGIN PGM R MM
TOOL CALL 1 Z
CALL LBL 1
M30
LBL 1
L X-32.600000 Y+0.000000 Z+56.500000 A+0 C+0.000000 FMAX
CR X-39.190505 Y+16.423307 R+9.3780463 DR+ F500
LBL 0
END PGM R MM
""",
}


@pytest.mark.parametrize("name", FOUND)
def test_what_compositions_have_found(name: str, root: Path) -> None:
    machine = load(str(root / "examples/machines/wCAYFXZSt.toml"))
    dialect = {"B": "heidenhain", "G": "siemens", "%": "fanuc"}[FOUND[name][0]]
    made = Composition(AUTHORS[dialect], dialect, machine, COMPOSED, replace(OPTIONS, flatten=True), ())
    assert not corrected(FOUND[name], made).refused


LEAVING_THE_POLE = {
    "siemens": (
        "G710 G17 G40 G90 G94\nT1 D1 M6\nG54\nG0 A0 C0\nTRAORI\nG54\nORIAXES\n"
        "G0 X10 Y0 Z60 A3=0.1 B3=0 C3=0.9949874\nG1 X15 Y1 Z50 A3=0.12 B3=0.01 C3=0.99 F500\nM30\n"
    ),
    "fanuc": (
        "%\nO1\nG21 G90 G94 G54\nG0 X10. Y0. Z230. A0. C0.\nG43.5 H1\n"
        "G1 X10. Y0. Z60. I0.1 J0. K0.995 F500.\nX15. Y1. Z50. I0.12 J0.01 K0.99\nG49\nM30\n%\n"
    ),
    "heidenhain": (
        "BEGIN PGM R MM\nTOOL CALL 1 Z S1000\nL X+10 Y+0 Z+100 A+0 C+0 FMAX\nM128\n"
        "LN X+10 Y+0 Z+60 TX+0.1 TY+0 TZ+0.9949874 F500\nLN X+15 Y+1 Z+50 TX+0.12 TY+0.01 TZ+0.99\n"
        "M129\nM30\nEND PGM R MM\n"
    ),
}
"""From the pole two ways of the rotary axes lead to the first direction, and both are equally far."""


@pytest.mark.parametrize("dialect", LEAVING_THE_POLE)
def test_a_direction_with_two_ways_about_as_near_stays_as_programmed(dialect: str, root: Path) -> None:
    machine = load(str(root / "examples/machines/wCAYFXZSt.toml"))
    made = Composition(AUTHORS[dialect], dialect, machine, COMPOSED, replace(OPTIONS, strategy="full"), ())
    found = corrected(LEAVING_THE_POLE[dialect], made)
    assert not found.refused
    first = {
        "siemens": "A3=0.1 B3=0 C3=0.9949874",
        "fanuc": "I0.1 J0. K0.995",
        "heidenhain": "TX+0.1 TY+0 TZ+0.9949874",
    }
    assert first[dialect] in found.text
    assert found.text.count("0.12 ") == 0, "the next direction is corrected"
