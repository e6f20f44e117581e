"""Faults put into the code of ncfix itself (mutants, by cosmic-ray): how many of them do its tests find?

    PYTHONPATH=tests python -m robustness.mutation --count 60 [--only limits] [--seed 1]

Of each module it takes so many places at random, and of each place one mutant. A mutant is tried by those tests of the
list `MODULES` that run its statement, at most `PATIENCE_S` of them, until one fails. It prints the share that is found,
and every mutant that is not. It works in a copy of the working tree.

What is no fault is left out: docstrings, annotations, decorators, types, `strict=` and its like; `<` for `<=` where a
number is compared with a tolerance, since that is one double; and what `equivalent_mutants.txt` lists with a reason. An
operator becomes one of its kind only (`+` becomes `-`, not `<<`): what only raises a TypeError is found by any test.
"""

from __future__ import annotations

import argparse
import ast
import gc
import json
import os
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import CodeType, FrameType, FunctionType
from typing import Any

import pytest

from ncfix.core import interpreted

ROOT = Path(__file__).parents[2]
EQUIVALENT = Path(__file__).parent / "equivalent_mutants.txt"
WRITER = (
    *("program/test_written_again.py", "program/test_emit.py", "program/test_number_style.py"),
    *("program/test_writer.py", "program/test_frames.py", "program/test_pinning.py", "program/test_turns.py"),
    *("program/siemens/test_writing.py", "program/klartext/test_writing.py", "program/test_line_length.py"),
    *("program/test_pointing.py", "compensate/test_arcs.py", "compensate/test_rounding.py"),
    *("compensate/test_block_delete.py", "compensate/test_solve.py", "compensate/test_approaches.py"),
    *("compensate/test_cycles_full.py", "compensate/test_idle.py"),
)
BULK = (
    *("program/test_bulk.py", "program/klartext/test_bulk.py", "compensate/test_plain.py", "compensate/test_idle.py"),
    *("compensate/test_wordless.py", "program/test_written_again.py", "program/test_bulk_anywhere.py"),
    "compensate/test_stream_others.py",
)
STATE = (
    *("program/test_trace_motion.py", "program/test_trace_knowledge.py", "program/test_trace_offsets.py"),
    *("program/test_trace_cycles.py", "program/test_trace_errors.py", "program/test_trace_arcs.py"),
    *("program/test_frames.py", "program/test_pointing.py", "program/siemens/test_following.py"),
    *("program/test_contour.py", "program/test_fanuc.py", "compensate/test_following.py"),
    *("compensate/test_block_delete.py", "classes/test_planes_by_steps.py", "program/klartext/test_following.py"),
)
MODULES: dict[str, tuple[str, ...]] = {
    "src/ncfix/writer/block.py": WRITER,
    "src/ncfix/writer/block_text.py": WRITER,
    "src/ncfix/writer/emit.py": WRITER,
    "src/ncfix/writer/target.py": WRITER,
    "src/ncfix/writer/pieces.py": WRITER,
    "src/ncfix/writer/bulk.py": BULK,
    "src/ncfix/writer/bulk_layouts.py": BULK,
    "src/ncfix/compensate/account.py": (
        *("compensate/test_account.py", "cli/test_no_figure.py", "compensate/test_wordless.py"),
        *("compensate/test_account_left.py",),
    ),
    "src/ncfix/compensate/plan/limits.py": ("compensate/test_limits.py", "compensate/test_long_motions.py"),
    "src/ncfix/control/state.py": STATE,
    "src/ncfix/control/moves.py": (
        *("compensate/test_moves.py", "compensate/test_account.py", "program/test_pinning.py"),
        *("program/test_emit.py", "program/test_trace_motion.py", "program/siemens/test_following.py"),
    ),
    "src/ncfix/control/interpreter.py": (
        *STATE,
        *("program/test_trace_flow.py", "program/test_recurrence.py", "program/test_trace_lane.py"),
        *("program/test_trace_errors.py", "program/test_lanes.py", "compensate/test_stream.py"),
    ),
    "src/ncfix/text/numbers.py": (
        *("program/test_numbers.py", "program/test_reader.py", "program/test_shapes.py", "program/test_bulk.py"),
    ),
    "src/ncfix/text/spelling.py": ("program/test_number_style.py", "program/test_bulk.py", "program/test_numbers.py"),
    "src/ncfix/core/words.py": ("core/test_words.py", "core/test_forms.py", "program/test_bulk.py"),
    "src/ncfix/core/motions.py": ("core/test_forms.py", "program/test_trace_lane.py", "compensate/test_plain.py"),
}
"""Module -> the tests that are about it."""
PLAIN = ("src/ncfix/core/",)
"""These are tried in their interpreted form."""
PATIENCE_S = 12.0
SURVIVED, UNSEEN = "survived", "no test runs it"
KINDS = (
    *("BinaryOperator_Add_Sub", "BinaryOperator_Sub_Add", "BinaryOperator_Mul_Div", "BinaryOperator_Div_Mul"),
    *("BinaryOperator_FloorDiv_Mul", "BinaryOperator_Mod_FloorDiv", "BinaryOperator_Pow_Mul"),
    *("BinaryOperator_RShift_LShift", "BinaryOperator_LShift_RShift"),
    *("BinaryOperator_BitOr_BitAnd", "BinaryOperator_BitAnd_BitOr", "BinaryOperator_BitXor_BitAnd"),
    *("ComparisonOperator_Eq_NotEq", "ComparisonOperator_NotEq_Eq"),
    *("ComparisonOperator_Is_IsNot", "ComparisonOperator_IsNot_Is"),
    *("ComparisonOperator_Lt_GtE", "ComparisonOperator_LtE_Gt"),
    *("ComparisonOperator_Gt_LtE", "ComparisonOperator_GtE_Lt"),
    *("UnaryOperator_Delete_USub", "UnaryOperator_Delete_Invert", "UnaryOperator_Delete_Not"),
)
BY_ONE = tuple(f"ComparisonOperator_{each}" for each in ("Lt_LtE", "LtE_Lt", "Gt_GtE", "GtE_Gt"))
OPERATORS = (
    *(f"core/Replace{each}" for each in (*KINDS, *BY_ONE)),
    *("core/AddNot", "core/ReplaceTrueWithFalse", "core/ReplaceFalseWithTrue", "core/ReplaceAndWithOr"),
    *("core/ReplaceOrWithAnd", "core/ReplaceBreakWithContinue", "core/ReplaceContinueWithBreak"),
    *("core/ExceptionReplacer", "core/NumberReplacer", "core/ZeroIterationForLoop"),
)
MEASURED = re.compile(r"half|fuzz|tolerance|rounded|largest|jump|together|[A-Z][A-Z_]{3,}|\d\.\d|\de-?\d")
"""What compares measured numbers: `<` for `<=` is another answer for one double only."""
KEYWORD_ONLY = re.compile(r"[(,] ?/,")
"""A star between parameters is no product."""
KEYWORDS = ("strict", "slots", "frozen", "kw_only", "maxsize", "eq", "repr", "stacklevel")
"""Arguments that decide nothing about a program."""


