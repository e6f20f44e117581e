"""Destinations of pages and pictures of programs: `ncfix fix --report`, `--plot`, `ncfix report PROGRAM -m MACHINE`.

For one program the page is one file. For a batch it is a table of all programs, with a folder beside it that contains
each program's page and one copy of the plotting library. Only pages made by ncfix are replaced, no other files.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ncfix import files
from ncfix.cli.targets import STREAM, OutputTarget
from ncfix.diagnostics import Place, UsageError
from ncfix.inputs import identities
from ncfix.outputs import check_target, exists_already, folded_name
from ncfix.values import frozen

if TYPE_CHECKING:
    from ncfix.reports.program_page import ProgramPage


@frozen
class Pages:
    """Pages of programs.

    page   file for the page of the program, or of the batch; None: no page
    plot   file for the picture of the program; None: no picture
    many   whether it is a batch
    force  whether other files may be replaced, too
    """

    page: str | None
    plot: str | None
    many: bool
    force: bool

    @classmethod
    def of(
        cls,
        page: str | None,
        plot: str | None,
        many: bool,
        force: bool,
        targets: Sequence[OutputTarget],
        read: Sequence[str | None],
    ) -> Pages:
        """The pages that are asked for. Raises `UsageError` if they cannot be written, before anything is computed.

        targets  sources and destinations of the programs
        read     other inputs
        """
        if plot is not None and many:
            raise UsageError.of(
                "NCF001", "--plot makes a picture of one program only", hint="--report makes pages of several programs"
            )
        found = cls(page, plot, many, force)
        inputs = identities([*(target.source for target in targets), *(path for path in read if path)])
        outputs = {folded_name(target.path) for target in targets}
        for path, check in ((page, _check_page), (plot, check_plot)):
            if path is not None:
                if folded_name(path) in outputs:
                    raise UsageError.of(
                        "NCF006", "is also the output of a program", Place(path), "give the page another name"
                    )
                check_target(path, inputs, replace=True)
                check(path)
                found.check_replaced(path)
        return found

    def check_replaced(self, path: str) -> None:
        """Refuse to replace a file that is not a page made by ncfix: NCF004."""
        from ncfix.reports.pages import is_own

        if os.path.lexists(path) and not (self.force or (path != self.plot and is_own(path))):
            raise exists_already(path)

    @property
    def folder(self) -> str:
        """Folder for the pages of a batch."""
        assert self.page is not None
        return f"{os.path.splitext(self.page)[0]}-pages"

    def path_of(self, target: OutputTarget) -> str | None:
        """Path of a program's page."""
        if self.page is None or not self.many:
            return self.page
        return os.path.join(self.folder, f"{target.name or os.path.basename(target.source)}.html")

    def has(self, target: OutputTarget) -> bool:
        """Whether a program's page exists already."""
        path = self.path_of(target)
        return path is not None and os.path.exists(path)

    def put(self, target: OutputTarget, page: ProgramPage) -> None:
        """Write the page of a program, and its picture."""
        path = self.path_of(target)
        if path is not None and self.many:
            from ncfix.reports.pages import LIBRARY, library

            there = os.path.join(self.folder, LIBRARY)
            if not (os.path.exists(there) and files.holds(there, library())):
                self._write(there, library(), self.folder)
            beside = os.path.relpath(self.folder, os.path.dirname(path)).replace(os.sep, "/")
            self._write(path, page.html(f"{beside}/"), self.folder)
        elif path is not None:
            self._write(path, page.html())
        if self.plot is not None:
            from ncfix.reports.picture import picture

            files.write_whole(self.plot, picture(page, _suffix(self.plot)), replace=True)

    def _write(self, path: str, content: bytes, root: str | None = None) -> None:
        self.check_replaced(path)
        files.write_whole(path, content, replace=True, root=root)

    def put_batch(self, entries: Sequence[Mapping[str, Any]]) -> None:
        """Write the page of a batch."""
        from ncfix.cli.shop.batch_page import batch_page

        assert self.page is not None
        self._write(self.page, batch_page(entries, os.path.dirname(self.page)))


def _suffix(path: str) -> str:
    return os.path.splitext(path)[1].lower()[1:]


def _check_page(path: str) -> None:
    from ncfix.reports.pages import library

    if path == STREAM or _suffix(path) not in ("html", "htm"):
        raise UsageError.of("NCF018", "the page of a batch must be an .html file", Place(path), "--report FILE.html")
    library()


def check_plot(path: str) -> None:
    """Raise `UsageError` NCF018 or NCF031 if no picture can be written to this file."""
    from ncfix.reports.picture import FORMS, require_matplotlib

    if _suffix(path) not in FORMS:
        hint = f"one of {' '.join(f'.{form}' for form in FORMS)}"
        raise UsageError.of("NCF018", f"a picture cannot be a .{_suffix(path)} file", Place(path), hint)
    require_matplotlib()
