"""What the documents say is there, and what is there is in the documents."""

from __future__ import annotations

import ast
import re
import shlex
import tomllib
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from ncfix import plugins
from ncfix.cli.main import VERBS, cli
from ncfix.control.setup_file import loads

DOCUMENTS = ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "docs/*.md", "docs/guide/*.md", "examples/stories/*/*.md")

LINK = re.compile(r"\[[^]]*\]\(([^)#\s]*)(#[^)\s]*)?\)")


def commands() -> Iterator[tuple[str, click.Command]]:
    """Every verb, those of groups as "machine check"."""
    context = click.Context(cli, info_name="ncfix")
    for verb in VERBS:
        command = cli.get_command(context, verb)
        assert command is not None
        if isinstance(command, click.Group):
            yield from ((f"{verb} {name}", sub) for name, sub in command.commands.items())
        else:
            yield verb, command


COMMANDS = dict(commands())


def section(text: str, verb: str) -> str:
    """The part of docs/formats.md on one verb: from its heading to the next."""
    found = re.search(rf"^### `ncfix {verb}\b.*?(?=^##|\Z)", text, re.MULTILINE | re.DOTALL)
    assert found, f"no section on `ncfix {verb}` in docs/formats.md"
    return found[0]


@pytest.mark.parametrize("verb", COMMANDS)
def test_every_verb_and_option_is_documented(root: Path, verb: str) -> None:
    text = section((root / "docs/formats.md").read_text(), verb)
    common = (root / "docs/formats.md").read_text().split("## Command line")[1].split("### ")[0]
    for parameter in COMMANDS[verb].params:
        if isinstance(parameter, click.Option):
            assert any(f"`{option}" in text or f"`{option}" in common for option in parameter.opts), parameter.opts


@pytest.mark.parametrize("verb", COMMANDS)
def test_every_verb_and_option_has_help(verb: str) -> None:
    command = COMMANDS[verb]
    assert command.help
    for parameter in command.params:
        if isinstance(parameter, click.Option):
            assert parameter.help, parameter.opts


def shown_commands(page: Path) -> Iterator[list[str]]:
    """The command lines of a page, as arguments; what they do stands two blanks behind them.

    Patterns, as `ncfix VERB ...`, are none.
    """
    text = re.sub(r"\\\n\s*", "", page.read_text())
    for line in re.findall(r"^    (ncfix .*)", text, re.MULTILINE):
        command = re.split(r"\s{2,}", line)[0]
        if not re.search(r"\[|\.\.\.", command):
            yield shlex.split(command)[1:]


@pytest.mark.parametrize(
    ("pages", "fewest"), [("README.md", 12), ("docs/*.md", 8), ("docs/guide/*.md", 1), ("examples/stories/*/*.md", 3)]
)
def test_the_commands_of_the_documents_are_understood(root: Path, pages: str, fewest: int) -> None:
    found = [command for page in sorted(root.glob(pages)) for command in shown_commands(page)]
    assert len(found) >= fewest
    context = click.Context(cli, info_name="ncfix")
    for verb, *arguments in found:
        command = cli.get_command(context, verb)
        assert command is not None, verb
        if isinstance(command, click.Group):
            verb, *arguments = arguments
            command = command.commands[verb]
        command.make_context(verb, arguments, parent=context)


def test_every_hook_is_documented_and_none_that_is_not(root: Path) -> None:
    named = set(re.findall(r"\bregister_[a-z]+\b", (root / "docs/plugins.md").read_text()))
    assert named == set(plugins.HOOKS)


