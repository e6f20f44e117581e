"""A plugin's fault is told as the plugin's: with its name and distribution, never as a fault of ncfix or of the input.

For every hook there are plugins that raise while they are at work, that return what is of no use, and that register it.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from email.message import Message as Metadata
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from ncfix import hookspecs, plugins
from ncfix.diagnostics import ExitCode

HEAD = """
from dataclasses import dataclass, replace
from typing import ClassVar

import click
import numpy as np

from ncfix.plugin import Basis, Control, Properties, Written, family, hookimpl


class Mine(Control):
    name = "mine"
    title = "Mine"
    reaches = "L-POS"
    properties = Properties("error", "setpoint", "machine", "mm", (0, 0), "held", False, 9, 9, "one")
    steps = ("load",)
    switch_off = "unload"

    def write(self, request):
        return Written({"mine.txt": b"1"})

    def read(self, files):
        return {}["nothing"]

    def lint(self, files):
        return ()


@dataclass(frozen=True)
class Wave(Basis):
    name: ClassVar[str] = "wave"
    title: ClassVar[str] = "a wave"

    @property
    def labels(self):
        return ("a",)

    def rows(self, u, direction):
        return np.sin(u)[None]

    def slopes(self, u, direction):
        return np.cos(u)[None]

    def feature(self, span):
        return 1.0


class Bad:
    title = "bad"


