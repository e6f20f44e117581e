"""Loops as machine code: compiled once, kept, loaded without numba."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("numba", reason="the `fast` extra is not installed")

MODULE = '''
from typing import NamedTuple
import numpy as np
from ncfix.kernel import Library

LIBRARY = Library(__file__)

class Pair(NamedTuple):
    low: object
    high: object

@LIBRARY.helper
def doubled(value):
    return FACTOR * value

FACTOR = 2.0

@LIBRARY.kernel("f8[:,:]", ("i8", (Pair, "f8[:]", "f8[:]")), "b1[:]")
def within(values, given, found):
    """How many values are within limits, by columns, and which; `given`: how many columns, and the limits doubled."""
    count, (columns, limits) = 0, given
    for i in range(values.shape[0]):
        for j in range(columns):
            found[i * columns + j] = doubled(limits.low[j]) <= values[i, j] <= doubled(limits.high[j])
            count += found[i * columns + j]
    return count
'''
PROGRAM = """
import sys
import numpy as np
import module
values, found = np.array([[1.0, 2.0], [30.0, 4.0], [5.0, -6.0]]), np.zeros(6, dtype=bool)
limits = module.Pair(np.zeros(2), np.array([10.0, 2.0]))
print(module.within(values, (2, limits), found), found.astype(int).tolist(), "numba" in sys.modules)
"""


def run(folder: Path, code: str = PROGRAM) -> str:
    """What a process of its own prints that imports `module` from a folder."""
    path = os.pathsep.join((str(folder), *sys.path))
    environment = {**os.environ, "PYTHONPATH": path, "XDG_CACHE_HOME": str(folder / "cache")}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    return done.stdout.strip()


def kept(folder: Path) -> list[Path]:
    return sorted(folder.glob("__pycache__/module.*.o"))


def test_compiled_once_and_loaded_without_numba(tmp_path: Path) -> None:
    (tmp_path / "module.py").write_text(MODULE)
    assert run(tmp_path) == "4 [1, 1, 0, 1, 1, 0] True"
    assert len(kept(tmp_path)) == 1
    assert run(tmp_path) == "4 [1, 1, 0, 1, 1, 0] False"


def test_other_sources_and_damaged_code_are_compiled_anew(tmp_path: Path) -> None:
    (tmp_path / "module.py").write_text(MODULE)
    run(tmp_path)
    (tmp_path / "module.py").write_text(MODULE.replace("FACTOR = 2.0", "FACTOR = 1.5"))
    assert run(tmp_path) == "3 [1, 1, 0, 0, 1, 0] True"
    (code,) = kept(tmp_path)
    code.write_bytes(code.read_bytes()[:-100] + bytes(100))
    assert run(tmp_path) == "3 [1, 1, 0, 0, 1, 0] True"
    assert run(tmp_path) == "3 [1, 1, 0, 0, 1, 0] False"


def test_arrays_of_another_type_are_refused() -> None:
    from ncfix.compensate.kernels import fewest

    ends, worst, nodes = np.zeros(3, dtype=bool), np.zeros(1), np.linspace(0, 1, 3)
    commands, follow = np.zeros((3, 3)), np.zeros((3, 3, 3))
    counts = np.array([3])
    fewest(counts, nodes, commands, follow, 1e-3, ends, worst)
    assert ends.tolist() == [False, False, True]
    with pytest.raises(TypeError, match="int32"):
        fewest(counts.astype(np.int32), nodes, commands, follow, 1e-3, ends, worst)
    with pytest.raises(TypeError, match="instead of f8"):
        fewest(counts, nodes, commands.T, follow, 1e-3, ends, worst)


def test_the_way_in_which_arguments_are_passed_is_tried() -> None:
    from ncfix import kernel, kernel_trial

    assert kernel_trial.passes()
    assert kernel.trusted()


def test_an_environment_that_fails_the_trial_is_not_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from ncfix import kernel

    (tmp_path / "failing_trial.py").write_text("import os; os.abort()")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    assert not kernel.trusted("failing_trial")
    (tmp_path / "failing_trial.py").write_text("def passes():\n    return False\n")
    assert not kernel.trusted("failing_trial")
    (tmp_path / "failing_trial.py").write_text("def passes():\n    return True\n")
    monkeypatch.setattr(kernel, "places", lambda source, kind: iter([tmp_path / kind]))
    assert kernel.trusted("failing_trial")
    assert (tmp_path / "passed").exists()
    monkeypatch.setattr(kernel.subprocess, "run", None)
    assert kernel.trusted("failing_trial")
