"""Times ncfix, LinuxCNC's interpreter and plain Lark in turn on the same files, and writes docs/performance.md.

    make bench                         10^5 and 10^6 blocks, five runs each: a quarter of an hour
    make bench SIZES="100000" RUNS=3   other sizes, other numbers of runs
    make bench LONG=10000000           and one run of a long file, for memory and scaling: two minutes more
    make bench OTHERS=1000000          programs of other controls of another length than 200 000 blocks, one run each
    make bench VERBS="100000"          the other verbs on programs of this length
    make bench SIZES="" VERBS="" OTHERS=1000000 only programs of other controls

A figure is the median of whole processes: start of Python, imports, reading, following, correcting, proof and writing.
CPU time is what is compared: it depends less on what else the machine does.
"""

from __future__ import annotations

import argparse
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from hashlib import file_digest
from pathlib import Path
from statistics import median
from time import perf_counter

sys.path.insert(0, str(Path(__file__).parent))

import controls
import programs

HERE = Path(__file__).resolve().parent
PAGE = HERE.parent / "docs" / "performance.md"
MACHINE = HERE / "five_axis.toml"
MARK = "<!-- figures: written by `make bench` -->"
OTHER_BEGIN, OTHER_END = "<!-- other controls: written by `make bench` -->", "<!-- end of other controls -->"
VERBS_BEGIN, VERBS_END = "<!-- other verbs: written by `make bench` -->", "<!-- end of other verbs -->"
OUTPUT = "out.nc"
LARK_LINES = 20_000
"""Plain Lark is timed on so many lines, and the time scaled."""

INI = """[RS274NGC]
PARAMETER_FILE = {folder}/parameters.var
RS274NGC_STARTUP_CODE = G21 G90 G17 G40 G49 G80 G94
[TRAJ]
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
COORDINATES = X Y Z A B C
"""


@dataclass(frozen=True, slots=True)
class Run:
    """One process: CPU and wall time, s, and peak memory, MB."""

    cpu: float
    wall: float
    memory: float


@dataclass(frozen=True, slots=True)
class Contender:
    """A command, by how much its times are to be multiplied, and the most runs that it is worth."""

    name: str
    command: list[str]
    environment: dict[str, str]
    scale: float = 1.0
    most: int = 1_000_000

    def run(self) -> Run:
        """Run it once; raises CalledProcessError if it fails."""
        begin = perf_counter()
        environment = {**os.environ, "OMP_NUM_THREADS": "1", **self.environment}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)  # modules are compiled once, as after an installation
        process = subprocess.Popen(
            self.command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=environment,
        )
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        wall = perf_counter() - begin
        if process.returncode:
            raise subprocess.CalledProcessError(process.returncode, self.command)
        return Run(self.scale * (usage.ru_utime + usage.ru_stime), self.scale * wall, usage.ru_maxrss / 1024)


MOST_INTERPRETED = 100_000
"""Blocks that are worth a run without the compiled core: it takes minutes for more."""
PLAIN, COMPILED = {"NCFIX_CORE": "plain"}, {"NCFIX_CORE": "compiled"}
NCFIX = shutil.which("ncfix", path=str(Path(sys.executable).parent)) or "ncfix"
SETUP = ["-m", str(MACHINE), "--dialect", "linuxcnc", "--offset", "G54=0,0,0,0,0", "--tool", "0=0"]


def contenders(program: Path, folder: Path, blocks: int) -> list[Contender]:
    """What is timed on a program."""
    fix = [NCFIX, "fix", str(program), "-o", str(folder / OUTPUT), "--force", *SETUP]
    two, fix = [*fix, "--jobs", "2"], [*fix, "--jobs", "1"]
    found = [
        *([Contender("ncfix, core interpreted", fix, PLAIN)] if blocks <= MOST_INTERPRETED else []),
        Contender("ncfix", fix, COMPILED),
        Contender("ncfix, without figures", [*fix, "--no-figures"], COMPILED),
        Contender("ncfix, two jobs", two, COMPILED),
    ]
    if shutil.which("rs274"):
        ini, tools = folder / "bench.ini", folder / "tools.tbl"
        ini.write_text(INI.format(folder=folder))
        tools.write_text("T1 P1 Z0 ;\n")
        (folder / "parameters.var").write_text("5220\t1.0\n")
        command = ["rs274", "-g", "-n", "2", "-i", str(ini), "-t", str(tools), "-v", str(folder / "parameters.var")]
        found.insert(0, Contender("rs274", [*command, str(program), os.devnull], {"HOME": str(folder)}))
    lark = [sys.executable, str(HERE / "plain_lark.py"), str(program), str(LARK_LINES)]
    return [*found, Contender("Lark alone, reads only", lark, {}, blocks / LARK_LINES, 1)]