@dataclass(frozen=True, slots=True)
class Mutant:
    """A module with one fault. `lines`: those of its statement; `was`, `line`: what differs, before and now."""

    path: Path
    at: tuple[int, int]
    lines: range
    text: str
    was: str
    line: str


# -- making mutants ----------------------------------------------------------------------------------------------------


def left_out(tree: ast.Module) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Where nothing is changed, from and to (line, column)."""
    found: list[Any] = []
    for node in ast.walk(tree):
        found += [getattr(node, name, None) for name in ("annotation", "returns")]
        found += getattr(node, "decorator_list", [])
        if isinstance(node, ast.keyword) and node.arg in KEYWORDS:
            found.append(node)
        if isinstance(node, ast.Import | ast.ImportFrom):
            found.append(node)
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            found.append(node)
    return [((each.lineno, each.col_offset), (each.end_lineno, each.end_col_offset)) for each in found if each]


def statements(tree: ast.Module) -> list[tuple[tuple[int, int], tuple[int, int], range]]:
    """All statements, from and to, inner ones behind outer ones, with the lines of them (of their heads)."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.stmt):
            body = getattr(node, "body", None)
            last = max(node.lineno, body[0].lineno - 1) if body else node.end_lineno or node.lineno
            end = (node.end_lineno or 0, node.end_col_offset or 0)
            found.append(((node.lineno, node.col_offset), end, range(node.lineno, last + 1)))
    return sorted(found, key=lambda each: each[0])


