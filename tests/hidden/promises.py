"""Are the chances kept that `--next` states? Ambiguous answers are measured again at the poses that they propose.

`python -m tests.hidden.promises --count 200 --first 1` goes through scenarios of the families in which names stay open,
until so many promises were made; `--family alike` asks small ones only, which are quick. A promise is kept where the
true name stands alone afterwards. The table has, for each range of stated chances, how many promises there were and how
many were kept; and all of them, with what was stated on average. Nothing here imports ncfix.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import tempfile
from itertools import count, pairwise
from pathlib import Path

from . import remeasure
from .candidate import Candidate, ask
from .families import Task, development_seed, final_seed
from .intervals import wilson
from .names import matches
from .scenario import scenario
from .score import EXTRA_POSES, _is

FAMILIES = ("pair", "poor", "alike")
EDGES = (0.0, 0.3, 0.6, 0.8, 0.9, 1.0001)


def main() -> int:
    """Ask, measure again, print."""
    p = argparse.ArgumentParser(prog="python -m tests.hidden.promises", description=__doc__)
    p.add_argument("--count", type=int, default=10, help="promises")
    p.add_argument("--first", type=int, default=0, help="the first scenario of each family that is asked")
    p.add_argument("--final", action="store_true")
    p.add_argument("--family", choices=FAMILIES, action="append", help="one that is asked, instead of all in turn")
    p.add_argument("--callable", default="tests.diagnose.resident:resident")
    options = p.parse_args()
    module, _, factory = options.callable.partition(":")
    candidate: Candidate = getattr(importlib.import_module(module), factory)()
    made: list[tuple[float, bool]] = []
    seed = final_seed if options.final else development_seed
    for task in (Task(name, k, seed(name, k)) for k in count(options.first) for name in options.family or FAMILIES):
        if len(made) >= options.count:
            break
        scene = scenario(task.seed, task.family, task.index)
        with tempfile.TemporaryDirectory() as folder:
            base = Path(folder)
            scene.write(base / "handed", base / "truth")
            answer = ask(candidate, base / "handed")
            stated = ((answer.raw.get("ambiguity") or {}).get("told_apart") or {}).get("chance")
            if stated is None or not answer.next_poses:
                continue
            more = base / "handed" / "more.csv"
            more.write_text(remeasure.at_poses(scene, answer.next_poses[:EXTRA_POSES], scene.truth.seed))
            again = ask(candidate, base / "handed", more=[more])
        truth = scene.truth.named()[0]
        first = again.effects[0] if again.effects else None
        kept = bool(first and _is(first, truth) and all(matches(truth, alias) for alias in first.aliases))
        made.append((float(stated), kept))
        names = f"{first.name} ({', '.join(first.aliases)})" if first else again.error or "nothing"
        print(f"{task.family} {task.index}: stated {stated:.2f}, {'kept' if kept else 'not kept'}: {names}", flush=True)
    print(table(made))
    return 0


def table(made: list[tuple[float, bool]]) -> str:
    """Markdown rows of stated and kept."""
    rows = ["| stated | promises | stated, mean | kept | share | 95 % interval |", "|---|---|---|---|---|---|"]
    for low, high in [*pairwise(EDGES), (0.0, 2.0)]:
        own = [each for each in made if low <= each[0] < high]
        if own:
            kept = sum(each[1] for each in own)
            mean = sum(each[0] for each in own) / len(own)
            a, b = wilson(kept, len(own))
            title = "all" if high > 1.5 else f"{low:.1f} to {min(high, 1.0):.1f}"
            row = f"| {title} | {len(own)} | {mean:.2f} | {kept} | {kept / len(own):.2f} | {a:.2f} to {b:.2f} |"
            rows.append(row)
    return "\n".join(rows)


if __name__ == "__main__":
    sys.exit(main())