def timed(program: Path, folder: Path, blocks: int, runs: int) -> dict[str, Run]:
    """The median of each contender, which take turns; of several runs one before them does not count.

    Raises AssertionError if the ways of ncfix do not write the same.
    """
    teams = contenders(program, folder, blocks)
    results: dict[str, list[Run]] = {team.name: [] for team in teams}
    warmup, texts = int(runs > 1), set()
    for number in range(warmup + runs):
        for team in teams:
            if number >= warmup + team.most or (team.most < runs and number < warmup):
                continue
            run = team.run()
            if team.name.startswith("ncfix"):
                texts.add(digest(folder / OUTPUT))
            if number >= warmup:
                results[team.name].append(run)
                print(f"{program.name} {team.name}: {run.cpu:.2f} s CPU, {run.memory:.0f} MB", flush=True)
    assert len(texts) == 1, "the ways of ncfix do not write the same"
    return {
        name: Run(*(median(getattr(run, key) for run in each) for key in ("cpu", "wall", "memory")))
        for name, each in results.items()
    }


def digest(path: Path) -> bytes:
    """What shows whether files are alike; not read whole, since the memory of this process counts in those it forks."""
    with path.open("rb") as file:
        return file_digest(file, "sha256").digest()


HEAD = (
    "| blocks | words | | CPU s | wall s | blocks/s CPU | times rs274 | peak MB |",
    "|---|---|---|---|---|---|---|---|",
)


def table(blocks: int, style: str, results: dict[str, Run]) -> list[str]:
    """The rows of one file."""
    reference, rows = results.get("rs274"), []
    for name, run in results.items():
        ratio = f"{reference.cpu / run.cpu:.2f}" if reference else ""
        times, speed = f"{run.cpu:.2f} | {run.wall:.2f}", f"{blocks / run.cpu / 1000:.0f} k"
        rows.append(f"| {spaced(blocks)} | {style} | {name} | {times} | {speed} | {ratio} | {run.memory:.0f} |")
    return rows


def spaced(number: int) -> str:
    """A large number with its digits in threes."""
    return f"{number:,}".replace(",", " ")


