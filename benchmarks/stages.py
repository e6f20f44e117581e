"""Where the time of `fix` goes on one program, from inside, in both forms of the core. Prints tables.

    python benchmarks/stages.py PROGRAM [--dialect NAME] [--profile]

A program is corrected in parts, or as a whole where it cannot go in parts, as `ncfix fix` does. `--profile` shows the
functions that take most, too.
"""

from __future__ import annotations

import argparse
import cProfile
import io
import pstats
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from time import process_time
from typing import Any

from ncfix import core
from ncfix.compensate import FixOptions, block_delete, driver, plain, solve
from ncfix.compensate.following import Task
from ncfix.control import trace
from ncfix.control.setup import Setup
from ncfix.machine import Machine, load
from ncfix.text import reader
from ncfix.text.dialect import Dialect, detect, get

SETUP = Setup(work_offsets={"G54": dict.fromkeys("XYZBC", 0.0)}, assume_zero=True)
MACHINE = Path(__file__).with_name("five_axis.toml")
OPTIONS = FixOptions(allow_refused=True)
WARM = 1 << 20
"""Bytes of the program that are corrected once before anything is timed: imports and compiled code are loaded."""
SHOWN = 16
"""Functions of the profile that are shown."""

STAGES: dict[str, tuple[tuple[Any, str], ...]] = {
    "read the text (twice)": ((trace.PartReader, "read"), (reader, "read"), (block_delete, "read")),
    "follow it (twice)": ((trace.Follower, "follow"), (driver, "traced")),
    "plan: correct ends, judge the path between them, split": ((plain.Planner, "plan"),),
    "plan, the long way": ((solve.Planning, "settled"),),
    "write: which words change, digits": ((driver, "written"),),
    "write, the long way": ((solve, "emit"),),
    "write: put the text together": ((driver, "spliced"),),
    "figures: tip errors before and after": ((driver, "figures"),),
    "figures, the long way": ((driver, "path_error"),),
}
"""The functions of each stage. What a stage calls of another counts for that one only."""
REST = "the rest: joins parts, compares, counts, reports"


def main() -> None:
    """Time each stage in both forms of the core."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("--dialect", help="of the program; else it is told by its beginning")
    parser.add_argument("--profile", action="store_true")
    given = parser.parse_args()
    source = given.program.read_bytes()
    dialect = get(given.dialect) if given.dialect else detect(source, str(given.program))
    machine, forms = load(MACHINE), {}
    for form in ("plain", "compiled"):
        core.use(form)
        corrected(source[: source.rfind(b"\n", 0, WARM) + 1], dialect, machine)
        forms[form] = timed(source, dialect, machine)
    print("\n".join(table(forms, source.count(b"\n"))))
    if given.profile:
        print("\n".join(["", "### Functions that take most, compiled", "", *profile(source, dialect, machine)]))


def corrected(source: bytes, dialect: Dialect, machine: Machine) -> None:
    """Correct a program, in parts if it can be."""
    task = Task(machine, SETUP, OPTIONS, None, "part.nc", dialect)
    try:
        driver.Stream(task, io.BytesIO(source).read, lambda data: None).run()
    except trace.NotInPartsError:
        driver.fix_program(reader.read(source, "part.nc", dialect), machine, SETUP, OPTIONS)


def timed(source: bytes, dialect: Dialect, machine: Machine) -> dict[str, float]:
    """CPU seconds of each stage, of the rest, and of all."""
    watch = StageWatch()
    originals = [(owner, name, getattr(owner, name)) for places in STAGES.values() for owner, name in places]
    for stage, places in STAGES.items():
        for owner, name in places:
            setattr(owner, name, watch.watched(getattr(owner, name), stage))
    try:
        begin = process_time()
        corrected(source, dialect, machine)
        whole = process_time() - begin
    finally:
        for owner, name, original in originals:
            setattr(owner, name, original)
    times = {stage: watch.times[stage] for stage in STAGES}
    return {**times, REST: whole - sum(times.values()), "all": whole}


class StageWatch:
    """Adds up the CPU time of stages; `inner` is what the stages inside of the running one have taken so far."""

    def __init__(self) -> None:
        self.times: dict[str, float] = defaultdict(float)
        self.inner = 0.0

    def watched(self, function: Callable[..., Any], stage: str) -> Callable[..., Any]:
        """A function whose own time counts for a stage."""

        def call(*given: Any, **named: Any) -> Any:
            outer, self.inner = self.inner, 0.0
            begin = process_time()
            try:
                return function(*given, **named)
            finally:
                took = process_time() - begin
                self.times[stage] += took - self.inner
                self.inner = outer + took

        return call


def table(forms: dict[str, dict[str, float]], blocks: int) -> list[str]:
    """Share and seconds per million blocks of each stage, and how much faster all would be if it took nothing."""
    rows = ["| stage | " + " | ".join(f"{form} | s per million blocks | without it" for form in forms) + " |"]
    rows.append("|---|" + "---|" * 3 * len(forms))
    names = [name for name in next(iter(forms.values())) if name != "all"]
    for name in [*names, "all"]:
        cells = []
        for times in forms.values():
            share = times[name] / times["all"]
            gain = f"{1 / (1 - share):.2f} times" if name != "all" else ""
            cells += [f"{100 * share:.0f} %", f"{1e6 * times[name] / blocks:.2f}", gain]
        rows.append(f"| {name} | " + " | ".join(cells) + " |")
    return rows


def profile(source: bytes, dialect: Dialect, machine: Machine) -> list[str]:
    """The functions in which most CPU time is spent themselves."""
    profiler = cProfile.Profile(process_time)
    profiler.runcall(corrected, source, dialect, machine)
    stats = pstats.Stats(profiler).stats  # type: ignore[attr-defined]
    whole = sum(each[2] for each in stats.values())
    rows = ["| function | share | calls |", "|---|---|---|"]
    for (file, _, function), (_, calls, own, _, _) in sorted(stats.items(), key=lambda each: -each[1][2])[:SHOWN]:
        place = Path(file)
        where = f"{place.parent.name}/{place.name}: " if place.suffix == ".py" else ""
        rows.append(f"| {where}{function.strip('<>')} | {100 * own / whole:.0f} % | {calls} |")
    return rows


if __name__ == "__main__":
    main()
