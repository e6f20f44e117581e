"""A language of words instead of letters and numbers, as docs/plugins.md builds one."""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType

import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.control.flatten import flatten
from ncfix.diagnostics import PluginError, RefusedError
from ncfix.machine.file import load
from ncfix.plugin import family
from ncfix.testing.judging import SETUP
from ncfix.text.dialect import Dialect
from ncfix.text.language import Language, language_of
from ncfix.text.reader import read

LINES = "METRIC\nOFFSET\nCHANGE TOOL=1\nrapid X=0 Y=10 Z=3 ; go\nMOVE X=200 Y=150 FEED=500\nMOVE X=10\nEND\n"


@pytest.fixture
def page(root: Path, tmp_path: Path) -> ModuleType:
    """The blocks of the page that have Robin in them, as a module beside its grammar."""
    text = (root / "docs/plugins.md").read_text()
    grammar = re.search(r"```lark\n(// Robin.*?)```", text, re.DOTALL)
    module = re.search(r"```py\n((?:(?!```).)*?ROBIN = .*?)```", text, re.DOTALL)
    assert grammar is not None
    assert module is not None
    (tmp_path / "robin.lark").write_text(grammar[1])
    made = ModuleType("robin")
    made.__file__ = str(tmp_path / "robin.py")
    exec(compile(module[1], made.__file__, "exec"), made.__dict__)
    return made


def test_the_page_builds_a_language(page: ModuleType) -> None:
    page.test_the_language()


def test_words_are_put_right_added_and_repeated_in_its_own_way(page: ModuleType, root: Path) -> None:
    program = read(LINES.encode(), "part.rob", page.ROBIN)
    machine = load(root / "examples/machines/three_axis.toml")
    lines = fix_program(program, machine, SETUP, FixOptions(tolerance_um=0.3)).text.decode().splitlines()
    assert lines[4] == "rapid X=0.001 Y=10.001 Z=3 ; go"
    last = [line for line in lines if re.match(r"MOVE X=\d", line)][1:]
    assert len(last) > 5
    assert all(re.fullmatch(r"MOVE X=[\d.]+( Y=[\d.]+)?( Z=[\d.]+)?", line) for line in last[1:])


def test_signs_are_added_where_the_language_has_them(root: Path, page: ModuleType, tmp_path: Path) -> None:
    grammar = tmp_path / "line.lark"
    text = Path(page.ROBIN.grammar).read_text().replace('ADDRESS "=" NUMBER', "ADDRESS NUMBER").replace("MOVE", "L")
    grammar.write_text(text)
    dialect = page.ROBIN.derive(
        "line", title="Line", grammar=str(grammar), keywords={"L": "G1"}, assign="", signed=True
    )
    source = b"METRIC\nOFFSET\nCHANGE TOOL 1\nRAPID X+0 Y+10 Z+3\nL X+200 Y+150 FEED 500\nEND\n"
    machine = load(root / "examples/machines/three_axis.toml")
    fixed = fix_program(read(source, "part", dialect), machine, SETUP, FixOptions())
    assert b"RAPID X+0.001 Y+10.001 Z+3" in fixed.text
    assert b" Z+2.99" in fixed.text


def test_it_cannot_be_written_out_flat(page: ModuleType) -> None:
    with pytest.raises(RefusedError, match="G code, but this language is not"):
        flatten(read(LINES.encode(), "part.rob", page.ROBIN), SETUP, ("X", "Y", "Z"), frozenset(), {})


@pytest.mark.parametrize("keywords", [{"move": "G1"}, {"MOVE": "G1.x"}, {"NAME": "O"}, {"": "G1"}])
def test_what_no_keyword_can_be(keywords: dict[str, str]) -> None:
    with pytest.raises(ValueError, match="cannot be a keyword"):
        family("iso").derive("wrong", title="Wrong", keywords=keywords)


def test_languages_that_have_none() -> None:
    dialect: Dialect = family("heidenhain").derive("words", title="Words", keywords={"MOVE": "G1"})
    with pytest.raises(PluginError, match="codes of its own"):
        language_of(dialect, Language)