"""
HOOK = "\n\n@hookimpl\ndef register_{kind}(register):\n    {line}\n"


class Case(NamedTuple):
    """A plugin, the verb that meets it, and what must be said."""

    kind: str
    body: str
    line: str
    arguments: tuple[str, ...]
    said: str
    code: str = "NCF507"


FIX = ("fix", "{program}", "-m", "{machine}", "-o", "{out}")
EXPORT = ("export", "mine", "-m", "{machine}", "-o", "{out}")
CALIBRATE = ("calibrate", "{data}", "-m", "{machine}", "-o", "{out}")
TREE = "block: word+\nword: A N\nA: /[A-Z]/\nN: /[-0-9.]+/"
ODD = 'register(replace(family("iso"), name="odd", title="Odd", grammar={0}, suffixes=(".odd",){1}))'
CASES = {
    "reader raises": Case("readers", "def read(text, path):\n    return {}[path]\n", "register(read, 'r')", CALIBRATE,
                          "failed as the reader 'r': KeyError"),
    "reader of another shape": Case("readers", "def read(text):\n    return None\n", "register(read, 'r')", CALIBRATE,
                                    "failed as the reader 'r': TypeError"),
    "reader exits": Case("readers", "def read(text, path):\n    raise SystemExit\n", "register(read, 'r')", CALIBRATE,
                         "failed as the reader 'r': SystemExit"),
    "reader returns text": Case("readers", "def read(text, path):\n    return text\n", "register(read, 'r')", CALIBRATE,
                                "returned str as the reader 'r', not Measurement or None", "NCF508"),
    "reader is none": Case("readers", "", "register(5, 'r')", CALIBRATE, "it cannot be called", "NCF508"),
    "no grammar": Case("dialects", "", ODD.format("'none.lark'", ""), (*FIX, "--dialect", "odd"),
                       "failed as the dialect 'odd': FileNotFoundError"),
    "a grammar that is none": Case("dialects", "", ODD.format("__file__", ""), (*FIX, "--dialect", "odd"),
                                   "failed as the dialect 'odd': ValueError: third_party_broken.py: "),
    "a grammar with another tree": Case(
        "dialects", f"import pathlib\n\npathlib.Path(__file__ + '.lark').write_text({TREE!r})\n",
        ODD.format("__file__ + '.lark'", ""), (*FIX, "--dialect", "odd"),
        "failed as the dialect 'odd': ValueError: third_party_broken.py.lark: the grammar has to make a tree of words"),
    "no language": Case("dialects", "", ODD.format("'iso.lark'", ", language='no.such:THING'"),
                        (*FIX, "--dialect", "odd"), "failed as the dialect 'odd': ModuleNotFoundError"),
    "another language": Case("dialects", "", ODD.format("'iso.lark'", ", language='os:sep'"),
                             (*FIX, "--dialect", "odd"), "returned str as the dialect 'odd', not Language", "NCF508"),
    "semantics that no language has": Case("dialects", "", ODD.format("'iso.lark'", ", semantics='linuxcncc'"),
                                           (*FIX, "--dialect", "odd"), "semantics 'linuxcncc', which", "NCF508"),
    "semantics of another language": Case(
        "dialects", "", ODD.format("'iso.lark'", ", semantics='haas'"), (*FIX, "--dialect", "odd"),
        "the dialect 'odd' has the semantics 'haas'", "NCF508"),
    "a signature that is none": Case("dialects", "", ODD.format("'iso.lark'", ", signature=(b'(',)"), FIX,
                                     "failed as the dialect 'odd': "),
    "no dialect": Case("dialects", "", "register(5, 'odd')", FIX, "it has no grammar", "NCF508"),
    "codes raise": Case("codes", "", "register(lambda: {}['x'], 'odd')", ("explain",),
                        "failed as the code 'odd': KeyError"),
    "codes are none": Case("codes", "", "register(lambda: 'x', 'odd')", ("explain",),
                           "returned str as the code 'odd', not Mapping", "NCF508"),
    "basis raises": Case("bases", "def rows(self, u, d):\n    return 1 / 0\nWave.rows = rows\n", "register(Wave)",
                         ("machine", "show", "{wavy}"), "failed as the basis 'wave': ZeroDivisionError"),
    "basis of another shape": Case("bases", "def rows(self, u, d):\n    return u\nWave.rows = rows\n", "register(Wave)",
                                   ("machine", "show", "{wavy}"), "rows gives shape (3,)"),
    "no basis": Case("bases", "", "register(Wave(), 'wave')", ("machine", "show", "{wavy}"), "it is not a class",
                     "NCF508"),
    "a basis that lacks something": Case("bases", "del Wave.title\n", "register(Wave)", ("effects", "--bases"),
                                         "'wave' of plugin 'third' of somebodys-tools left out of the bases: "
                                         "it has no title", "NCF508"),
    "a basis that is abstract": Case("bases", "class Half(Basis):\n    name = title = 'half'\n", "register(Half)",
                                     ("effects", "--bases"), "it has no labels, rows, slopes, feature", "NCF508"),
    "a basis with a key that is not declared": Case(
        "bases", "@dataclass(frozen=True)\nclass Long(Wave):\n    length: float = 1.0\n", "register(Long)",
        ("effects", "--bases"), "its fields are not declared with `key`: length", "NCF508"),
    "effect raises": Case("effects", "Bad.effects = lambda self, machine: machine.nothing\n", "register(Bad(), 'bad')",
                          ("effects", "-m", "{machine}"), "failed as the effect 'bad': AttributeError"),
    "effect returns text": Case("effects", "Bad.effects = lambda self, machine: ['EXX']\n", "register(Bad(), 'bad')",
                                ("effects", "-m", "{machine}"), "returned str as the effect 'bad', not Effect",
                                "NCF508"),
    "no effect": Case("effects", "", "register(Bad(), 'bad')", ("effects", "-m", "{machine}"),
                      "it has no effects and no candidates", "NCF508"),
    "control raises": Case("controls", "", "register(Mine, 'mine')", EXPORT, "failed as the control 'mine': KeyError"),
    "control is not made": Case("controls", "def make():\n    return [][0]\n", "register(make, 'mine')", EXPORT,
                                "failed as the control 'mine': IndexError"),
    "control writes nothing": Case("controls", "Mine.write = lambda self, request: None\n", "register(Mine, 'mine')",
                                   EXPORT, "returned NoneType as the control 'mine', not Written", "NCF508"),
    "control reads text": Case("controls", "Mine.read = lambda self, files: 'tables'\n", "register(Mine, 'mine')",
                               EXPORT, "returned str as the control 'mine', not Tables", "NCF508"),
    "control reads another axis": Case(
        "controls",
        "def read(self, files):\n    from ncfix.plugin import Compensation, own_terms\n    flat = np.zeros(2)\n"
        "    return Compensation(own_terms('#X', np.arange(2.0), flat, flat))\n\n\nMine.read = read\n",
        "register(Mine, 'mine')", EXPORT, "mine reads its own files as tables for axes that the machine does not have",
        "NCF508"),
    "control lacks something": Case("controls", "del Mine.properties, Mine.steps\n", "register(Mine, 'mine')", EXPORT,
                                    "the control 'mine' has no properties, steps", "NCF508"),
    "control is none": Case("controls", "", "register(dict, 'mine')", EXPORT,
                            "returned dict as the control 'mine', not Control", "NCF508"),
    "reporter raises": Case("reporters", "def form(document):\n    raise KeyError('x')\n", "register(form, '.odd')",
                            ("report", "{machine}", "-o", "{out}.odd"), "failed as the reporter '.odd': KeyError"),
    "reporter returns text": Case("reporters", "def form(document):\n    return 'page'\n", "register(form, '.odd')",
                                  ("report", "{machine}", "-o", "{out}.odd"),
                                  "returned str as the reporter '.odd', not bytes", "NCF508"),
    "verb raises": Case("commands", "@click.command()\ndef odd():\n    {}['x']\n", "register(odd)", ("odd",),
                        "failed: KeyError"),
    "verb calls ncfix wrongly": Case(
        "commands", "@click.command()\ndef odd():\n    import ncfix.plugins\n    ncfix.plugins.nearest(5, 5)\n",
        "register(odd)", ("odd",), "in what it called of ncfix"),
    "no verb": Case("commands", "", "register(5, 'odd')", ("odd",), "it has no main", "NCF508"),
    "executor raises": Case("executors", "def make(workers):\n    raise OSError('no cluster')\n", "register(make, 'x')",
                            ("fix", "{program}", "{second}", "-m", "{machine}", "-o", "{out}", "--executor", "x",
                             "--jobs", "2"), "failed as the executor 'x': OSError: no cluster"),
    "executor is none": Case("executors", "def make(workers):\n    return 5\n", "register(make, 'x')",
                             ("fix", "{program}", "{second}", "-m", "{machine}", "-o", "{out}", "--executor", "x",
                              "--jobs", "2"), "returned int as the executor 'x', not Executor", "NCF508"),
}  # fmt: skip

MACHINE = """
ncfix = 1
name = "small"
topology = "w F X Y Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [-200, 300] }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [-150, 250] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [-300, 300] }
"""


class Distribution:
    """Where the plugin is said to come from."""

    def __init__(self) -> None:
        self.metadata = Metadata()
        self.metadata["Name"], self.metadata["Version"] = "somebodys-tools", "4.2"


@pytest.mark.parametrize("name", CASES)
def test_it_is_told_as_the_plugins(name: str, tmp_path: Path, ncfix: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    case = CASES[name]
    result = met(case, tmp_path, ncfix, monkeypatch)
    assert "NCF000" not in result.err
    assert f"{case.code}: " in result.err, result.err
    assert case.said in result.err
    assert "plugin 'third' of somebodys-tools" in result.err
    if case.code == "NCF507":
        assert result.code == ExitCode.FAULT
        assert "NCFIX_DISABLE_PLUGINS=third" in result.err


def test_every_hook_has_a_broken_plugin() -> None:
    assert {case.kind for case in CASES.values()} == set(plugins.KINDS)


def met(case: Case, tmp_path: Path, ncfix: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """What the verb says that meets the plugin, installed beside the built-in ones."""
    from ncfix.machine.effects import kinds

    for module in ("third_party_broken",):
        monkeypatch.delitem(sys.modules, module, raising=False)
    (tmp_path / "third_party_broken.py").write_text(HEAD + case.body + HOOK.format(kind=case.kind, line=case.line))
    monkeypatch.syspath_prepend(tmp_path)
    point = EntryPoint("third", "third_party_broken", hookspecs.GROUP)._for(Distribution())  # type: ignore[attr-defined]
    found = plugins.collect([*plugins.installed(), point])
    monkeypatch.setattr(plugins, "load_plugins", lambda: found)
    monkeypatch.setattr("ncfix.plugins.load_plugins", lambda: found)
    plugins.leave.cache_clear()
    kinds.cache_clear()
    places = {name: str(tmp_path / name) for name in ("machine", "wavy", "program", "second", "data", "out")}
    Path(places["machine"]).write_text(MACHINE)
    effect = '[[effect]]\nname = "EXX"\nbasis = "wave"\ncoefficients = [0.001]\n'
    Path(places["wavy"]).write_text(MACHINE + effect)
    Path(places["data"]).write_text("LASER\n1 2\n")
    for program in ("program", "second"):
        Path(places[program]).write_text("G90 G0 X0 Y0 Z0\nG1 X10 F500\nM2\n")
    try:
        return ncfix(*(argument.format(**places) for argument in case.arguments))
    finally:
        kinds.cache_clear()


@pytest.fixture(autouse=True)
def forgotten() -> Iterator[None]:
    """The languages and grammars of these plugins are not kept."""
    from ncfix.text.grammar import parser
    from ncfix.text.language import loaded

    yield
    parser.cache_clear()
    loaded.cache_clear()
    sys.modules.pop("third_party_broken", None)
