"""The forms that a report may have, by the suffix of its file."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial

from ncfix.diagnostics import Place, UsageError
from ncfix.plugins import called, registry
from ncfix.report import html, markdown
from ncfix.report.document import Document

Form = Callable[[Document], bytes]
"""Makes a file's content of a report."""

BUILT_IN: dict[str, Form] = {".html": html.rendered, ".md": markdown.rendered}


def form_of(path: str) -> Form:
    """The form that a file's suffix stands for; raises `UsageError` NCF018. Without a suffix, HTML."""
    suffix = os.path.splitext(path)[1].lower() or ".html"
    known: dict[str, Form] = registry("reporters", BUILT_IN)
    if suffix not in known:
        raise UsageError.of("NCF018", f"a report cannot be a {suffix} file", Place(path), f"one of {' '.join(known)}")
    made: Form = partial(called, "reporters", suffix, known[suffix], gives=bytes)
    return made
