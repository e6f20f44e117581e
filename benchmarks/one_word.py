"""What one X word costs in understanding: functions that run and their modules, classes that are made, modules loaded.

The program of seven lines of docs/architecture.md is corrected for a three-axis machine, in a process of its own:

    .venv/bin/python benchmarks/one_word.py [--list]
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from inspect import CO_OPTIMIZED
from pathlib import Path
from types import FrameType
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
OURS = (str(ROOT / "src"), str(ROOT / "plugins"))
PROGRAM = "%\nG21 G90 G94\nG54\nT1 M6\nG0 X0 Y0 Z5\nN20 G1 X10 Y2.5 F500\nM30\n%\n"


def main() -> None:
    """Print the counts, and with `--list` every module with the number of its functions that ran."""
    ran: set[tuple[str, str, int]] = set()
    made: set[tuple[str, str, int]] = set()

    def watch(frame: FrameType, event: str, argument: Any) -> None:
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(OURS) and not code.co_name.startswith("<"):
            place = code.co_filename, code.co_name, code.co_firstlineno
            (ran if code.co_flags & CO_OPTIMIZED else made).add(place)

    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "program.nc")
        source.write_text(PROGRAM)
        command = ["fix", str(source), "-m", str(ROOT / "examples/machines/three_axis.toml"), "--assume-zero"]
        sys.setprofile(watch)
        try:
            from ncfix.cli.main import run

            code = run([*command, "-o", str(Path(folder, "out.nc"))])
        finally:
            sys.setprofile(None)
    loaded = [name for name, each in sys.modules.items() if str(getattr(each, "__file__", "")).startswith(OURS)]
    modules = Counter(str(Path(path).relative_to(ROOT)) for path, _, _ in ran)
    print(f"exit code {code}: {len(ran)} functions ran in {len(modules)} modules")
    print(f"{len(made)} classes were made; {len(loaded)} modules loaded")
    if "--list" in sys.argv:
        print("\n".join(f"{count:5}  {name}" for name, count in sorted(modules.items())))


if __name__ == "__main__":
    main()
