"""What mkdocs needs to make a site of the documents where they are (`make docs`).

The site has the folders of the repository, so links between documents, examples and sources lead where they lead in the
repository. Beside the documents it has reference pages made from docstrings, and one of all messages.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from griffe import Extension
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

import ncfix
from ncfix import api, plugin, testing
from ncfix.cli.listings import all_codes

ROOT = Path(__file__).resolve().parents[1]
PAGES = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs/*.md", "docs/guide/*.md", "examples/stories/*/README.md")
SHOWN = ("LICENSE", "docs/figures/*", "grammars/*.lark", "examples/**/*", "src/ncfix/hookspecs.py")
"""Files that pages link to; they are in the site as they are."""
VALUES = (
    *("control.setup.Setup", "control.setup.Tool", "compensate.driver.Fixed", "compensate.report.FixReport"),
    *("compensate.figures.verification.Compared", "api.programs.PathErrors", "api.measurements.Planned"),
    *(
        "api.measurements.Calibrated",
        "diagnosis.diagnosis.Diagnosis",
        "api.tables.Exported",
        "measure.instruments.Faults",
    ),
    *("diagnostics.NcfixError", "diagnostics.Message", "diagnostics.Place"),
)
"""What the functions take and give: modules below ncfix, and names."""
LINK = re.compile(r"(\]\()([^)#:\s]+)((?:#[^)\s]*)?\))")


COLUMN = re.compile(r"(\S(?:\S| (?! ))*) {2,}(\S.*)")
"""A name and what it means, in a docstring."""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """The files of the site, where the repository has them."""
    site = [file for file in files if not Path(file.abs_src_path or "").is_relative_to(ROOT / "docs")]  # the theme's
    for pattern in (*PAGES, *SHOWN):
        for path in sorted(ROOT.glob(pattern)):
            hidden = "__pycache__" in path.parts or (pattern in SHOWN and path.match("stories/*/README.md"))
            if path.is_file() and not hidden:
                site.append(File.generated(config, path.relative_to(ROOT).as_posix(), abs_src_path=str(path)))
    site += [File.generated(config, f"reference/{name}.md", content=text) for name, text in _reference()]
    return Files(site)


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """A page whose links to folders lead to the first file in them."""

    def led(link: re.Match[str]) -> str:
        folder = (ROOT / page.file.src_uri).parent / link[2]
        if not folder.is_dir():
            return link[0]
        uri = folder.resolve().relative_to(ROOT).as_posix()
        inside = sorted(
            (file.src_uri for file in files if file.src_uri.startswith(f"{uri}/")),
            key=lambda name: (name.count("/"), not name.endswith("README.md"), name),
        )
        return f"{link[1]}{link[2].rstrip('/')}/{inside[0].removeprefix(f'{uri}/')}{link[3]}" if inside else link[0]

    return LINK.sub(led, markdown)


def _reference() -> Iterator[tuple[str, str]]:
    """The pages that are made: name and text."""
    functions = [f"ncfix.api.{module}.{name}" for name, module in ncfix.FUNCTIONS.items()]
    yield "functions", _page("Functions of `import ncfix`", api.__doc__ or "", functions)
    values = [f"ncfix.{name}" for name in VALUES]
    yield "values", _page("Values", "What the functions take and give.", values)
    own = [f"{plugin.MODULES.get(name, 'ncfix.plugin')}.{name}" for name in plugin.__all__]
    yield "plugin", _page("`ncfix.plugin`", plugin.__doc__ or "", [name for name in own if name not in values])
    contracts = [f"ncfix.testing.{name}" for name in testing.__all__]
    yield "testing", _page("`ncfix.testing`", testing.__doc__ or "", contracts)
    yield "messages", _messages()


def _page(title: str, text: str, names: list[str]) -> str:
    entries = "\n".join(f"::: {name}" for name in names)
    return f"# {title}\n\n{text}\n\n{entries}\n"


def _messages() -> str:
    lines = ["# Messages", "", "What `ncfix explain CODE` says of each.", ""]
    for code, meaning in all_codes().items():
        lines += [f"## {code}", "", f"**{_plain(meaning.title)}**", "", _plain(meaning.text), ""]
        lines += [f"*What to do:* {_plain(meaning.hint)}", ""] if meaning.hint else []
    return "\n".join(lines)


def _plain(text: str) -> str:
    """A text whose signs are none of Markdown, but for code."""
    parts = re.split(r"(`[^`]*`)", text)
    return "".join(part if part[:1] == "`" else re.sub(r"([*_<>\[\]])", r"\\\1", part) for part in parts)


class Columns(Extension):
    """Docstrings whose columns, a name and what it means, become lists."""

    def on_instance(self, *, obj: Any, **_: Any) -> None:
        """An object has been read."""
        if obj.docstring is not None:
            obj.docstring.value = as_lists(obj.docstring.value)


def as_lists(text: str) -> str:
    """A docstring with its columns as lists."""
    lines: list[str] = []
    inside = False
    for line in text.splitlines():
        entry = COLUMN.match(line)
        if entry:
            lines += [] if inside else [""]
            lines.append(f"- `{entry[1].replace('`', '')}`: {entry[2]}")
            inside = True
        elif inside and line.startswith("  "):
            lines.append(f"    {line.strip()}")
        else:
            lines += [""] if inside and line else []
            inside = False
            lines.append(line)
    return "\n".join(lines)
