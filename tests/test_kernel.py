"""Loops as machine code: compiled once, kept, loaded without numba."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ncfix import fast, kernel

pytest.importorskip("numba", reason="the `fast` extra is not installed")

MODULE = '''
from typing import NamedTuple
import numpy as np
from ncfix.kernel import Library

LIBRARY = Library(__name__)

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
from ncfix import kernel
said = []
kernel.ready([module.LIBRARY], said.append)
assert "numba" not in sys.modules
values, found = np.array([[1.0, 2.0], [30.0, 4.0], [5.0, -6.0]]), np.zeros(6, dtype=bool)
limits = module.Pair(np.zeros(2), np.array([10.0, 2.0]))
print(module.within(values, (2, limits), found), found.astype(int).tolist(), bool(said))
"""
"""What comes out, and whether something was said: that it is compiled."""


def run(folder: Path, code: str = PROGRAM) -> str:
    """What a process of its own prints that imports `module` from a folder."""
    return start(folder, code).communicate()[0].strip()


def start(folder: Path, code: str = PROGRAM) -> subprocess.Popen[str]:
    path = os.pathsep.join((str(folder), *sys.path))
    environment = {**os.environ, "PYTHONPATH": path, "XDG_CACHE_HOME": str(folder / "cache")}
    return subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=environment)


def kept(folder: Path) -> list[Path]:
    return sorted(folder.glob("__pycache__/module.*.o"))


def test_compiled_once_and_loaded_without_it(tmp_path: Path) -> None:
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
    fewest(counts, nodes, commands, follow, (1e-3, 1024), ends, worst)
    assert ends.tolist() == [False, False, True]
    with pytest.raises(TypeError, match="int32"):
        fewest(counts.astype(np.int32), nodes, commands, follow, (1e-3, 1024), ends, worst)
    with pytest.raises(TypeError, match="instead of f8"):
        fewest(counts, nodes, commands.T, follow, (1e-3, 1024), ends, worst)


def test_numbers_from_elsewhere_that_have_changed(tmp_path: Path) -> None:
    (tmp_path / "other.py").write_text("FACTOR = 2.0\n")
    (tmp_path / "module.py").write_text(MODULE.replace("FACTOR = 2.0", "from other import FACTOR"))
    assert run(tmp_path) == "4 [1, 1, 0, 1, 1, 0] True"
    (tmp_path / "other.py").write_text("FACTOR = 1.50\n")
    assert run(tmp_path) == "3 [1, 1, 0, 0, 1, 0] True"


def test_two_processes_do_not_compile_the_same(tmp_path: Path) -> None:
    (tmp_path / "module.py").write_text(MODULE)
    counting = "import module; from ncfix import kernel; build = kernel.build\n"
    counting += "kernel.build = lambda libraries: (open('built', 'a').write('x' * len(libraries)), build(libraries))\n"
    counting = counting.replace("'built'", repr(str(tmp_path / "built")))
    both = [start(tmp_path, counting + PROGRAM) for _ in range(2)]
    assert {process.communicate()[0].split(" ", 1)[0] for process in both} == {"4"}
    assert (tmp_path / "built").read_text() == "x"


def test_nothing_can_be_kept(tmp_path: Path) -> None:
    (tmp_path / "module.py").write_text(MODULE)
    (tmp_path / "cache").write_text("not a folder")
    nowhere = "from ncfix import kernel\nfrom pathlib import Path\n"
    nowhere += f"kernel.places = lambda source, kind: (Path({str(tmp_path)!r}) / 'cache' / str(n) for n in range(2))\n"
    for _ in range(2):
        assert run(tmp_path, nowhere + PROGRAM) == "4 [1, 1, 0, 1, 1, 0] True"


def test_a_user_without_a_home(tmp_path: Path) -> None:
    (tmp_path / "module.py").write_text(MODULE)
    homeless = """
import os
from pathlib import Path
def home():
    raise RuntimeError("Could not determine home directory.")
Path.home = home
del os.environ["XDG_CACHE_HOME"]
"""
    assert run(tmp_path, homeless + PROGRAM) == "4 [1, 1, 0, 1, 1, 0] True"
    assert run(tmp_path, homeless + PROGRAM) == "4 [1, 1, 0, 1, 1, 0] False"


def test_compiled_from_where_it_was_imported_and_not_from_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "module.py").write_text(MODULE)
    (tmp_path / "numba.py").write_text("open('imported', 'w').close()")
    monkeypatch.chdir(tmp_path)
    found = f"import sys\nsys.path.remove('')\nsys.path.insert(0, {str(tmp_path / 'elsewhere')!r})\n"
    path = os.pathsep.join(each for each in sys.path if each)
    monkeypatch.setenv("PYTHONPATH", path)
    done = subprocess.run([sys.executable, "-c", found + PROGRAM], capture_output=True, text=True)
    assert done.stdout.strip() == "4 [1, 1, 0, 1, 1, 0] True", done.stderr
    assert not Path("imported").exists()


@pytest.mark.parametrize("executable", [None, "", sys.executable + ".none", "/bin/true", "/bin/echo"])
def test_no_python_to_compile_with(executable: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", executable)
    with pytest.raises(kernel.CompilingError):
        kernel.build([kernel.Library("module", parts=(len,))])


def test_llvm_cannot_be_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "llvmlite.binding", None)
    with pytest.raises(kernel.CompilingError, match="llvmlite"):
        kernel.binding()


def test_a_full_disk_leaves_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(place: Path, data: bytes) -> int:
        place.open("wb").close()
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    kernel.keep(str(tmp_path / "module.py"), "o", b"code")
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_every_module_with_kernels_is_compiled_beforehand(root: Path) -> None:
    sources = root / "src"
    having = [path for path in sources.rglob("*.py") if "\nLIBRARY = Library(" in path.read_text()]
    names = {".".join(path.relative_to(sources).with_suffix("").parts) for path in having}
    assert names - {kernel.TRIAL} == set(fast.KERNELS)


def test_work_is_dealt_out_to_processors() -> None:
    libraries = [kernel.Library(str(size), parts=(len,) * size) for size in (1, 9, 4, 3)]
    assert [[each.module for each in share] for share in kernel.dealt(libraries, 2)] == [["9"], ["4", "3", "1"]]
    assert [[each.module for each in share] for share in kernel.dealt(libraries[:1], 8)] == [["1"]]


def test_the_way_in_which_arguments_are_passed_is_tried() -> None:
    from ncfix import kernel_trial

    assert kernel_trial.passes()


@pytest.mark.parametrize("trial", ["import os; os.abort()", "def passes():\n    return False\n"])
def test_an_environment_that_fails_the_trial_is_not_used(
    trial: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "failing_trial.py").write_text(trial)
    (tmp_path / "module.py").write_text(MODULE)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "module", raising=False)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join((str(tmp_path), *sys.path)))
    monkeypatch.setattr(kernel, "TRIAL", "failing_trial")
    monkeypatch.setattr(fast, "KERNELS", ("module",))
    monkeypatch.setattr(fast, "_engaged", False)
    monkeypatch.setattr(fast, "_failed", False)
    monkeypatch.delenv("NCFIX_NO_FAST", raising=False)
    said: list[str] = []
    assert not fast.engage(said.append)
    assert not fast.engage(said.append)
    assert said == [kernel.WAIT, fast.FAILED]  # not tried twice
    assert not kept(tmp_path)
    monkeypatch.setattr(fast, "_failed", False)
    monkeypatch.setattr(kernel, "TRIAL", "ncfix.kernel_trial")
    assert fast.engage()
    assert len(kept(tmp_path)) == 1
