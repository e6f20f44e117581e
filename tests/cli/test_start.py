"""What a short program does not wait for: modules that its job has no use for are not imported."""

import subprocess
import sys
from pathlib import Path

import pytest

FAMILIES = {"ncfix_iso.rs274", "ncfix_fanuc.macro", "ncfix_siemens.sinumerik", "ncfix_heidenhain.klartext"}
ELSEWHERE = {
    "scipy", "rich", "sympy", "multiprocessing", "concurrent.futures", "numpy.ma", "importlib.metadata",
    "ncfix.diagnosis", "ncfix.measure", "ncfix.reports", "ncfix.machine.symbolic",
    "ncfix.control.flatten",
    "ncfix.control.setup_file", "ncfix.api.measurements", "ncfix.api.tables",
}  # fmt: skip
"""What none of the verbs below needs for a program of a page and a machine with a few errors."""
OF_OTHERS = {
    "ncfix.control.operations",  # what codes of a dialect's own do
    "ncfix.api", "ncfix.cli.shop.pages",
}  # fmt: skip
"""What `fix` of a program of LinuxCNC does not need besides."""

RUN = """
import sys
from ncfix.cli.main import run
code = run(sys.argv[1:])
print(*sorted(sys.modules), sep="\\n", file=sys.stderr)
sys.exit(code)
"""


def imported(arguments: list[str], root: Path) -> set[str]:
    """The modules that a process has at its end."""
    done = subprocess.run(
        [sys.executable, "-c", RUN, *arguments], capture_output=True, text=True, cwd=root, check=False
    )
    assert done.returncode in (0, 1), done.stderr
    return set(done.stderr.splitlines())


def families(modules: set[str]) -> set[str]:
    """The families of controls of which anything is imported."""
    return {name for name in FAMILIES if name in modules}


@pytest.mark.parametrize("verb", ["check", "trace", "verify", "fix"])
def test_a_short_program_waits_for_nothing_it_does_not_need(verb: str, root: Path, tmp_path: Path) -> None:
    program, output = tmp_path / "part.ngc", tmp_path / "out.ngc"
    program.write_text("G21 G90 G17 G94 G54\nG1 X1 Y2 Z3 B4 C5 F500\nG1 X2 Y2 Z3 B4 C6\nM2\n")
    files = [str(program), str(program)] if verb == "verify" else [str(program)]
    given = ["-m", "benchmarks/five_axis.toml", "--dialect", "linuxcnc", "--assume-zero"]
    modules = imported([verb, *files, *given, *(["-o", str(output)] if verb == "fix" else [])], root)
    assert "ncfix_iso.rs274.interpreter" in modules
    assert not modules & (ELSEWHERE | OF_OTHERS if verb == "fix" else ELSEWHERE)
    assert families(modules) == {"ncfix_iso.rs274"}


def test_fix_for_a_control_whose_tolerance_of_arcs_hangs_on_the_unit_waits_for_nothing_more(
    root: Path, tmp_path: Path
) -> None:
    program = tmp_path / "part.nc"
    program.write_text("O1\nG21 G90 G17 G94 G54\nG1 X1. Y2. Z3. F500.\nG2 X2. Y3. I1. J0.\nM30\n")
    given = ["-m", "benchmarks/five_axis.toml", "--dialect", "fanuc", "--assume-zero", "-o", str(tmp_path / "out.nc")]
    assert not imported(["fix", str(program), *given], root) & ELSEWHERE


@pytest.mark.parametrize(
    ("program", "needed"),
    [
        ("fanuc_tcp.nc", {"ncfix_fanuc.macro", "ncfix_iso.rs274"}),
        ("klartext_tcp.h", {"ncfix_heidenhain.klartext"}),
        ("siemens_traori.mpf", {"ncfix_siemens.sinumerik"}),
    ],
)
def test_a_control_does_not_wait_for_the_others(program: str, needed: set[str], root: Path) -> None:
    modules = imported(["check", f"examples/programs/{program}"], root)
    assert not modules & ELSEWHERE
    assert families(modules) == needed


@pytest.mark.parametrize("arguments", [["--version"], ["--help"], ["fix", "--help"]])
def test_help_waits_for_neither_arrays_nor_machines(arguments: list[str], root: Path) -> None:
    modules = imported(arguments, root)
    assert not modules & {"numpy", "ncfix.machine", "ncfix.compensate", "ncfix.text.reader", *ELSEWHERE}
    assert ("ncfix_iso" in modules) == (arguments == ["--help"])
