"""LinuxCNC's interpreter as a judge: a program in, its canonical calls out, motions in full precision.

Two programs of the Debian package `linuxcnc-uspace` are run in a private directory. `rs274` prints every canonical call
in order, motions with four decimals; the `gcode` extension (through `canon_child.py`) gives motions in full double
precision with their source lines, but is silent about the spindle, coolant and feed modes. Their motions are compared,
and joined. Where the extension fails the printed numbers are used, and `Canon.exact` says so.
"""

from __future__ import annotations

import atexit
import json
import os
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from differential import canon_text
from differential.canon_text import Call, Floats

SYSTEM_PYTHON = "/usr/bin/python3"
CHILD = Path(__file__).with_name("canon_child.py")
WIDTH = 36
MM = 25.4
RAPID, FEED, ARC, PROBE, TAP, SPLINE = range(6)
OFFSETS = ("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3")
OFFSET_PARAMETERS = {name: 5221 + 20 * n for n, name in enumerate(OFFSETS)}
REFERENCE_PARAMETERS = {"G28": 5161, "G30": 5181}
OUTPUT_LIMIT = 400_000_000  # bytes: an endless loop in a program must not fill the disk


@dataclass(frozen=True, slots=True)
class Controls:
    """What is on the machine: positions in machine axes XYZABC, mm and degrees; tools (length, diameter) in mm."""

    offsets: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    references: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    tools: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    variables: Mapping[int, float] = field(default_factory=dict)
    initial: tuple[float, ...] = (0.0,) * 6
    block_skip: bool = False


@dataclass(frozen=True, slots=True)
class Canon:
    """A program as the control runs it; n motions in order, machine axes XYZABCUVW in mm and degrees.

    accepted  the interpreter took the whole program; `error` is what it said
    line      (n,) line in the source, from 1; 0 where only the printed text is known
    kind      (n,) `RAPID FEED ARC PROBE TAP SPLINE`
    mode      (n,) motion mode in tenths as the control counts it (G81: 810)
    side      (n,) 400 410 420: cutter radius compensation
    rotation  (n,) rotation of program coordinates about Z, rad
    tool      (n,) number of the tool in the spindle
    offset_z  (n,) tool length offset in force, mm
    start, end  (n, 9)
    centre, normal, turns  (n, 3) (n, 3) (n,) of arcs; turns positive: counterclockwise about the normal
    calls     all other canonical calls, each with the number of motions before it
    exact     (n,) in full double precision (else four decimals of the program's unit)
    """

    accepted: bool
    error: str
    exact: NDArray[np.bool_]
    line: NDArray[np.int64]
    kind: NDArray[np.int64]
    mode: NDArray[np.int64]
    side: NDArray[np.int64]
    rotation: Floats
    tool: NDArray[np.int64]
    offset_z: Floats
    start: Floats
    end: Floats
    centre: Floats
    normal: Floats
    turns: NDArray[np.int64]
    calls: tuple[Call, ...]

    def __len__(self) -> int:
        return len(self.line)


def available() -> bool:
    """Both halves of the judge are installed."""
    found = shutil.which("rs274") is not None and Path(SYSTEM_PYTHON).exists()
    probe = [SYSTEM_PYTHON, "-c", "import gcode"]
    return found and subprocess.run(probe, capture_output=True, check=False).returncode == 0


def interpret(
    program: Path | bytes, controls: Controls | None = None, folder: Path | None = None, timeout: float = 120.0
) -> Canon:
    """Run a program (a file, or its bytes with the folder in which its subprograms lie) on the control."""
    controls = controls or Controls()
    folder = folder or (program.parent if isinstance(program, Path) else None)
    with tempfile.TemporaryDirectory(prefix="canon-") as name:
        home = Path(name)
        source = home / "program.ngc"
        content = program if isinstance(program, bytes) else program.read_bytes()
        source.write_bytes(content)
        text, error = _run_rs274(home, source, controls, folder, timeout)
        rows = _run_extension(home, source, controls, folder, timeout)
    printed = canon_text.parse(text)
    rows = None if rows is None else canon_text.splines_joined(printed, rows)
    rows, exact = canon_text.joined(printed, rows)
    rows[rows[:, 0] > 0, 0] += _lines_before_tape(content)
    return _canon(rows, printed.calls, controls, error, exact)


def _canon(rows: Floats, calls: tuple[Call, ...], controls: Controls, error: str, exact: NDArray[np.bool_]) -> Canon:
    integer = rows[:, [0, 1, 2, 3, 6, 31]].astype(np.int64)
    end = rows[:, 16:25]
    first = np.array([[*controls.initial, 0.0, 0.0, 0.0]])
    return Canon(
        accepted=not error,
        error=error,
        exact=exact,
        line=integer[:, 0],
        kind=integer[:, 1],
        mode=integer[:, 2],
        side=integer[:, 3],
        rotation=np.radians(rows[:, 4]),
        tool=integer[:, 4],
        offset_z=rows[:, 34],
        start=np.concatenate([first, end[:-1]])[: len(end)],
        end=end,
        centre=rows[:, 25:28],
        normal=rows[:, 28:31],
        turns=integer[:, 5],
        calls=calls,
    )


def _lines_before_tape(content: bytes) -> int:
    """The interpreter counts lines from the `%` that starts a tape."""
    head = content[: len(content) - len(content.lstrip())]
    return head.count(b"\n") if content.lstrip().startswith(b"%") else 0


