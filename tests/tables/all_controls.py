"""One table of all controls and all shipped machines: `make tables` writes it into docs/controllers.md.

Every control makes its tables for every machine, reads them back from the files and runs them on 20,000 random poses,
with the tool and the target that are named above the table.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from ncfix.diagnostics import NcfixError
from ncfix.machine import Machine, load
from ncfix.tables.control import Request, controls
from ncfix.tables.correction import POSES, ranges_of
from ncfix.tables.export import export

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "controllers.md"
BEGIN, END = "<!-- all controls: begin -->", "<!-- all controls: end -->"
MACHINES = ("three_axis", "wCAYFXZSt", "wCBXFZYSt", "dmu50")
LENGTH, TARGET = 120.0, 0.001
SETTINGS = {
    "fanuc": {"sign": "error"},
    "fanuc-pitch": {"sign": "error"},
    "fanuc-rotary": {"sign": "error"},
    "heidenhain": {"sign": "error"},
    "heidenhain-kinematics": {"sign": "error", "angle_unit": "deg"},
    "siemens": {"value_sign": "error", "product_terms": "only"},
}
MORE = {"fanuc": ({"rotary": "middle"},)}
"""Further rows, for machines with rotary axes."""
HEAD = (
    "machine",
    "control",
    "class",
    "tables",
    "points",
    "before max / rms",
    "after max / rms",
    "at least",
    "the largest error remains at",
)


def row(name: str, machine: Machine, control: str, more: dict[str, str]) -> tuple[str, ...]:
    """One control on one machine; what is refused is said in words."""
    chosen = controls()[control]
    options = chosen.settings({**SETTINGS.get(control, {}), **more})
    title = " ".join([control, *(f"{key}={value}" for key, value in more.items())])
    try:
        made = export(chosen, Request(machine, ranges_of(machine), LENGTH, TARGET, options), POSES)
    except NcfixError as error:
        said = f"{error.messages[0].code}: {error.messages[0].text}"
        return (name, title, chosen.reaches, "-", "-", "-", said, "-", "-")
    figures, limits = made.left.figures(), made.limits()
    sizes = [f"{figures[when]['max']:.2f} / {figures[when]['rms']:.2f}" for when in ("before", "after")]
    at = " ".join(f"{axis}{value:g}" for axis, value in figures["after"]["at"].items())
    least = f"{1e3 * made.least.value:.2f}" if made.least else ""
    return (name, title, made.reaches, str(limits["tables"]), str(limits["points"]), *sizes, least, at)


def rows() -> Iterator[tuple[str, ...]]:
    """All of them, machine by machine, told on the way."""
    for name in MACHINES:
        machine = load(ROOT / "examples" / "machines" / f"{name}.toml")
        for control in sorted(controls()):
            for more in ({}, *(MORE.get(control, ()) if machine.rotary.any() else ())):
                start = time.monotonic()
                found = row(name, machine, control, more)
                print(json.dumps(found), f"{time.monotonic() - start:.0f} s", file=sys.stderr, flush=True)
                yield found


def table() -> str:
    """In Markdown."""
    lines = [HEAD, ("---",) * len(HEAD), *rows()]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def main() -> None:
    """Print the table, and put it between its marks in the page."""
    found = table()
    print(found)
    page = PAGE.read_text()
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    PAGE.write_text(f"{before}{BEGIN}\n{found}\n{END}{after}")


if __name__ == "__main__":
    main()
