"""Klartext against LinuxCNC's interpreter, by way of a translator of its own: what path functions mean, and whether a
corrected program does on the machine with errors what the original was meant to do.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from differential import klartext, product
from differential.canon import ARC, Canon
from differential.errors import Machine
from differential.judge import Terms, judge
from ncfix.control.moves import MotionKind
from ncfix.control.setup import Setup, Tool
from ncfix.control.trace import trace
from ncfix.text.reader import read

FOLLOWED, CORRECTED = range(20), range(100, 105)
EXACT = 1e-6
KNOWN = Setup(work_offsets={"PRESET": {}}, tools={0: Tool(0.0)}, initial=dict.fromkeys("XYZ", 0.0))


def canon(text: str | bytes, rs274: Callable[..., Canon]) -> Canon:
    """What the control makes of a program by way of the translator."""
    source = text if isinstance(text, str) else text.decode("latin-1")
    found = rs274(klartext.Translator().program(source).encode())
    assert found.accepted, found.error
    return found


def test_path_functions_mean_what_the_interpreter_says(
    rs274: Callable[..., Canon], figures: Callable[[str], None]
) -> None:
    motions, worst = 0, 0.0
    for seed in FOLLOWED:
        text = klartext.contour(seed)
        judged = canon(text, rs274)
        moves = trace(read(text.encode(), "g.h"), KNOWN, ("X", "Y", "Z"), frozenset()).moves
        assert len(moves) == len(judged)
        assert moves.rule.tolist() == [0] * len(moves)
        arcs = moves.kind == MotionKind.ARC
        assert arcs.tolist() == (judged.kind == ARC).tolist()
        along = np.einsum("ij,ij->i", moves.normal[arcs], judged.normal[arcs]) * np.sign(moves.sweep[arcs])
        assert (np.sign(judged.turns[arcs]) == np.sign(along)).all()
        assert (np.ceil(np.abs(moves.sweep[arcs]) / (2 * np.pi) - 1e-9) == np.abs(judged.turns[arcs])).all()
        across = np.abs(moves.normal[arcs]) > 0.5
        gaps = [moves.end - judged.end[:, :3], np.where(across, 0.0, moves.centre[arcs] - judged.centre[arcs])]
        worst = max(worst, *(float(np.abs(gap).max(initial=0.0)) for gap in gaps))
        motions += len(moves)
    figures(f"klartext followed: {len(FOLLOWED)} programs, {motions} motions, worst {worst * 1e6:.3f} nm")
    assert worst < EXACT


def corrected(text: str, machine_file: Callable[[str], Path], folder: Path) -> bytes:
    """The corrected program."""
    outcome = product.fix_text(text, machine_file("three"), folder, "--assume-zero", name="g.h")
    assert outcome.code == product.DONE, outcome.errors
    assert outcome.text is not None
    return outcome.text


def test_corrected_programs_do_what_was_meant(
    rs274: Callable[..., Canon],
    machine: Callable[[str], Machine],
    machine_file: Callable[[str], Path],
    tmp_path: Path,
    figures: Callable[[str], None],
) -> None:
    worst: dict[str, float] = {}
    motions = 0
    for seed in CORRECTED:
        text = klartext.contour(seed, 10)
        fixed = corrected(text, machine_file, tmp_path)
        model = machine("three")
        terms = Terms(step=model.linear_step, rotary_step=model.rotary_step, calls=False)
        verdict = judge(canon(text, rs274), canon(fixed, rs274), model, terms)
        assert verdict.right, f"{seed}: {verdict}"
        motions += verdict.motions
        for what, (distance, _) in verdict.worst.items():
            worst[what] = max(worst.get(what, 0.0), distance)
    shown = ", ".join(f"{what} {distance * 1e3:.3f} um" for what, distance in worst.items())
    figures(f"klartext corrected: {len(CORRECTED)} programs, {motions} motions, worst {shown}")


BASE = """\
BEGIN PGM V MM
L X+10.5 Y+5 Z+20 FMAX
L Z-1.25 F300
L X+60 Y+12
CC X+70 Y+12
C X+70 Y+22 DR-
CC X+70 Y+2
C X+90 Y+2 DR-
L X+90 Y-140
L X-31.007 Y-139.125 Z-2
CC X-46.007 Y-139.125
C X-61.007 Y-139.125 DR-
L X-61.007 Y-100
L Z+30 FMAX
END PGM V MM
"""


def by_radius(text: str) -> str:
    text = re.sub(r"CC X\+70 Y\+12\nC (.*) DR-", r"CR \1 R+10 DR-", text)
    return re.sub(r"CC X\+70 Y\+2\nC (.*) DR-", r"CR \1 R+20 DR-", text)


VARIANTS: dict[str, Callable[[str], str]] = {
    "block numbers": lambda text: "".join(f"{n} {line}\n" for n, line in enumerate(text.splitlines())),
    "irregular block numbers": lambda text: "".join(
        f"{7 * n % 50:04d} {line}\n" for n, line in enumerate(text.splitlines())
    ),
    "decimal commas": lambda text: text.replace(".", ","),
    "carriage returns": lambda text: text.replace("\n", "\r\n"),
    "comments": lambda text: "".join(f"{line} ;X{n} THEN Y9\n" for n, line in enumerate(text.splitlines())),
    "without plus signs": lambda text: text.replace("+", ""),
    "increments": lambda text: text.replace("L X+60 Y+12", "L IX+49.5 IY+7").replace("L X+90 Y-140", "L Y-140"),
    "C as CR": by_radius,
    "C as CP": lambda text: text.replace("C X+70 Y+22 DR-", "CP IPA-90 DR-").replace("C X+90 Y+2 DR-", "CP PA+0 DR-"),
    "pole from the tool": lambda text: text.replace("CC X+70 Y+12", "CC IX+10 IY+0"),
    "lines in polar words": lambda text: text.replace("L X-61.007 Y-100", "CC X-61.007 Y-120\nLP PR+20 PA+90"),
    "rapids in words": lambda text: text.replace("FMAX", "F MAX"),
    "Q parameters": lambda text: text.replace("L X+60 Y+12", "Q1 = 50 + 10\nFN 0: Q2 = -12\nL X+Q1 Y-Q2"),
    "one subprogram": lambda text: text.replace(
        "L X+60 Y+12\n", 'CALL LBL "A"\nFN 9: IF +0 EQU +0 GOTO LBL 9\nLBL "A"\nL X+60 Y+12\nLBL 0\nLBL 9\n'
    ),
    "datum shift": lambda text: text.replace(
        "L X+90 Y-140", "CYCL DEF 7.0 D\nCYCL DEF 7.1 X+5\nL X+85 Y-140\nCYCL DEF 7.0 D\nCYCL DEF 7.1 X+0"
    ),
    "inches": lambda text: re.sub(
        r"([XYZF][+-]?)([\d.]+)", lambda found: f"{found[1]}{float(found[2]) / 25.4:.8f}", text
    ).replace("V MM", "V INCH"),
}
ROUNDED_ELSEWHERE = {
    "inches": 1.1e-3,
    "C as CR": 6e-4,
    "C as CP": 6e-4,
    "pole from the tool": 6e-4,
    "lines in polar words": 6e-4,
}
"""mm; variants whose numbers round at other places, or whose arcs are put into other words."""


@pytest.fixture(scope="module")
def base(machine_file: Callable[[str], Path], tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    """The corrected path of the program as it is."""
    return followed(corrected(BASE, machine_file, tmp_path_factory.mktemp("base")))


@pytest.mark.parametrize("name", VARIANTS)
def test_the_same_program_in_other_words_has_the_same_corrected_path(
    name: str, base: np.ndarray, machine_file: Callable[[str], Path], tmp_path: Path
) -> None:
    text = VARIANTS[name](BASE)
    assert text != BASE
    first, second = base, followed(corrected(text, machine_file, tmp_path))
    assert distance(first, second) < ROUNDED_ELSEWHERE.get(name, EXACT)
    assert distance(second, first) < ROUNDED_ELSEWHERE.get(name, EXACT)
    assert distance(first, followed(BASE.encode())) > 1e-3, "the machine has errors"


def followed(text: bytes) -> np.ndarray:
    """Where the motions of a program end."""
    moves = trace(read(text, "g.h"), KNOWN, ("X", "Y", "Z"), frozenset()).moves
    return moves.end


def distance(points: np.ndarray, others: np.ndarray) -> float:
    """How far the farthest of the points is from the nearest of the others, mm; pieces may be cut elsewhere."""
    if len(points) != len(others):
        return max(polyline(point, others) for point in points)
    return float(np.abs(points - others).max())


def polyline(point: np.ndarray, path: np.ndarray) -> float:
    """The distance of a point from a polygon."""
    start, way = path[:-1], np.diff(path, axis=0)
    size = np.maximum((way**2).sum(axis=1), 1e-30)
    along = np.clip(((point - start) * way).sum(axis=1) / size, 0.0, 1.0)
    return float(np.linalg.norm(start + along[:, None] * way - point, axis=1).min())