class Source:
    """The text of a module, and `places`, (line, column) -> the ways to change it there."""

    def __init__(self, path: Path, module: str) -> None:
        from cosmic_ray.ast import ast_nodes, get_ast
        from cosmic_ray.plugins import get_operator

        self.path, self.text = path, path.read_text()
        tree = ast.parse(self.text)
        self.statements, self.same = statements(tree), equivalent(module)
        self.places: dict[tuple[int, int], list[tuple[Any, int]]] = {}
        idle, measured = left_out(tree), left_out_by_one(tree)
        nodes = list(ast_nodes(get_ast(self.text)))
        for name in OPERATORS:
            operator = get_operator(name)()
            places = [place for node in nodes for place in operator.mutation_positions(node)]
            for occurrence, (begin, _) in enumerate(places):
                out = idle + measured if name.endswith(BY_ONE) else idle
                if not any(first <= begin < last for first, last in out):
                    self.places.setdefault(tuple(begin), []).append((operator, occurrence))

    def mutant(self, at: tuple[int, int], way: tuple[Any, int]) -> Mutant | None:
        """A mutant; None if it is listed as none."""
        from cosmic_ray.mutating import mutate_code

        text = mutate_code(self.text, *way)
        changed = zip(self.text.splitlines(), (text or self.text).splitlines(), strict=False)
        was, line = next(((a.strip(), b.strip()) for a, b in changed if a != b), ("", ""))
        if text is None or was == line or (was, line) in self.same or KEYWORD_ONLY.search(line):
            return None
        with suppress(SyntaxError):
            compile(text, "mutant", "exec")
            return Mutant(self.path, at, self.lines_of(at), text, was, line)
        return None

    def lines_of(self, at: tuple[int, int]) -> range:
        """The lines of the innermost statement at a place."""
        own = [lines for first, last, lines in self.statements if first <= at <= last]
        return own[-1] if own else range(at[0], at[0] + 1)

    def chosen(self, count: int, rng: random.Random) -> list[Mutant]:
        """So many mutants at random, each at a place of its own; fewer if there are no more places."""
        found: list[Mutant] = []
        for at in rng.sample(sorted(self.places), len(self.places)):
            ways = rng.sample(self.places[at], len(self.places[at]))
            found += filter(None, [next(filter(None, (self.mutant(at, way) for way in ways)), None)])
            if len(found) == count:
                break
        return sorted(found, key=lambda each: each.at)


def left_out_by_one(tree: ast.Module) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Where numbers are compared that were measured or worked out."""
    nodes = [each for each in ast.walk(tree) if isinstance(each, ast.Compare) and MEASURED.search(ast.unparse(each))]
    return [((n.lineno, n.col_offset), (n.end_lineno or 0, n.end_col_offset or 0)) for n in nodes]


def equivalent(module: str) -> set[tuple[str, str]]:
    """What is listed of a module: lines before and after."""
    found, own = set(), False
    rows = [row for row in EQUIVALENT.read_text().splitlines() if row.strip() and not row.startswith("#")]
    for row in rows:
        if not row.startswith(" "):
            own = row.split(":")[0] == module
        elif own and " => " in row:
            was, line = row.strip().split(" => ")
            found.add((was, line))
    return found


# -- trying them -------------------------------------------------------------------------------------------------------


def inner_code(code: CodeType) -> Iterator[CodeType]:
    """The code of functions of a module and of its classes, not of functions within these."""
    for each in code.co_consts:
        if isinstance(each, CodeType):
            is_class = not each.co_flags & 0x2  # no fast locals: the body of a class
            yield from inner_code(each) if is_class else (each,)


def plain_body(code: CodeType) -> object:
    """What of a module or class is not in its functions, to be compared."""
    return [
        code.co_code,
        code.co_names,
        [
            plain_body(each) if not each.co_flags & 0x2 else None if isinstance(each, CodeType) else each
            for each in code.co_consts
            if isinstance(each, CodeType)
        ],
        [repr(each) for each in code.co_consts if not isinstance(each, CodeType)],
    ]


def replacements(path: Path, text: str) -> dict[CodeType, CodeType] | None:
    """The functions that a mutant changes, with what they become; None if it changes more than functions."""
    old, new = compile(path.read_text(), str(path), "exec"), compile(text, str(path), "exec")
    if plain_body(old) != plain_body(new):
        return None
    pairs = list(zip(inner_code(old), inner_code(new), strict=True))
    changed = {before: after for before, after in pairs if before != after}
    called = {
        node.func.id
        for top in ast.parse(text).body
        if not isinstance(top, ast.FunctionDef)
        for node in outside_functions(top)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    }
    at_import = any(each.co_name in called or each.co_name.startswith("<") for each in changed)
    return None if at_import else changed


def outside_functions(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes of a statement of a module, but those in functions: what is executed when it is imported."""
    yield node
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.FunctionDef | ast.Lambda):
            yield from outside_functions(child)


