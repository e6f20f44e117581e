"""Contours that a cycle of SINUMERIK mills: each of their points is corrected, at the bottom, or refused.

Judged as holes are, by an interpreter and a model of the machine that share nothing with the product. The figures of
contours that a control offsets are those of points within their elements, so they are not compared with those at ends.
A usual run takes each plane and form once, with one of the strategies. The second reader, which does not know the
cycle, finds no fault from its call on.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable
from pathlib import Path

from conftest import FULL
from differential import errors
from differential.sinumerik_holes import AFTER, HEAD
from differential.test_siemens import MACHINE, SETUP
from differential.test_siemens_holes import Tally, judged
from ncfix.certificate.proof import prove
from ncfix.cli.shop.certificates import given_of
from ncfix.machine import load
from ncfix.text.dialect import get

NEWER = ",0,1,2,101,1011,{}"
KINDS = tuple(itertools.product(("none", "cycle800", "arot", "traori"), ("older", "height", "way"), range(3)))


def program(plane: str, form: str, seed: int) -> str:
    """A contour of lines, arcs and corners, milled once or twice at the same depth."""
    chance = random.Random(f"{plane} {form} {seed}")

    def place(size: float) -> str:
        return f"{chance.uniform(-size, size):.{chance.randint(0, 3)}f}"

    tilt = ",".join(place(25) for _ in range(3))
    into = {
        "none": (),
        "cycle800": (f'CYCLE800(1,"T",200000,57,{place(9)},{place(9)},{place(9)},{tilt},0,0,0,-1)',),
        "arot": (f"{chance.choice(('ROT', 'AROT'))} X{place(20)} Z{place(60)}",),
        "traori": ("TRAORI", "G54", f"AROT X{place(20)} Y{place(20)}", f"G0 A{place(40)} C{place(35)}"),
    }[plane]
    reference, deep = chance.choice((0, 1.5)), chance.choice((3, 7.5))
    depth = deep if form == "way" else reference - deep
    rest = "" if form == "older" else NEWER.format(1 if form == "way" else 0)
    call = f'CYCLE72("K{{}}:E{{}}",40,{reference},1,{depth:g},3,0,0,500,200,{{}},41,1,5,200,1,5{rest})'
    calls = [call.format(1, 1, 11), call.format(1, 1, 12)] if chance.random() < 0.5 else [call.format(1, 1, 111)]
    wide, high, x, y = chance.choice((20, 31.5)), chance.choice((18, 25)), place(15), place(15)
    left, low = float(x), float(y)
    contour = [
        f"{chance.choice(('G0', 'G1 G90', 'G90 G17 G1'))} X{x} Y{y}",
        f"G1 X{left + wide:.3f}{chance.choice(('', f' Y{y}', ' RND=2'))}",
        f"Y={low + high:.3f}{chance.choice(('', ' CHF=1'))}",
        f"G1 X{left + wide / 2:.4f}",
        f"G2 X{left + wide / 2 - 8:.4f} Y=IC(8) CR=8",
        f"G3 X{left + wide / 2 - 12:.4f} Y{low + high + 12:.3f} I-4 J0",
        f"G1 X{x}",
        f"Y{y}",
    ]
    if chance.random() < 0.3:
        contour = [contour[0], f"G2 X{x} Y{y} I12.5 J{place(3)}"]
    lines = [*HEAD, *into, *AFTER[chance.choice(("nothing", "tool"))]]
    lines += ["G0 X0 Y0 Z60"] if chance.random() < 0.5 else []
    return "\n".join([*lines, *calls, "G0 X=AC(1) Y=AC(2) Z=AC(60)", "M30", "K1:", *contour, "E1:"]) + "\n"


def test_every_point_is_corrected_or_refused(root: Path, figures: Callable[[str], None]) -> None:
    model, machine = errors.load(root / MACHINE), load(str(root / MACHINE))
    for shift, strategy in enumerate(("rotary-then-linear", "full")):
        tally = Tally()
        for number, kind in enumerate(KINDS):
            if FULL or ((number + number // 3) % 3 == shift and number // 3 % 2 == shift):
                text, tally.wrong = program(*kind), []
                fixed = judged(text, strategy, model, machine, tally)
                proof = prove(text.encode(), fixed.text, machine, given_of(SETUP, get("siemens")), "siemens")
                called = text[: text.index("CYCLE72")].count("\n") + 1
                assert not [fault for fault in proof.faults if fault.original >= called], (proof.faults, text)
                assert not [fault for fault in tally.wrong if not fault.startswith("figures")], (tally.wrong, text)
        assert sum(tally.holes.values()) > 10 * tally.holes["refused"], tally.reasons
        figures(
            f"siemens contours, {strategy}: {dict(tally.holes)}, silently wrong 0; "
            f"worst {tally.worst * 1e3:.3f} um, before {tally.before * 1e3:.1f} um"
        )
