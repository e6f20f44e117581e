"""The largest real programs that both rs274 and ncfix take: CPU time of whole processes, into docs/performance.md.

    make bench-real                    the 20 largest of the corpus (`NCFIX_SHARED`, else ../shared), one run each
    make bench-real COUNT=5 RUNS=3     fewer of them, medians of three

The machine is that of the benchmarks with travels that take any program. What a program uses and does not say is zero.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from statistics import median

sys.path.insert(0, str(Path(__file__).parent))

from run import COMPILED, INI, MACHINE, NCFIX, Contender, into_page

FOLDERS = {"linuxcnc": "linuxcnc", "iso": "linuxcnc", "grbl": "linuxcnc"}
"""Of the corpus, and the dialect in which ncfix reads its programs: that of rs274."""
BEGIN, END = "<!-- real programs: written by `make bench-real` -->", "<!-- end of real programs -->"


def wide_machine(folder: Path) -> Path:
    """The machine of the benchmarks with long travels."""
    path = folder / "wide.toml"
    lines = MACHINE.read_text().splitlines()
    path.write_text("\n".join("range = [-20000, 20000]" if line.startswith("range") else line for line in lines) + "\n")
    return path


def both(program: Path, dialect: str, folder: Path, machine: Path) -> tuple[Contender, Contender]:
    """rs274 and ncfix on a program."""
    ini, tools, variables = folder / "bench.ini", folder / "tools.tbl", folder / "parameters.var"
    ini.write_text(INI.format(folder=folder))
    tools.write_text("".join(f"T{n} P{n} Z0 D1 ;\n" for n in range(1, 60)))
    variables.write_text("5220\t1.0\n")
    command = ["rs274", "-g", "-n", "2", "-i", str(ini), "-t", str(tools), "-v", str(variables)]
    fix = [NCFIX, "fix", str(program), "-m", str(machine), "-o", str(folder / "out.nc"), "--force", "--quiet"]
    fix += ["--dialect", dialect, "--assume-zero", "--allow-refused", "--jobs", "1"]
    judge = Contender("rs274", [*command, str(program), os.devnull], {"HOME": str(folder)})
    return judge, Contender("ncfix", fix, COMPILED)


def timed(count: int, runs: int, folder: Path) -> Iterator[tuple[int, float, float]]:
    """Lines and CPU times of rs274 and ncfix, s, of the largest programs that both take."""
    shared = Path(os.environ.get("NCFIX_SHARED", Path(__file__).parents[2] / "shared"))
    sized = ((path, dialect) for name, dialect in FOLDERS.items() for path in shared.glob(f"corpus/{name}/*"))
    machine = wide_machine(folder)
    for path, dialect in sorted(sized, key=lambda each: -each[0].stat().st_size):
        if not count:
            return
        teams = both(path, dialect, folder, machine)
        try:
            times = [[team.run().cpu for team in teams] for _ in range(runs)]
        except subprocess.CalledProcessError:
            continue
        count -= 1
        reference, own = (median(each) for each in zip(*times, strict=True))
        lines = path.read_bytes().count(b"\n")
        print(f"{lines} lines: rs274 {reference:.2f} s, ncfix {own:.2f} s, {path.name}", flush=True)
        yield lines, reference, own


def main() -> None:
    """Run all, and put the sums into the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--runs", type=int, default=1)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rows = list(timed(given.count, given.runs, Path(folder)))
    lines, reference, own = (sum(column) for column in zip(*rows, strict=True))
    slowest = max(1e6 * each / count for count, _, each in rows)
    share = f"{1e6 * own / lines:.0f} us a line, at most {slowest:.0f}; starting is in it"
    text = f"The {len(rows)} largest programs of the corpus that both take, {lines} lines in all:"
    text += f"\nrs274 {reference:.1f} s of CPU time, ncfix {own:.1f} s, {share}."
    into_page(text.splitlines(), BEGIN, END)
    print(text)


if __name__ == "__main__":
    main()