# -- running ----------------------------------------------------------------------------------------------------------


def _run_rs274(home: Path, source: Path, controls: Controls, folder: Path | None, timeout: float) -> tuple[str, str]:
    """Text of the canonical calls, and the error ('' if accepted). It reads its own files as inches."""
    table, parameters, output = home / "tool.tbl", home / "rs274.var", home / "canon.txt"
    table.write_text(_tool_table(controls, MM))
    parameters.write_text(_parameters(controls, MM))
    ini = _write_ini(home, table, parameters, folder)
    command = ["rs274", "-g", "-n", "2", "-i", ini, "-t", table, "-v", parameters]
    command += ["-b"] if controls.block_skip else []
    done = _run([*command, source, output], home, timeout)
    text = output.read_text("latin-1") if output.exists() else ""
    return text, "" if done.returncode == 0 else done.stderr.strip() or f"exit code {done.returncode}"


def _run_extension(home: Path, source: Path, controls: Controls, folder: Path | None, timeout: float) -> Floats | None:
    """One row per motion in full precision (`canon_child.py`), None where the extension crashes."""
    parameters, rows = home / "gcode.var", home / "rows.bin"
    parameters.write_text(_parameters(controls, 1.0))
    tools = [[number, 0.0, length, diameter] for number, (length, diameter) in _tools(controls).items()]
    ini = _write_ini(home, home / "tool.tbl", parameters, folder)
    files = {"home": home, "ini": ini, "program": source, "rows": rows, "parameter_file": parameters}
    wanted = {name: str(path) for name, path in files.items()}
    limits = {"timeout": timeout, "output_limit": OUTPUT_LIMIT}
    request = {**wanted, "tools": tools, "block_delete": controls.block_skip, "initial": controls.initial, **limits}
    code = _extension()(json.dumps(request))
    if code == -signal.SIGALRM:
        raise subprocess.TimeoutExpired(str(CHILD), timeout)
    return np.fromfile(rows).reshape(-1, WIDTH) if code in (0, 1) and rows.exists() else None


@cache
def _extension() -> Callable[[str], int]:
    """Sends a request to `canon_child.py`, which serves as long as this process lasts; its answer."""
    command = [SYSTEM_PYTHON, str(CHILD)]
    environment = {"PATH": os.environ.get("PATH", "/usr/bin:/bin"), "LC_ALL": "C"}
    pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    process = subprocess.Popen(command, text=True, bufsize=1, cwd="/", env=environment, **pipes)
    atexit.register(process.communicate)

    def ask(request: str) -> int:
        process.stdin.write(request + "\n")
        return int(process.stdout.readline())

    return ask


def _run(command: list[object], home: Path, timeout: float) -> subprocess.CompletedProcess[str]:
    """Through a shell that sets the limit: were it set by a function, this whole process would be copied."""
    environment = {"HOME": str(home), "PATH": os.environ.get("PATH", "/usr/bin:/bin"), "LC_ALL": "C"}
    limited = ["sh", "-c", f'ulimit -f {OUTPUT_LIMIT // 512}; exec "$@"', "sh"]
    return subprocess.run(
        [*limited, *(str(part) for part in command)],
        cwd=home,
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="latin-1",
        timeout=timeout,
        check=False,
    )


# -- the control's own files ------------------------------------------------------------------------------------------


def _tools(controls: Controls) -> dict[int, tuple[float, float]]:
    """The tool table: tools that are not given have no length and 10 mm diameter."""
    return {number: controls.tools.get(number, (0.0, 10.0)) for number in sorted({*range(1, 100), *controls.tools})}


def _tool_table(controls: Controls, scale: float) -> str:
    tools = _tools(controls).items()
    return "".join(f"T{n} P{n} Z{length / scale!r} D{diameter / scale!r} ;\n" for n, (length, diameter) in tools)


def _parameters(controls: Controls, scale: float) -> str:
    """The parameter file: references, G92 off, work offsets, the user's variables; sorted, as the control wants it."""
    values = dict.fromkeys([*range(5161, 5167), *range(5181, 5187), *range(5210, 5217)], 0.0) | {5220: 1.0}
    blocks = {REFERENCE_PARAMETERS[name]: given for name, given in controls.references.items()}
    blocks |= {first: controls.offsets.get(name, ()) for name, first in OFFSET_PARAMETERS.items()}
    for first, given in blocks.items():
        padded = [*given, *[0.0] * (6 - len(given))]
        values |= {first + n: value / (scale if n < 3 else 1.0) for n, value in enumerate(padded)}
    values |= {first + 9: 0.0 for first in OFFSET_PARAMETERS.values()} | dict(controls.variables)
    return "".join(f"{number}\t{value!r}\n" for number, value in sorted(values.items()))


def _write_ini(home: Path, table: Path, parameters: Path, folder: Path | None) -> Path:
    path, where = home / "judge.ini", folder or home
    path.write_text(
        f"[EMC]\nVERSION = 1.1\n[DISPLAY]\nPROGRAM_PREFIX = {where}\n[RS274NGC]\nPARAMETER_FILE = {parameters}\n"
        f"SUBROUTINE_PATH = {where}\nFEATURES = 12\n[TRAJ]\nLINEAR_UNITS = mm\nANGULAR_UNITS = degree\n"
        f"COORDINATES = X Y Z A B C\n[KINS]\nJOINTS = 6\n[EMCIO]\nTOOL_TABLE = {table}\n"
    )
    return path