class Trials:
    """A plugin of pytest that tries mutants in forked processes in place of running tests.

    found  each mutant with the test that finds it, "stopped", or why it is not found
    """

    def __init__(self, paths: Sequence[Path], tried: Sequence[Mutant]) -> None:
        self.paths, self.tried = paths, tried
        self.kills: Counter[str] = Counter()
        self.found: list[tuple[Mutant, str]] = []

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """In place of the tests."""
        seconds, run = self.look_round(session.items)
        slow = sorted(seconds, key=lambda name: -seconds[name])[:5]
        print(
            f"{len(seconds)} tests, {sum(seconds.values()):.0f} s:", *(f"{seconds[name]:.1f} {name}" for name in slow)
        )
        items = {item.nodeid: item for item in session.items}
        for mutant in self.tried:
            ran = run[str(mutant.path)]
            names = [name for name, lines in ran.items() if lines & set(mutant.lines)]
            changed = replacements(mutant.path, mutant.text)
            if changed is None and not names:
                names = list(seconds)
            names = self.in_turn(names, seconds)
            usable = [name for k, name in enumerate(names) if sum(seconds[each] for each in names[:k]) < PATIENCE_S]
            limit = 5 * sum(seconds[name] for name in usable) + 10
            if not usable:
                outcome = UNSEEN
            elif changed is None:
                outcome = self.try_anew(mutant, usable, limit)
            else:
                outcome = self.try_here(changed, [items[name] for name in usable], limit)
            self.kills[outcome] += 1
            self.found.append((mutant, outcome))
            if outcome in (SURVIVED, UNSEEN):
                place = f"{mutant.path.stem} {mutant.at[0]}"
                print(f"{place}: {mutant.was}\n  => {mutant.line}   [{outcome}, {len(usable)} tests]", flush=True)
        return True

    def in_turn(self, names: Sequence[str], seconds: Mapping[str, float]) -> list[str]:
        """Tests in the order in which they are tried: those that have found most, quick ones, all files in turn."""
        turns = Counter[str]()
        order: list[tuple[float, float, str]] = []
        for name in sorted(names, key=lambda name: seconds[name]):
            file = name.split("::")[0]
            turns[file] += 1
            order.append((-self.kills[name] / (seconds[name] + 0.1), turns[file] * max(seconds[name], 0.01), name))
        return [each[-1] for each in sorted(order)]

    def look_round(self, items: Sequence[pytest.Item]) -> tuple[dict[str, float], dict[str, dict[str, set[int]]]]:
        """How long each test takes that does not fail, and which lines of each module it runs."""
        seen: dict[str, set[int]] = {str(path): set() for path in self.paths}

        def local(frame: FrameType, event: str, _: object) -> Any:
            seen[frame.f_code.co_filename].add(frame.f_lineno)
            return local

        def trace(frame: FrameType, event: str, _: object) -> Any:
            return local(frame, event, _) if frame.f_code.co_filename in seen else None

        def look() -> str:
            seconds, run = {}, {path: dict[str, list[int]]() for path in seen}
            for item, behind in zip(items, [*items[1:], None], strict=True):
                for lines in seen.values():
                    lines.clear()
                begun = time.process_time()
                sys.settrace(trace)
                passed = passes(item, behind)
                sys.settrace(None)
                if passed:
                    seconds[item.nodeid] = time.process_time() - begun
                    for path, lines in seen.items():
                        run[path][item.nodeid] = sorted(lines)
            return json.dumps((seconds, run))

        seconds, run = json.loads(in_child(look, 3600)[0])
        return seconds, {path: {name: set(lines) for name, lines in own.items()} for path, own in run.items()}

    def try_here(self, changed: dict[CodeType, CodeType], items: Sequence[pytest.Item], limit: float) -> str:
        """Try a mutant of functions; the test that finds it, "stopped", or "survived"."""

        def run() -> str:
            gc.unfreeze()  # tests freeze what they import
            functions = [f for f in gc.get_objects() if type(f) is FunctionType and f.__code__ in changed]
            if not functions:
                return UNSEEN
            for each in functions:
                each.__code__ = changed[each.__code__]
            for item, behind in zip(items, [*items[1:], None], strict=True):
                if not passes(item, behind):
                    return item.nodeid
            return SURVIVED

        text, status = in_child(run, limit)
        return text or ("stopped" if status else SURVIVED)

    def try_anew(self, mutant: Mutant, names: Sequence[str], limit: float) -> str:
        """Try a mutant of what is executed when the module is imported."""
        before = mutant.path.read_text()
        mutant.path.write_text(mutant.text)
        for each in mutant.path.parent.glob(f"__pycache__/{mutant.path.stem}.*"):
            each.unlink()
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *names]
        try:
            done = subprocess.run(command, capture_output=True, timeout=10 * limit, check=False, cwd=ROOT)
        except subprocess.TimeoutExpired:
            return "stopped"
        finally:
            mutant.path.write_text(before)
        return "stopped" if done.returncode else SURVIVED


