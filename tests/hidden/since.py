"""Two dates: one effect is there on both, another came between them, or nothing did.

`python -m tests.hidden.since --count 12 --first 0` asks scenarios of the family `two` as two files: half of the sets
are measured with the first effect alone, the others newly set up with both. In every third nothing came. A run is right
where the first name is that of what came and nothing else is said to have come; where nothing came, where no change has
a name. Nothing here imports ncfix.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from . import files, instruments
from .candidate import Answer, Program, Reported, ask, load
from .families import tasks
from .intervals import wilson
from .names import Named, matches
from .scenario import Scenario, observe, scenario
from .score import _is

FAMILY, CHANGE, NOTHING_EVERY = "two", "change of ", 3


def two_files(scene: Scenario, came: bool, folder: Path) -> None:
    """The machine file and a file of each date."""
    draft, rng = scene.draft, np.random.default_rng([scene.truth.seed, 5])
    rows = draft.situation.rows(np.flatnonzero(draft.given))
    before = replace(draft.world, hidden=draft.world.hidden[:1])
    (folder / "machine.toml").write_text(scene.handed["machine.toml"])
    for number, world in enumerate((before, draft.world if came else before)):
        own = rows.rows(np.flatnonzero((rows.set_id // 2) % 2 == number))
        setup = instruments.draw_setup(rng, own, draft.kind)
        values = observe(world, own, draft.kind, setup)
        values = values + instruments.draw_noise(rng, scene.noise, own.time, values.shape[1])[0]
        (folder / f"measured-{number + 1}.csv").write_text(files.measurement(own, draft.kind, values))


def right(answer: Answer, truth: Named | None) -> bool:
    """Whether what came is named, first, and nothing else."""
    found = [each for each in answer.effects if each.name.startswith(CHANGE)]
    if truth is None or not found:
        return truth is None and not found and not answer.error
    bare = [Reported(e.name.removeprefix(CHANGE), e.title, e.axis) for e in found]
    aliases = [alias.removeprefix(CHANGE) for each in found[1:] for alias in each.aliases]
    others = [_is(each, truth) for each in bare[1:]]
    return _is(bare[0], truth) and (all(others) or any(matches(truth, alias) for alias in aliases))


def main() -> int:
    """Ask, judge, print."""
    p = argparse.ArgumentParser(prog="python -m tests.hidden.since", description=__doc__)
    p.add_argument("--count", type=int, default=12)
    p.add_argument("--first", type=int, default=0, help="the first scenario of the family that is asked")
    p.add_argument("--final", action="store_true")
    p.add_argument("--callable", default="tests.diagnose.resident:resident")
    options = p.parse_args()
    program = load(options.callable)
    assert isinstance(program, Program)
    candidate = replace(program, options=("--since",))
    asked = [t for t in sorted(tasks([FAMILY], options.final, {}), key=lambda t: t.index) if t.index >= options.first]
    tally = {True: [0, 0], False: [0, 0]}
    for task in asked[: options.count]:
        scene, came = scenario(task.seed, task.family, task.index), task.index % NOTHING_EVERY != NOTHING_EVERY - 1
        with tempfile.TemporaryDirectory() as folder:
            two_files(scene, came, Path(folder))
            answer = ask(candidate, Path(folder))
        old, new = scene.truth.named()[:2]
        kept = right(answer, new if came else None)
        tally[came][0] += kept
        tally[came][1] += 1
        said = (
            "; ".join(f"{e.name} ({', '.join(e.aliases)})" for e in answer.effects) or answer.error[:150] or "nothing"
        )
        print(
            f"{task.index}: {'right' if kept else 'wrong'}, {answer.verdict}: {said} | before {old.name}, "
            f"came {new.name if came else 'nothing'}, unchanged {answer.raw.get('unchanged')} "
            f"{answer.cpu_seconds:.0f} s",
            flush=True,
        )
    for came, (good, count) in tally.items():
        if count:
            a, b = wilson(good, count)
            print(f"{'changed' if came else 'nothing came'}: {good} of {count}, {a:.3f} to {b:.3f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
