"""Faults put into the code of ncfix itself (mutants, by cosmic-ray): how many of them do its tests find?

    PYTHONPATH=tests python -m robustness.mutation --count 30 [--only limits] [--seed 1]

works in a clone of the last commit. Of each module it takes so many mutants at random, and runs the tests that are
about that module. It prints the share that is found, and every mutant that is not.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
MODULES = {
    "src/ncfix/compensate/plan/limits.py": ("compensate/test_limits.py", "compensate/test_long_motions.py"),
    "src/ncfix/compensate/account.py": (
        "compensate/test_account.py",
        "cli/test_no_figure.py",
        "compensate/test_wordless.py",
    ),
    "src/ncfix/control/state.py": (
        *("program/test_trace_motion.py", "program/test_trace_knowledge.py", "program/test_trace_offsets.py"),
        *("program/test_frames.py", "program/test_pointing.py", "program/siemens/test_following.py"),
        *("program/test_contour.py", "compensate/test_block_delete.py", "classes/test_planes_by_steps.py"),
    ),
    "src/ncfix/writer/block.py": (
        *(
            "program/test_emit.py",
            "program/test_number_style.py",
            "compensate/test_arcs.py",
            "compensate/test_rounding.py",
        ),
        *("program/siemens/test_writing.py", "program/klartext/test_writing.py"),
    ),
}
"""Module -> the tests that are about it."""
TIMEOUT_S = 240
CONFIG = """[cosmic-ray]
module-path = "{module}"
timeout = {timeout}
excluded-modules = []
test-command = "{python} -m pytest -x -q -p no:cacheprovider -p no:xdist {tests}"

[cosmic-ray.distributor]
name = "local"
"""


def clone(folder: Path) -> None:
    """A copy of the last commit in which the compiled core is that of this folder."""
    subprocess.run(["git", "clone", "-q", str(ROOT), str(folder)], check=True)
    core = ROOT / "src/ncfix/core"
    for path in (*core.glob("*.so"), *core.glob("*.pyd"), *core.glob("compiled.txt")):
        shutil.copy2(path, folder / path.relative_to(ROOT))


def annotated(source: str) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Where annotations stand, from and to (line, column): what is changed there changes nothing that runs."""
    found = []
    for node in ast.walk(ast.parse(source)):
        for name in ("annotation", "returns"):
            part = getattr(node, name, None)
            if isinstance(part, ast.expr):
                found.append(((part.lineno, part.col_offset), (part.end_lineno or 0, part.end_col_offset or 0)))
    return found


def survivors(folder: Path, module: str, count: int, rng: random.Random) -> Iterator[str]:
    """Mutants of a module that no test finds: differences of its text, empty for one that is found."""
    from cosmic_ray.work_db import WorkDB, use_db
    from cosmic_ray.work_item import TestOutcome

    name = Path(module).stem
    tests = " ".join(f"tests/{path}" for path in MODULES[module])
    config, session = folder / f"{name}.toml", folder / f"{name}.sqlite"
    config.write_text(CONFIG.format(module=module, timeout=TIMEOUT_S, python=sys.executable, tests=tests))
    paths = os.pathsep.join(str(folder / each) for each in ("src", "plugins", "tests"))
    environment = {**os.environ, "PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1", "NCFIX_SHARED": ""}

    def cosmic(*arguments: str) -> None:
        command = [sys.executable, "-m", "cosmic_ray.cli", *arguments]
        subprocess.run(command, cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL)

    cosmic("init", config.name, session.name)
    with use_db(str(session), WorkDB.Mode.open) as database:
        idle = annotated((folder / module).read_text())
        mutants = [
            item
            for item in database.work_items
            if not any(begin <= each.start_pos < end for each in item.mutations for begin, end in idle)
        ]
        mutants.sort(
            key=lambda item: [(each.start_pos, each.operator_name, each.occurrence) for each in item.mutations]
        )
        database.clear()
        database.add_work_items(rng.sample(mutants, min(count, len(mutants))))
    cosmic("baseline", config.name)
    cosmic("exec", config.name, session.name)
    with use_db(str(session), WorkDB.Mode.open) as database:
        for _, result in database.results:
            yield (result.diff or "") if result.test_outcome == TestOutcome.SURVIVED else ""


def main() -> None:
    """Try mutants, and say what became of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=30, help="mutants of each module")
    parser.add_argument("--only", default="", help="modules with this in their path")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    found = total = 0
    for module in (each for each in MODULES if given.only in each):
        with tempfile.TemporaryDirectory(prefix="ncfix-mutation-") as place:
            folder = Path(place) / "ncfix"
            clone(folder)
            left = list(survivors(folder, module, given.count, random.Random(given.seed)))
        missed = [diff for diff in left if diff]
        print(f"{module}: {len(left) - len(missed)} of {len(left)} mutants found", flush=True)
        print(*missed, sep="\n", flush=True)
        found, total = found + len(left) - len(missed), total + len(left)
    print(f"{found} of {total} mutants found: {100 * found / max(total, 1):.0f} %")


if __name__ == "__main__":
    main()
