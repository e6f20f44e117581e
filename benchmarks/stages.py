"""Where the time of `fix` goes on one long program, from inside. Prints tables.

Called with the program's name; with `--profile` behind it the functions that take most are shown, too.
"""

from __future__ import annotations

import cProfile
import io
import pstats
import sys
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from time import process_time
from typing import Any

from ncfix import core
from ncfix.compensate import FixOptions, driver, plain, solve
from ncfix.compensate.following import Task
from ncfix.control import trace
from ncfix.control.setup import Setup
from ncfix.control.trace import Follower
from ncfix.machine import load
from ncfix.text.dialects import get

SETUP = Setup(work_offsets={"G54": dict.fromkeys("XYZBC", 0.0)}, assume_zero=True)
MACHINE = Path(__file__).with_name("five_axis.toml")
WARM = 1 << 20
"""Bytes of the program that are corrected once before anything is timed: imports and compiled code are loaded."""
SHOWN = 16
"""Functions of the profile that are shown."""

STAGES: tuple[tuple[str, Any, str], ...] = (
    ("read the text (twice)", trace.PartReader, "read"),
    ("follow it (twice)", Follower, "follow"),
    ("plan: correct ends, judge the path between them, split", plain.Planner, "plan"),
    ("plan, the long way", driver, "agree"),
    ("write: which words change, digits", driver, "written"),
    ("write, the long way", solve, "emit"),
    ("write: put the text together", driver, "spliced"),
    ("figures: tip errors before and after", driver, "figures"),
    ("figures, the long way", driver, "path_error"),
)


def main() -> None:
    """Time each stage in both ways; with `--profile` show the functions that take most."""
    source = Path(sys.argv[1]).read_bytes()
    blocks = source.count(b"\n")
    ways = {}
    for name in ("plain", "compiled"):
        core.use(name)
        corrected(source[:WARM])
        ways[name] = timed(source)
    print("\n".join(table(ways, blocks)))
    if "--profile" in sys.argv:
        print("\n".join(["", "### Functions that take most, compiled", "", *profile(source)]))


def corrected(source: bytes) -> None:
    """Correct a program, part by part."""
    task = Task(load(MACHINE), SETUP, FixOptions(), None, "part.nc", get("linuxcnc"))
    driver.Stream(task, io.BytesIO(source).read, lambda data: None).run()


def timed(source: bytes) -> dict[str, float]:
    """CPU seconds of each stage."""
    times: dict[str, float] = defaultdict(float)
    originals = [(owner, attribute, getattr(owner, attribute)) for _, owner, attribute in STAGES]
    for name, owner, attribute in STAGES:
        setattr(owner, attribute, watched(getattr(owner, attribute), name, times))
    try:
        begin = process_time()
        corrected(source)
        times["all"] = process_time() - begin
    finally:
        for owner, attribute, original in originals:
            setattr(owner, attribute, original)
    times["the rest: joins parts, compares, counts, reports"] = times["all"] - sum(times[name] for name, _, _ in STAGES)
    return times


def watched(function: Callable[..., Any], name: str, times: dict[str, float]) -> Callable[..., Any]:
    """A function whose CPU time is added up."""

    def call(*given: Any, **named: Any) -> Any:
        begin = process_time()
        try:
            return function(*given, **named)
        finally:
            times[name] += process_time() - begin

    return call


def table(ways: dict[str, dict[str, float]], blocks: int) -> list[str]:
    """Share and seconds per million blocks of each stage, and how much faster all would be if it took nothing."""
    rows = ["| stage | " + " | ".join(f"{way} | s per million blocks | without it" for way in ways) + " |"]
    rows.append("|---|" + "---|" * 3 * len(ways))
    names = [name for name in next(iter(ways.values())) if name != "all"]
    for name in [*names, "all"]:
        cells = []
        for times in ways.values():
            share = times[name] / times["all"]
            gain = f"{1 / (1 - share):.2f} times" if name != "all" else ""
            cells += [f"{100 * share:.0f} %", f"{1e6 * times[name] / blocks:.2f}", gain]
        rows.append(f"| {name} | " + " | ".join(cells) + " |")
    return rows


def profile(source: bytes) -> list[str]:
    """The functions in which most CPU time is spent themselves."""
    profiler = cProfile.Profile(process_time)
    profiler.runcall(corrected, source)
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
