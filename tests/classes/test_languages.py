"""The built-in languages and strategies pass the contract that plugins must pass.

NCFIX_LANGUAGES says how many programs of each sort are tried, at random; 0 tries all, which takes hours.
"""

from __future__ import annotations

import os

import pytest

from classes.statements import KLARTEXT, SIEMENS, Family
from conftest import some
from ncfix.testing import Statements, check_language, check_strategy
from ncfix.testing.judging import SETUP
from ncfix.testing.language import Pair

COUNT = int(os.environ.get("NCFIX_LANGUAGES") or some(6))
SEED = int(os.environ.get("NCFIX_SEED", "1"))


def lines(text: str) -> tuple[str, ...]:
    return tuple(text.splitlines())


def modes(family: Family) -> tuple[tuple[str, ...], ...]:
    return tuple(lines(before)[3 if family is KLARTEXT else 4 :] for before in family.before)


HEIDENHAIN = Statements(
    begin=(*lines(KLARTEXT.before[0])[:3], "L X+10 Y+20 Z+3 R0 FMAX", "CC X+30 Y+20"),
    end=lines(KLARTEXT.after),
    heads=KLARTEXT.heads,
    words=KLARTEXT.words,
    modes=modes(KLARTEXT),
    leads=KLARTEXT.leads,
    motions=("L X+12 Y+13 F100", "L X+30 Y+31 Z+20 FMAX", "L Z+2 F100"),
    number="L X{} F100",
    numbers={"+5": 5.0, "+5.0": 5.0, "-0.5": -0.5, "+5.25": 5.25, "5,5": 5.5, "+0": 0.0, "+12.3456": 12.3456},
    frames=(
        Pair(("CYCL DEF 7.0 DATUM SHIFT", "CYCL DEF 7.1 X+3"), ("CYCL DEF 7.0 DATUM SHIFT", "CYCL DEF 7.1 X+0")),
        Pair(("CYCL DEF 10.0 ROTATION", "CYCL DEF 10.1 ROT+30"), ("CYCL DEF 10.0 ROTATION", "CYCL DEF 10.1 ROT+0")),
        Pair(("TRANS DATUM AXIS X+3 Y+4",), ("TRANS DATUM RESET",)),
    ),
    offsets=(Pair(("L X+8 Y+9 RL F100",), ("L X+60 Y+61 R0 F100",)),),
    cycles=(Pair(("CYCL DEF 200 D Q200=2 Q201=-15 Q203=+1 Q204=50", "L X+14 Y+15 FMAX M99")),),
    places=("L Z+100 FMAX M91",),
    setup=SETUP,
)
SINUMERIK = Statements(
    begin=lines(SIEMENS.before[0])[:4],
    end=lines(SIEMENS.after),
    heads=SIEMENS.heads,
    words=SIEMENS.words,
    modes=modes(SIEMENS),
    leads=SIEMENS.leads,
    motions=("G1 X12 Y13", "G0 X30 Y31 Z20", "G2 X40 Y41 CR=30", "G1 Z2"),
    number="G1 X{}",
    numbers={"5": 5.0, "5.0": 5.0, ".5": 0.5, "-0.5": -0.5, "=5.25": 5.25, "0": 0.0, "12.3456": 12.3456},
    frames=(Pair(("TRANS X3",), ("TRANS",)), Pair(("ROT Z30",), ("ROT",)), Pair(("MIRROR X0",), ("MIRROR",))),
    offsets=(Pair(("G1 G41 X8 Y9",), ("G1 G40 X60 Y61",)),),
    cycles=(Pair(("MCALL CYCLE81(10,0,2,-5)", "X14 Y15"), ("MCALL",)), Pair(("CYCLE81(10,0,2,-5)",))),
    places=("SUPA G0 Z100", "G74 Z1=0"),
    setup=SETUP,
)

SAMPLES: dict[str, Statements | None] = {
    **dict.fromkeys(("iso", "linuxcnc", "fanuc", "haas", "mitsubishi")),
    "heidenhain": HEIDENHAIN,
    "siemens": SINUMERIK,
}


@pytest.mark.parametrize("name", SAMPLES)
def test_the_languages_pass_the_contract(name: str) -> None:
    found = check_language(name, SAMPLES[name], COUNT, SEED)
    assert found["right"] > found.get("refused", 0)


@pytest.mark.parametrize("name", ["position", "rotary-then-linear", "full"])
def test_the_strategies_pass_the_contract(name: str) -> None:
    check_strategy(name)
