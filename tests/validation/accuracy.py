"""The tables of docs/accuracy.md that are worked out here: `make accuracy` writes them into the page.

    python tests/validation/accuracy.py [STUDY...] [--draws N] [--chains N] [-o FILE]

A table stands between marks that are not seen when the page is shown; the rest of the page stays as it is.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from diagnose.tables import put  # noqa: E402

PAGE = ROOT / "docs" / "accuracy.md"


def round_trips(options: argparse.Namespace) -> str:
    """200 draws of every machine and instrument: ten minutes."""
    from validation import round_trips as study

    return f"{options.draws} draws each:\n\n{study.table(options.draws)}"


def random_chains(options: argparse.Namespace) -> str:
    """1,000 chains: half an hour, most of it `derive`."""
    from validation import random_chains as study

    return study.table(range(options.chains))


def plans(options: argparse.Namespace) -> str:
    """Planned against random poses: five minutes."""
    from validation import plans as study

    return study.table()


def controls(options: argparse.Namespace) -> str:
    """Esmaeili's headline reductions, in simulation: two minutes."""
    from validation import esmaeili_reductions as study

    return study.table()


STUDIES: dict[str, Callable[[argparse.Namespace], str]] = {
    "round-trips": round_trips,
    "chains": random_chains,
    "plans": plans,
    "esmaeili": controls,
}


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("studies", nargs="*", metavar="STUDY", help=f"of {', '.join(STUDIES)}; all if none is given")
    parser.add_argument("--draws", type=int, default=200)
    parser.add_argument("--chains", type=int, default=1000)
    parser.add_argument("-o", "--output", type=Path, default=PAGE)
    options = parser.parse_args()
    unknown = [name for name in options.studies if name not in STUDIES]
    if unknown:
        parser.error(f"no study {unknown[0]}: {', '.join(STUDIES)}")
    for name in options.studies or STUDIES:
        table = STUDIES[name](options)
        put(str(options.output), name, [table])
        print(table)


if __name__ == "__main__":
    main()