def passes(item: pytest.Item, behind: pytest.Item | None) -> bool:
    """Run a test."""
    from _pytest.runner import runtestprotocol

    return not any(report.failed for report in runtestprotocol(item, log=False, nextitem=behind))


def in_child(work: Any, limit: float) -> tuple[str, int]:
    """What a function returns in a process of its own, empty if that ends before; and how it has ended."""
    sys.stdout.flush()
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        status = 1
        try:
            os.close(reading)
            resource.setrlimit(resource.RLIMIT_CPU, (int(limit) + 1, int(limit) + 2))
            silent = os.open(os.devnull, os.O_WRONLY)
            os.dup2(silent, 1), os.dup2(silent, 2)
            text = work().encode()
            while text:
                text = text[os.write(writing, text) :]
            status = 0
        finally:
            os._exit(status)
    os.close(writing)
    with os.fdopen(reading) as stream:
        text = stream.read()
    return text, os.waitpid(child, 0)[1]


# -- the whole ---------------------------------------------------------------------------------------------------------


def copied(folder: Path) -> None:
    """A copy of the working tree with the compiled core."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "-co", "--exclude-standard"], cwd=ROOT, check=True, capture_output=True
    )
    core = ROOT / "src/ncfix/core"
    built = [path.relative_to(ROOT) for name in ("*.so", "*.pyd", "compiled.txt") for path in core.glob(name)]
    for name in (*filter(None, listed.stdout.decode().split("\0")), *map(str, built)):
        with suppress(FileNotFoundError):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)


def tried_in_copy(modules: Sequence[str], count: int, seed: int) -> None:
    """Try mutants of modules that the same tests are about, in a copy; what is found is printed."""
    with tempfile.TemporaryDirectory(prefix="ncfix-mutation-") as place:
        folder = Path(place) / "ncfix"
        copied(folder)
        paths = os.pathsep.join(str(folder / each) for each in ("src", "plugins", "tests"))
        environment = {**os.environ, "PYTHONPATH": paths, "PYTEST_DEBUG_TEMPROOT": place}
        environment |= {"NCFIX_SHARED": "", "NCFIX_MUTANT": "1"}
        environment |= {"NCFIX_CORE": "plain"} if modules[0].startswith(PLAIN) else {}
        command = [sys.executable, "-m", "robustness.mutation", "--here", *modules, "--count", str(count)]
        subprocess.run([*command, "--seed", str(seed)], cwd=folder, env=environment, check=True)


def dotted(path: Path) -> str:
    """The name of a module."""
    return ".".join(path.relative_to(ROOT / "src").with_suffix("").parts)


def tried_here(modules: Sequence[str], count: int, seed: int) -> None:
    """Try mutants of modules in this process, whose folder is a copy."""
    sources = {module: Source(ROOT / module, module) for module in modules}
    tried = [mutant for source in sources.values() for mutant in source.chosen(count, random.Random(seed))]
    trials = Trials([source.path for source in sources.values()], tried)
    tests = [f"tests/{each}" for each in MODULES[modules[0]]]
    for source in sources.values():
        is_core = source.path.parent.name == "core"  # it is there before this process is forked
        _ = interpreted(source.path.stem) if is_core else import_module(dotted(source.path))
    pytest.main(["-q", "-p", "no:cacheprovider", "-p", "no:xdist", *tests], plugins=[trials])
    for module, source in sources.items():
        outcomes = [outcome for mutant, outcome in trials.found if mutant.path == source.path]
        good, all_of_them = sum(each not in (SURVIVED, UNSEEN) for each in outcomes), len(outcomes)
        share = f"{good} of {all_of_them} mutants found: {100 * good / max(all_of_them, 1):.0f} %"
        print(f"{module}: {share} (of {len(source.places)} places, seed {seed})", flush=True)


def main() -> None:
    """Try mutants, and say what became of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=60, help="mutants of each module")
    parser.add_argument("--only", default="", help="modules whose path this regular expression finds")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--here", nargs="*", default=[], help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.here:
        tried_here(given.here, given.count, given.seed)
        return
    modules = [module for module in MODULES if re.search(given.only, module)]
    for tests in dict.fromkeys(MODULES[module] for module in modules):
        tried_in_copy([module for module in modules if MODULES[module] == tests], given.count, given.seed)


if __name__ == "__main__":
    main()
