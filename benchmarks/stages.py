"""The share of time that each stage of `fix` takes on one long program, as a table: `FILE`."""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from time import process_time
from typing import Any

from ncfix import fast
from ncfix.compensate import crew, path, settle, stream
from ncfix.compensate.options import FixOptions
from ncfix.machine import load
from ncfix.program import dialects, parts
from ncfix.program.rs274.following import RS274Follower
from ncfix.program.setup import Setup

SETUP = Setup(work_offsets={"G54": dict.fromkeys("XYZBC", 0.0)}, assume_zero=True)

STAGES: tuple[tuple[str, Any, str], ...] = (
    ("read the text (twice: the original, and for the proof)", parts.PartReader, "read"),
    ("follow it (twice)", RS274Follower, "follow"),
    ("correct the ends of motions", path, "corrected"),
    ("judge the path between them", path, "_judged"),
    ("split what leaves the tolerance", path, "_parts"),
    ("check limits", settle, "findings"),
    ("write: which words change, digits", settle, "emit"),
    ("write: put the text together", stream, "spliced"),
    ("figures: tip errors before and after", crew, "path_error"),
)


def main() -> None:
    """Time each stage in both ways."""
    columns = [timed(compiled) for compiled in (False, True)]
    print("| stage | plain | `fast` |\n|---|---|---|")
    for name in [name for name, _, _ in STAGES] + ["the rest"]:
        print(f"| {name} | " + " | ".join(f"{100 * column[name] / column['all']:.0f} %" for column in columns) + " |")


def timed(compiled: bool) -> dict[str, float]:
    """CPU seconds of each stage."""
    fast.disengage()
    if compiled:
        fast.engage()
    program, machine = Path(sys.argv[1]), load(Path(__file__).with_name("five_axis.toml"))
    times: dict[str, float] = defaultdict(float)
    originals = [(owner, attribute, getattr(owner, attribute)) for _, owner, attribute in STAGES]
    for name, owner, attribute in STAGES:
        setattr(owner, attribute, watched(getattr(owner, attribute), name, times))
    try:
        with program.open("rb") as file:
            given = (machine, SETUP, FixOptions(), None, str(program), dialects.get("linuxcnc"))
            begin = process_time()
            stream.Stream(*given, file.read, lambda data: None).run()
            times["all"] = process_time() - begin
    finally:
        for owner, attribute, original in originals:
            setattr(owner, attribute, original)
    times["the rest"] = times["all"] - sum(times[name] for name, _, _ in STAGES)
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


if __name__ == "__main__":
    main()
