"""`python -m tests.hidden`: build scenarios, ask the code under test, print the table."""

from __future__ import annotations

import argparse
import json
import os
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import partial
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from . import candidate, score, tally  # noqa: E402
from .families import FAMILIES, Task, tasks  # noqa: E402
from .scenario import scenario  # noqa: E402

HISTORY = Path(__file__).with_name("history.md")
"""What an earlier final run gave, as it came."""


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(
        prog="python -m tests.hidden", description="The hidden-effect benchmark; see README.md beside it."
    )
    p.add_argument("--family", action="append", choices=list(FAMILIES), help="only these (default: all)")
    p.add_argument(
        "--count",
        type=counted,
        action="append",
        default=[],
        metavar="[FAMILY=]N",
        help="only the first so many scenarios of every family, or of that one; repeatable",
    )
    p.add_argument("--final", action="store_true", help="the final seeds: once, and reported as they came")
    p.add_argument("--command", default="ncfix", help="the program under test (default: ncfix)")
    p.add_argument("--without", default="--without", help="its option that takes a name out of the catalogue")
    p.add_argument("--callable", metavar="MODULE:FACTORY", help="a candidate in this process instead of a program")
    p.add_argument(
        "--records",
        type=Path,
        default=Path(os.devnull),
        help="keep the answers there, and do not ask again what is there (default: keep none)",
    )
    p.add_argument("--known", action="store_true", help="ask nothing: the table of what the records hold")
    p.add_argument("--table", type=Path, help="Markdown file whose section is replaced")
    p.add_argument("--note", default="", help="what the section says besides about this run")
    p.add_argument("--write", type=Path, metavar="DIR", help="only write the scenarios there, ask nothing")
    p.add_argument("--keep", type=Path, metavar="DIR", help="keep what was handed over and the truth there")
    p.add_argument("-j", "--jobs", type=int, default=2)
    return p


def main(arguments: list[str] | None = None) -> int:
    """Run; 0 when every required line that was counted is met, else 1."""
    options = parser().parse_args(arguments)
    wanted = tasks(options.family or list(FAMILIES), options.final, dict(options.count))
    if options.write:
        return write(wanted, options.write)
    records = known(options.records)
    todo = [task for task in wanted if (task.family, task.seed) not in records]
    asked = candidate.load(options.callable) if options.callable else program(options)
    answer_all([] if options.known else todo, asked, options, records)
    chosen = [records[task.family, task.seed] for task in wanted if (task.family, task.seed) in records]
    run = f"{'Final' if options.final else 'Development'} seeds. {options.note}".strip()
    section = tally.markdown(chosen, run, HISTORY.read_text().strip() if options.final else "")
    print(section)
    if options.table:
        old = options.table.read_text() if options.table.exists() else ""
        options.table.write_text(tally.replaced(old, section))
    return int(any(line.met == "no" for line in tally.lines(chosen)))


def counted(text: str) -> tuple[str, int]:
    """`FAMILY=N`, or `N` for all."""
    name, _, number = text.rpartition("=")
    if name and name not in FAMILIES:
        raise argparse.ArgumentTypeError(f"no family {name}")
    return name, int(number)


def program(options: argparse.Namespace) -> candidate.Program:
    """The command line under test."""
    return candidate.Program(tuple(options.command.split()), options.without)


def known(path: Path) -> dict[tuple[str, int], score.Record]:
    """Answers of an earlier run."""
    lines = path.read_text().splitlines() if path.exists() else []
    records = [score.from_row(json.loads(line)) for line in lines]
    return {(r.family, r.seed): r for r in records}


def answer_all(
    todo: list[Task],
    asked: candidate.Candidate,
    options: argparse.Namespace,
    records: dict[tuple[str, int], score.Record],
) -> None:
    """Ask about every task, some at once; each answer is written as soon as it is there."""
    one = partial(score.run, candidate=asked, keep=options.keep)
    with ProcessPoolExecutor(options.jobs) as pool, options.records.open("a") as file:
        waiting = [pool.submit(one, task) for task in todo]
        for number, done in enumerate(as_completed(waiting), 1):
            record = done.result()
            records[record.family, record.seed] = record
            file.write(json.dumps(score.as_row(record)) + "\n")
            file.flush()
            print(f"\r{number}/{len(todo)}", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)


def write(wanted: list[Task], folder: Path) -> int:
    """The scenarios as files: `handed/<name>` for the code under test, `truth/<name>` for the judge."""
    for task in wanted:
        name = f"{task.family}-{task.index:03d}"
        scenario(task.seed, task.family, task.index).write(folder / "handed" / name, folder / "truth" / name)
    return 0


if __name__ == "__main__":
    sys.exit(main())