def anchors(text: str) -> set[str]:
    """What a link to a heading of a page may be, as GitHub makes it."""
    headings = re.findall(r"^#+ (.*)$", re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL), re.MULTILINE)
    return {"#" + re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("documents", DOCUMENTS)
def test_links_lead_somewhere(root: Path, documents: str) -> None:
    pages = list(root.glob(documents))
    assert pages
    for page in pages:
        for link, anchor in LINK.findall(page.read_text()):
            if "://" in link:
                continue
            target = page.parent / link if link else page
            assert target.exists(), f"{page}: {link}"
            assert not anchor or anchor in anchors(target.read_text()), f"{page}: {link}{anchor}"


def test_every_module_says_what_it_is(root: Path) -> None:
    for path in [*root.glob("src/**/*.py"), *root.glob("plugins/**/*.py")]:
        source = path.read_text()
        assert not source.strip() or ast.get_docstring(ast.parse(source)), path


def test_no_room_holds_two_ideas(root: Path) -> None:
    long = {
        str(path.relative_to(root)): n
        for path in root.glob("src/**/*.py")
        if (n := len(path.read_text().splitlines())) > 500
    }
    assert not long


def test_the_setup_file_of_the_document_is_one(root: Path) -> None:
    section = (root / "docs/formats.md").read_text().split("## Setup file")[1]
    example = re.findall(r"```toml\n(.*?)```", section, re.DOTALL)[0]
    setup = loads(example)
    assert setup.work_offsets["G54"] == {"X": 0.0, "Y": 0.0, "Z": 120.0, "A": 0.0, "B": 0.0}
    assert set(setup.work_offsets) == {"G54", "G55", "G59.1"}
    assert setup.tools[12].radius == 5.0
    assert set(setup.variables) == {"#100", "#<_probe_offset>"}


def test_the_floors_and_modules_of_the_documents_are_there(root: Path) -> None:
    """The table of floors has every floor in the order of the contract; every module that is named exists."""
    contributing = (root / "CONTRIBUTING.md").read_text()
    layers = tomllib.loads((root / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"][0]["layers"]
    floors = [name for layer in layers for name in re.findall(r"ncfix\.(\w+)", layer)]
    packages = [name for name in floors if (root / "src/ncfix" / name).is_dir()]
    assert re.findall(r"^\| `src/ncfix/(\w+)`", contributing, re.MULTILINE) == packages
    assert set(packages) == {path.parent.name for path in root.glob("src/ncfix/*/__init__.py")}
    pages = [*root.glob("docs/*.md"), root / "README.md", root / "CONTRIBUTING.md"]
    named = {(page.name, name) for page in pages for name in re.findall(r"`([\w/]+\.py)`", page.read_text())}
    folders = ("src", "plugins", "tests", "benchmarks", "examples", "docs")
    there = {f"/{path.relative_to(root)}" for folder in folders for path in (root / folder).rglob("*.py")}
    there |= {f"/{path.name}" for path in root.glob("*.py")}
    assert len(named) > 20
    assert not [found for found in named if not any(path.endswith(f"/{found[1]}") for path in there)]


ROW = re.compile(r"(\w+(?:, \w+)*) {2,}\S")
"""A row of a docstring: names, and what they are."""


def test_the_rows_of_docstrings_are_fields_and_arguments(root: Path) -> None:
    for path in [*root.glob("src/**/*.py"), *root.glob("plugins/**/*.py")]:
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.ClassDef | ast.FunctionDef):
                continue
            rows = map(ROW.match, (ast.get_docstring(node) or "").splitlines()[1:])
            told = {name for row in rows if row for name in row[1].split(", ")}
            assert told <= names_in(node), f"{path}: {node.name}: {sorted(told - names_in(node))}"


def names_in(node: ast.ClassDef | ast.FunctionDef) -> set[str]:
    """The arguments of a function; the fields, methods and other attributes of a class, and their arguments."""
    found = {each.arg for each in ast.walk(node) if isinstance(each, ast.arg)}
    if isinstance(node, ast.ClassDef):
        found |= {each.name for each in node.body if isinstance(each, ast.FunctionDef)}
        targets = [each.target for each in node.body if isinstance(each, ast.AnnAssign)]
        found |= {each.id for each in targets if isinstance(each, ast.Name)}
        found |= {each.attr for each in ast.walk(node) if isinstance(each, ast.Attribute)}
    return found
