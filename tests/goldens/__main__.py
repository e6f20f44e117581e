"""Compares what ncfix makes of some thousand programs and files with what it once made of them; see `make goldens`.

    python -m goldens                        all cases (with `tests` on the path)
    python -m goldens klartext               of a group; or cases in whose name a word occurs: corpus/iso, cycles, .flat
    python -m goldens klartext --update      take what comes out now as right
    python -m goldens --show CASE            run a case and write its texts
    python -m goldens iso --against 73beab2  where there are differences, write the texts of that commit, too

Cases with a difference are named with the texts that differ, and all their texts are written to out/goldens/CASE/new
(and `old`). Exit code 1 if there is a difference.
"""

from __future__ import annotations

import argparse
import difflib
import json
import os
import re
import resource
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from io import BytesIO
from pathlib import Path

from goldens import programs, verbs
from goldens.case import HERE, LATE, ROOT, Case, Workplace, digest

OUT = ROOT / "out" / "goldens"
GROUPS = ("linuxcnc", "iso", "fanuc", "siemens", "heidenhain", "machine", "measure", "tables", "report")
ALIASES = {"klartext": "heidenhain", "sinumerik": "siemens", "rs274": "linuxcnc"}
SECONDS = 60.0
"""CPU time that a case may take. What took longer when its golden was made is not compared."""
TOGETHER = 8
"""Cases that a process takes at a time."""
LINES = 12
"""Of a difference that are printed."""

Digests = dict[str, str]


