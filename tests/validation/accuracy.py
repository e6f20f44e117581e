"""What docs/accuracy.md says, worked out: `make accuracy` writes the page.

    python tests/validation/accuracy.py [STUDY...] [--draws N] [--chains N] [-o FILE]

The text is that of accuracy_text.md and accuracy_checklists.md, beside this file; in it a study's table replaces its
mark `<!-- name -->`.
Studies that are not asked for keep what the page has for them, and so does the hidden-effect benchmark's section, which
`make hidden` writes.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from tests.hidden import tally  # noqa: E402

TEMPLATE = Path(__file__).with_name("accuracy_text.md")
CHECKLISTS = Path(__file__).with_name("accuracy_checklists.md")
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


WRITTEN_ELSEWHERE = ("study", "calibration", "metamorphic")
"""Tables that `make study` and `make metamorphic` write; they stay."""


def marked(name: str, table: str) -> str:
    """A study's part of the page, between marks that are not seen when it is shown."""
    return f"<!-- {name}: begin -->\n{table}\n<!-- {name}: end -->"


def kept(page: str, name: str) -> str:
    """What the page has for a study that is not worked out anew."""
    found = re.search(rf"<!-- {name}: begin -->\n(.*?)\n<!-- {name}: end -->", page, re.DOTALL)
    return found[1] if found else f"Not worked out yet: `make accuracy STUDIES={name}`."


def benchmark(page: str) -> str:
    """The section of the hidden-effect benchmark as the page has it."""
    if tally.BEGIN not in page or tally.END not in page:
        return ""
    return page[page.index(tally.BEGIN) : page.index(tally.END) + len(tally.END)]


def assembled(page: str, tables: dict[str, str]) -> str:
    """The new page from the old one and the tables that were worked out."""
    text = TEMPLATE.read_text().replace("<!-- checklists -->\n", CHECKLISTS.read_text())
    for name in (*STUDIES, *WRITTEN_ELSEWHERE):
        text = text.replace(f"<!-- {name} -->", marked(name, tables.get(name) or kept(page, name)))
    section = benchmark(page)
    return tally.replaced(text, section) if section else text


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
        # read again for each: another study, or the benchmark, may have written meanwhile
        page = options.output.read_text() if options.output.exists() else ""
        options.output.write_text(assembled(page, {name: table}))
        print(table)


if __name__ == "__main__":
    main()