def main() -> None:
    """Run all, and put the figures into the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="*", default=[1_000_000])
    parser.add_argument("--styles", nargs="*", default=["full", "mixed"], choices=programs.STYLES)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--long", type=int, default=0)
    parser.add_argument("--others", type=int, default=200_000)
    parser.add_argument("--verbs", type=int, nargs="*", default=[100_000, 1_000_000])
    given = parser.parse_args()
    if given.others:
        other_controls(given.others)
    if given.verbs:
        other_verbs(given.verbs)
    if not given.sizes:
        return
    text = [*conditions(given.runs), "", *HEAD]
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for blocks in given.sizes:
            for style in given.styles:
                path = folder / f"{style}.nc"
                programs.write(path, blocks, style)
                text += table(blocks, style, timed(path, folder, blocks, given.runs))
        text.append("")
        if given.long:
            text += long_file(given.long, folder)
        print(*stages(folder), sep="\n")
    page = PAGE.read_text()
    PAGE.write_text(page[: page.index(MARK) + len(MARK)] + "\n\n" + "\n".join(text).rstrip() + "\n")


def conditions(runs: int) -> list[str]:
    """On what the figures were taken."""
    where = f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}"
    load = f"load {os.getloadavg()[0]:.1f} when it began"
    return [f"{where}, {load}; {f'medians of {runs}' if runs > 1 else 'single runs'}, whole processes."]


def long_file(blocks: int, folder: Path) -> list[str]:
    """One run each of a file and of one that is ten times as long."""
    rows = ["### Ten times as long", "", "| blocks | CPU s | wall s | peak MB |", "|---|---|---|---|"]
    times = []
    for count in (blocks // 10, blocks):
        path = folder / "long.nc"
        programs.write(path, count, "full")
        teams = {each.name: each for each in contenders(path, folder, count)}
        run = teams["ncfix"].run()
        times.append(run.cpu)
        rows.append(f"| {spaced(count)} | {run.cpu:.1f} | {run.wall:.1f} | {run.memory:.0f} |")
    return [*rows, "", f"Ratio of the times: {times[1] / times[0]:.2f}.", ""]


def other_controls(blocks: int) -> None:
    """One run each of the programs of other controls, into the page."""
    rows = [f"{spaced(blocks)} blocks, {conditions(1)[0]}", ""]
    rows += ["| | program | CPU s | us a block | peak MB |", "|---|---|---|---|---|"]
    with tempfile.TemporaryDirectory() as temporary:
        for control in controls.OTHERS:
            for style in control.programs.STYLES:
                path = Path(temporary) / "program"
                control.programs.write(path, blocks, style)
                rows.append(row_of(control, style, way_of(control, path).run(), blocks))
                print(rows[-1], flush=True)
    into_page(rows, OTHER_BEGIN, OTHER_END)


def into_page(rows: list[str], begin: str, end: str) -> None:
    """Put lines between two marks of the page."""
    head, rest = PAGE.read_text().split(begin)
    PAGE.write_text(f"{head}{begin}\n\n" + "\n".join(rows) + f"\n\n{end}" + rest.split(end)[1])


def other_verbs(sizes: list[int]) -> None:
    """One run each of the verbs that look at programs, with the compiled core, into the page."""
    rows = [
        f"Full words, compiled core, {conditions(1)[0]}",
        "",
        "| blocks | verb | CPU s | peak MB |",
        "|---|---|---|---|",
    ]
    with tempfile.TemporaryDirectory() as temporary:
        program, output, listed = (Path(temporary) / name for name in ("full.nc", OUTPUT, "listed.csv"))
        for blocks in sizes:
            programs.write(program, blocks, "full")
            fix = [NCFIX, "fix", str(program), "-o", str(output), "--force", *SETUP]
            Contender("fix", fix, COMPILED).run()
            for name, *words in (
                ("verify", "verify", str(program), str(output)),
                ("check", "check", str(program)),
                ("simulate", "simulate", "--program", str(program)),
                ("simulate -o", "simulate", "--program", str(program), "-o", str(listed), "--force"),
                ("trace -o", "trace", str(program), "-o", str(listed), "--force"),
            ):
                run = Contender(name, [NCFIX, *words, *SETUP], COMPILED).run()
                rows.append(f"| {spaced(blocks)} | `{name}` | {run.cpu:.1f} | {run.memory:.0f} |")
                print(rows[-1], flush=True)
    into_page(rows, VERBS_BEGIN, VERBS_END)


def way_of(control: controls.OtherControl, program: Path) -> Contender:
    """ncfix on a program of another control."""
    fix = [NCFIX, "fix", str(program), "-m", str(MACHINE), "-o", str(program.with_name(OUTPUT)), "--force"]
    fix += ["--dialect", control.dialect, "--assume-zero", "--allow-refused", "--jobs", "1", *control.options]
    return Contender("ncfix", fix, COMPILED)


def row_of(control: controls.OtherControl, style: str, run: Run, blocks: int) -> str:
    """A row of the table of other controls."""
    figures = f"{run.cpu:.1f} | {1e6 * run.cpu / blocks:.0f} | {run.memory:.0f}"
    return f"| {control.title} | {style} | {figures} |"


def stages(folder: Path) -> list[str]:
    """Where the time goes, from inside one run."""
    path = folder / "stages.nc"
    programs.write(path, 100_000, "full")
    command = [sys.executable, str(HERE / "stages.py"), str(path), "--dialect", "linuxcnc"]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    found = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, env=environment)
    said = "Without the start of the process, imports and compiling. `without it`: how much faster the whole would be"
    head = [
        "Share of time of each stage, 100 000 blocks, full words",
        "",
        said,
        "if the stage took no time at all.",
        "",
    ]
    return [*head, *found.stdout.splitlines(), ""]


if __name__ == "__main__":
    main()