def main() -> int:
    """Run what is asked for; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("only", nargs="*", help="groups, or parts of the names of cases")
    parser.add_argument("--update", action="store_true", help="write the golden files anew")
    parser.add_argument(
        "--show", action="store_true", help="write the texts of these cases, whether they differ or not"
    )
    parser.add_argument("--against", metavar="COMMIT", help="also write what that commit makes of them")
    parser.add_argument("--resume", action="store_true", help="go on where a run of the same code was stopped")
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--most", type=int, default=20, help="cases with differences whose texts are written (20)")
    parser.add_argument("--texts", type=Path, metavar="FOLDER", help=argparse.SUPPRESS)
    given = parser.parse_args()
    cases = chosen(given.only)
    if given.texts:
        write_texts(cases, given.texts, "old")
        return 0
    if not cases:
        print(f"no case {' '.join(given.only)}; groups are {' '.join(GROUPS)}")
        return 2
    if given.show:
        write_texts(cases, OUT, "new")
        tell(cases, given.against)
        return 0
    differing = 0
    for group in GROUPS:
        late = [] if given.update else [name for name, each in read(group).items() if LATE in each.values()]
        of_group = [case for case in cases if case.group == group and case.name not in late]
        found = digests(of_group, given.jobs, OUT / f"{group}.done", resume=given.resume) if of_group else {}
        if given.update and of_group:
            update(group, found, is_whole=len(of_group) == len(chosen([group])))
        elif of_group:
            differing += compare(group, of_group, found, given.against, given.most)
    print(f"{len(cases)} cases, {differing} differences ({cpu():.0f} s of CPU)")
    return int(differing > 0)


def corpus() -> Path | None:
    """The shared corpus, if it is here."""
    folder = Path(os.environ.get("NCFIX_SHARED") or ROOT.parent / "shared") / "corpus"
    return folder if folder.is_dir() else None


def all_cases() -> Iterator[Case]:
    """All there are."""
    yield from programs.cases(corpus())
    yield from verbs.cases()


def chosen(only: Sequence[str]) -> list[Case]:
    """The cases of these groups, or with these words in their names; all for none."""
    words = [ALIASES.get(word, word) for word in only]
    groups = {word for word in words if word in GROUPS}
    parts = [word for word in words if word not in GROUPS]
    return [
        case for case in all_cases() if not words or case.group in groups or any(part in case.name for part in parts)
    ]


# -- running ----------------------------------------------------------------------------------------------------------


def digests(cases: Sequence[Case], jobs: int, keep: Path, *, resume: bool) -> dict[str, Digests]:
    """What comes of cases, worked out by so many processes; long cases first.

    keep    a file for what is done, to go on from there if `resume`
    """
    keep.parent.mkdir(parents=True, exist_ok=True)
    if not resume:
        keep.unlink(missing_ok=True)
    before = dict(map(json.loads, keep.read_text().splitlines())) if keep.exists() else {}
    found: dict[str, Digests] = {case.name: before[case.name] for case in cases if case.name in before}
    order = sorted(cases, key=lambda case: (not is_slow(case), case.name))
    order = [case for case in order if case.name not in found]
    slow = sum(map(is_slow, order))
    lots = [order[at : at + 1] for at in range(slow)]
    lots += [order[at : at + TOGETHER] for at in range(slow, len(order), TOGETHER)]
    with (
        keep.open("a") as kept,
        tempfile.TemporaryDirectory(prefix="goldens-") as folder,
        ProcessPoolExecutor(jobs, initializer=begin, initargs=(folder,)) as pool,
    ):
        for done in as_completed([pool.submit(run, lot) for lot in lots]):
            found |= done.result()
            kept.writelines(json.dumps(each) + "\n" for each in done.result().items())
            kept.flush()
            if sys.stderr.isatty():
                print(f"\r{len(found)} of {len(cases)} ", end="", file=sys.stderr, flush=True)
    if sys.stderr.isatty():
        print("\r", end="", file=sys.stderr)
    return found


def is_slow(case: Case) -> bool:
    """Whether a case takes more than a second."""
    return case.group in ("measure", "tables") or sum(map(len, case.files.values())) > programs.LONG


_place: list[Workplace] = []
"""The workplace of this process."""


def begin(folder: str) -> None:
    """Make the workplace of a process below a folder."""
    _place[:] = [Workplace(Path(folder) / str(os.getpid()), corpus())]


def run(cases: Sequence[Case]) -> dict[str, Digests]:
    """The digests of some cases, in a process with a workplace."""
    place = _place[0]
    return {case.name: {name: digest(text) for name, text in place.texts(case, SECONDS).items()} for case in cases}


def write_texts(cases: Sequence[Case], folder: Path, side: str) -> None:
    """Run cases in this process and write their programs and texts."""
    with tempfile.TemporaryDirectory(prefix="goldens-") as below:
        place = Workplace(Path(below) / "place", corpus())
        for case in cases:
            target = folder_of(case, folder)
            (target / side).mkdir(parents=True, exist_ok=True)
            for name, content in case.files.items():
                (target / name).write_bytes(content)
            for name, text in place.texts(case, SECONDS).items():
                (target / side / f"{name}.txt").write_text(text, encoding="utf-8", errors="backslashreplace")


def folder_of(case: Case, folder: Path = OUT) -> Path:
    """Where the texts of a case are written."""
    return folder / re.sub(r"[^\w.@+-]", "_", case.name)


# -- golden files -----------------------------------------------------------------------------------------------------


def read(group: str) -> dict[str, Digests]:
    """The goldens of a group, by case: a line names the texts, and each case has their digests."""
    path = HERE / f"{group}.txt"
    known: dict[str, Digests] = {}
    columns: list[str] = []
    for line in path.read_text().splitlines() if path.exists() else ():
        name, *values = line.split()
        if name == "case":
            columns = values
        else:
            known[name] = dict(zip(columns, values, strict=True))
    return known


def update(group: str, found: Mapping[str, Digests], *, is_whole: bool) -> None:
    """Write the goldens of a group; those of cases that were not run stay, unless all were that there are."""
    known = {**({} if is_whole and corpus() else read(group)), **found}
    lines, columns = [], ()
    for name in sorted(known, key=lambda name: (tuple(known[name]), name)):
        if tuple(known[name]) != columns:
            columns = tuple(known[name])
            lines.append(" ".join(["case", *columns]))
        lines.append(" ".join([name, *known[name].values()]))
    (HERE / f"{group}.txt").write_text("\n".join(lines) + "\n")
    print(f"{group}: {len(found)} cases written", flush=True)


# -- comparing --------------------------------------------------------------------------------------------------------


def compare(group: str, cases: Sequence[Case], found: Mapping[str, Digests], against: str | None, most: int) -> int:
    """Name the cases of a group that differ, write their texts, and print how many there are."""
    known = read(group)
    new = [case for case in cases if case.name not in known]
    differing = [case for case in cases if case not in new and found[case.name] != known[case.name]]
    for case in differing:
        texts = [name for name, value in found[case.name].items() if known[case.name].get(name) != value]
        print(f"{case.name}: {' '.join(texts)}")
    if differing:
        write_texts(differing[:most], OUT, "new")
        tell(differing[:most], against)
    notes = [f"{len(new)} without a golden"] * bool(new)
    print(", ".join([f"{group}: {len(cases)} cases", f"{len(differing)} differences", *notes]), flush=True)
    return len(differing)


def tell(cases: Sequence[Case], against: str | None) -> None:
    """Say where the texts of cases are, and how they differ from those of a commit."""
    if against:
        write_old_texts(cases, against)
    for case in cases:
        folder = folder_of(case)
        print(f"-- {folder.relative_to(ROOT)}")
        for path in sorted((folder / "new").iterdir()) if against else ():
            old = folder / "old" / path.name
            texts = [side.read_text(encoding="utf-8").splitlines() if side.exists() else [] for side in (old, path)]
            lines = list(difflib.unified_diff(*texts, f"old/{path.name}", f"new/{path.name}", n=1, lineterm=""))
            print(*lines[:LINES], *["..."] * (len(lines) > LINES), sep="\n", end="\n" * bool(lines))


def write_old_texts(cases: Sequence[Case], commit: str) -> None:
    """Run cases with the code of a commit, in a process of its own, and write their texts."""
    tree = OUT / "trees" / commit
    if not tree.exists():
        command = ["git", "archive", commit, "src", "plugins", "grammars", "pyproject.toml"]
        archive = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, check=True).stdout
        with tarfile.open(fileobj=BytesIO(archive)) as files:
            files.extractall(tree, filter="data")
        install(tree)
    path = os.pathsep.join(map(str, (tree, tree / "src", tree / "plugins", HERE.parent)))
    command = [sys.executable, "-m", "goldens", "--texts", str(OUT), *(case.name for case in cases)]
    subprocess.run(command, env={**os.environ, "PYTHONPATH": path}, check=True)


def install(tree: Path) -> None:
    """Make the entry points of a tree those that are found where it comes first on the path."""
    import tomllib

    project = tomllib.loads((tree / "pyproject.toml").read_text())["project"]
    folder = tree / "ncfix-0.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: ncfix\nVersion: 0\n")
    lines = []
    for group, entries in project.get("entry-points", {}).items():
        lines += [f"[{group}]", *(f"{name} = {value}" for name, value in entries.items())]
    (folder / "entry_points.txt").write_text("\n".join(lines) + "\n")


def cpu() -> float:
    """CPU seconds of this process and its workers."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


if __name__ == "__main__":
    sys.exit(main())
