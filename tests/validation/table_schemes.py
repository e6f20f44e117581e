"""The table schemes of S. Esmaeili Marzdashti's thesis (Polytechnique Montreal, 2021) on its own machines, in numbers.

`python tests/validation/table_schemes.py` works them out and puts them into docs/siemens.md; the tests hold them.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests")]

from ncfix.machine import Machine, State, load  # noqa: E402
from ncfix.tables.compensation import Compensation  # noqa: E402
from ncfix.tables.control import Request, get_control  # noqa: E402
from ncfix.tables.correction import ranges_of, residual  # noqa: E402
from ncfix.tables.export import export  # noqa: E402
from ncfix.tables.scheme import Limits, SchemeTask, automatic  # noqa: E402
from ncfix.tables.scheme_fixed import fixed  # noqa: E402
from validation import esmaeili as work  # noqa: E402

PAGE = ROOT / "docs" / "siemens.md"
PLENTY = Limits(tables=62, points=1000)
SCHEMES = ("auto", "poly25", "trigo23")
POSES = 2000

STROKES = {"X": (-130, 130), "Y": (-210, 210), "Z": (-120, 120), "A": (-55, 55), "C": (0, 330)}
"""Where the ten cases are simulated: the strokes, and the turns of the calibration; Z is the height of the tip."""
SIZES = {"EY0C": 0.010, "EYY": 0.04e-3, "EZZ": 0.04e-3}
ANGLE = 0.4e-3
TABLE_6_6 = {  # effectiveness in per cent: kinematics-based, 25Poly-T, 23Trigo-T
    "EB0A": (89, 26, 89), "EC0A": (98, 76, 98), "EY0C": (99, 98, 98), "EA0C": (98, 98, 98), "EB0C": (90, 3, 88),
    "EC0X": (93, 38, 89), "EA0Z": (98, 90, 94), "EB0Z": (87, 27, 87), "EYY": (94, 94, 94), "EZZ": (93, 81, 91),
}  # fmt: skip
TABLE_6_7 = {"before": (62.1, 102.8), "auto": (3.2, 5.3), "poly25": (23.3, 38.2), "trigo23": (4.1, 7.2)}

ROOM = {"X": (-150, 150), "Y": (-150, 150), "Z": (200, 500), "A": (-90, 90), "C": (-180, 180)}
"""Where the thirteen errors are simulated. Strokes are not printed; here the mean is the 44 um of Table 7-2."""


def within(machine: Machine, ranges: dict[str, tuple[float, float]]) -> Machine:
    """The machine with other travels, mm and degree."""
    limits = [tuple(limit * axis.unit for limit in ranges[axis.name]) for axis in machine.axes]
    axes = tuple(replace(axis, range=ends) for axis, ends in zip(machine.axes, limits, strict=True))
    return machine.replace(axes=axes)


def tables_for(job: SchemeTask, scheme: str) -> Compensation:
    """The tables of a scheme."""
    return (automatic(job) if scheme == "auto" else fixed(job, scheme)).tables


@dataclass(frozen=True, slots=True)
class Case:
    """One error alone: mean tip error in um, before and with the tables of each scheme."""

    name: str
    before: float
    after: dict[str, float]

    def effectiveness(self, scheme: str) -> float:
        """Per cent of the mean tip error that is taken off."""
        return 100 * (1 - self.after[scheme] / self.before)


def ten_cases() -> list[Case]:
    """Table 6-2: one error at a time, over the whole working space."""
    found = []
    for name in TABLE_6_6:
        machine = within(work.kolibri({name: SIZES.get(name, ANGLE)}), STROKES)
        space = ranges_of(machine)
        job = SchemeTask(machine, space, 0.0, 1e-4, PLENTY)
        lefts = {scheme: residual(machine, tables_for(job, scheme), space, 0.0, POSES) for scheme in SCHEMES}
        after = {scheme: 1e3 * float(left.after.mean()) for scheme, left in lefts.items()}
        found.append(Case(name, 1e3 * float(lefts["auto"].before.mean()), after))
    return found


def all_ten() -> dict[str, tuple[float, float]]:
    """Tables made from the calibrated errors (6-4), run on the machine as it was found later (6-5): mean and max, um.

    As in Table 6-7 it is the error that the ten-error model explains, with the place of the ball estimated as well.
    The tables are fitted where the ball was probed.
    """
    real, q = work.kolibri(work.TABLE_6_5), work.validation()
    job = SchemeTask(work.kolibri(work.TABLE_6_4), np.array(work.room_of(q)), work.KOLIBRI_LENGTH, 1e-3, PLENTY)
    corrections = {scheme: tables_for(job, scheme).at(real.axis_names, q) for scheme in SCHEMES}
    return {name: _explained(real, q, value) for name, value in {"before": np.zeros_like(q), **corrections}.items()}


def _explained(real: Machine, q: np.ndarray, correction: np.ndarray) -> tuple[float, float]:
    state = State(work.KOLIBRI_LENGTH)
    error = real.actual_tip(q + correction, state) - real.tip(q, work.KOLIBRI_LENGTH)
    design = real.design(q, state)[:, :3]
    ball = np.broadcast_to(np.eye(3), (len(q), 3, 3))
    whole = np.concatenate([design, ball], axis=2).reshape(3 * len(q), -1)
    shares = np.linalg.lstsq(whole, error.reshape(-1), rcond=None)[0]
    sizes = 1e3 * np.linalg.norm(design @ shares[: design.shape[2]], axis=1)
    return float(sizes.mean()), float(sizes.max())


@dataclass(frozen=True, slots=True)
class Run:
    """How many tables and points; mean tip error before, mean and largest after, um."""

    scheme: str
    tables: int
    points: int
    before: float
    after: float
    largest: float


def thirteen(scheme: str, target: float = 1e-4, limits: Limits = PLENTY) -> Run:
    """The thirteen errors of Table 7-2 together."""
    machine = within(work.huron({name: value for name, (value, _) in work.TABLE_7_2.items()}), ROOM)
    space = ranges_of(machine)
    tables = tables_for(SchemeTask(machine, space, work.HURON_LENGTH, target, limits), scheme)
    left = residual(machine, tables, space, work.HURON_LENGTH)
    sizes = (1e3 * float(value) for value in (left.before.mean(), left.after.mean(), left.after.max()))
    return Run(scheme, len(tables.grids), tables.points, *sizes)


def page() -> str:
    """The tables of docs/siemens.md."""
    lines = ["One error at a time, mean tip error over the strokes, um, and what is taken off, per cent:", ""]
    lines += ["| error | before | auto | 25Poly-T | 23Trigo-T | taken off | printed, Table 6-6 |", "|" + "---|" * 7]
    for case in ten_cases():
        after = " | ".join(f"{case.after[scheme]:.2f}" for scheme in SCHEMES)
        ours = " / ".join(f"{case.effectiveness(scheme):.0f}" for scheme in SCHEMES)
        printed = " / ".join(map(str, TABLE_6_6[case.name]))
        lines.append(f"| {case.name} | {case.before:.1f} | {after} | {ours} | {printed} |")
    lines += [
        "",
        "All ten, tables for the errors as calibrated (6-4), machine as found later (6-5), mean / max, um:",
        "",
    ]
    lines += ["| | ncfix | printed, Table 6-7 |", "|---|---|---|"]
    for name, (mean, largest) in all_ten().items():
        printed = "{:.1f} / {:.1f}".format(*TABLE_6_7[name])
        lines.append(f"| {name} | {mean:.1f} / {largest:.1f} | {printed} |")
    lines += ["", "The thirteen errors of Table 7-2 on the machine with a tilted A, mean tip error, um:", ""]
    lines += ["| scheme | target, um | tables | points | before | after | after, max |", "|" + "---|" * 7]
    runs = [(scheme, 1e-4, PLENTY) for scheme in ("auto", "fik20", "fik40", "trigo23", "poly25")]
    runs += [("auto", 1e-3, PLENTY), ("auto", 1e-3, Limits(8, 200))]
    for scheme, target, limits in runs:
        run = thirteen(scheme, target, limits)
        name = f"{scheme}, 828D" if limits.tables == 8 else scheme
        sizes = f"{run.tables} | {run.points} | {run.before:.1f} | {run.after:.3f} | {run.largest:.3f}"
        lines.append(f"| {name} | {1e3 * target:g} | {sizes} |")
    lines.append("| printed | | 40 | | 44 | 9.1 | |")
    return "\n".join(lines)


SHIPPED = ("three_axis", "wCAYFXZSt", "wCBXFZYSt", "dmu50", "angle_head")
SETTINGS = ({}, {"positioning": "eec"}, {"model": "828D"}, {"model": "828D", "positioning": "eec"})


HEAD = "| machine | settings | tables | points | before, max / rms | after, max / rms | least, max | most is left at |"


def shipped_row(name: str, more: dict[str, str]) -> str:
    """What the files for a shipped machine leave, read back and run, and what no pairs can leave less than."""
    control = get_control("siemens")
    machine = load(str(ROOT / "examples" / "machines" / f"{name}.toml"))
    settings = control.settings({"value_sign": "error", "product_terms": "only", **more})
    made = export(control, Request(machine, ranges_of(machine), 120.0, 1e-3, settings))
    sizes = made.left.figures()
    before, after = ("{max:.1f} / {rms:.1f}".format(**sizes[when]) for when in ("before", "after"))
    at = " ".join(f"{axis}{value:.0f}" for axis, value in sizes["after"]["at"].items())
    limits, said = made.limits(), " ".join(f"{key}={value}" for key, value in more.items()) or "840D"
    assert made.least is not None
    least = f"{1e3 * made.least.value:.1f}"
    return f"| {name} | {said} | {limits['tables']} | {limits['points']} | {before} | {after} | {least} | {at} |"


def shipped() -> str:
    """All of them."""
    rows = []
    for name in SHIPPED:
        for more in SETTINGS:
            rows.append(shipped_row(name, more))
            print(rows[-1], file=sys.stderr, flush=True)
    return "\n".join([HEAD, "|" + "---|" * 8, *rows])


BLOCKS = {"shipped": shipped, "schemes": page}


def main() -> None:
    """Put the figures into the page: all, or the blocks that are named."""
    for name in sys.argv[1:] or BLOCKS:
        start, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
        block = f"{start}\n{BLOCKS[name]()}\n{end}"
        print(block, flush=True)
        PAGE.write_text(re.sub(f"{start}.*{end}", lambda _, block=block: block, PAGE.read_text(), flags=re.DOTALL))


if __name__ == "__main__":
    main()
