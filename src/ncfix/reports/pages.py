"""Building blocks of HTML pages with pictures: templates, scripts and style of this package, data, plotly's library.

A page contains everything it needs and loads nothing from a network. Data and library are embedded as gzip in base64,
which browsers can unpack. Equal input gives equal bytes.
"""

from __future__ import annotations

import gzip
import json
import re
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from html import escape
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnostics import UsageError

OWN = b'<meta name="generator" content="ncfix '
"""Mark of pages made by ncfix, which a later version may replace."""
LIBRARY = "plotly.js"
"""File name of the library beside the pages of a batch."""
HEAD_BYTES = 600
"""Number of bytes at the beginning of a page within which `OWN` must be found."""


@cache
def asset(name: str) -> str:
    """A template, style or script of this package."""
    return (Path(__file__).parent / "assets" / name).read_text("utf-8")


@cache
def library() -> bytes:
    """The plotting library, with its licence at the beginning; raises `UsageError` NCF031 if it is not installed."""
    found = find_spec("plotly")
    if found is None or not found.submodule_search_locations:
        text = "a page of a program is drawn by plotly, which is not installed"
        raise UsageError.of("NCF031", text, hint="pip install 'ncfix[report]'")
    return (Path(found.submodule_search_locations[0]) / "package_data" / "plotly.min.js").read_bytes()


def packed(content: bytes) -> str:
    """Bytes in the form in which a page embeds them."""
    return b64encode(gzip.compress(content, 9, mtime=0)).decode()


def with_columns(head: Mapping[str, Any], columns: Mapping[str, Array]) -> bytes:
    """Plain data and number columns in the form that the page's script reads: length of the head, head, columns."""
    kinds = [[name, f"{values.dtype.kind}{values.dtype.itemsize}", len(values)] for name, values in columns.items()]
    text = json.dumps({**head, "columns": kinds}, ensure_ascii=False, allow_nan=False).encode()
    little = (np.ascontiguousarray(each, each.dtype.newbyteorder("<")).tobytes() for each in columns.values())
    return b"".join([len(text).to_bytes(4, "little"), text, *little])


def filled(template: str, values: Mapping[str, str]) -> bytes:
    """A template of this package with its placeholders replaced by HTML."""
    return re.sub(r"\{\{(\w+)\}\}", lambda found: values[found[1]], asset(template)).encode()


def card(value: str, about: str) -> str:
    """A figure at the top of a page; `value` is HTML."""
    return f'<div class="card"><b>{value}</b><span>{escape(about)}</span></div>'


def table(header: Sequence[str], rows: Iterable[Sequence[str]], right: Sequence[int] = ()) -> str:
    """A table; cells are HTML; columns in `right` are aligned to the right."""
    kinds = [' class="n"' if column in right else "" for column in range(len(header))]
    head = "".join(f'<th scope="col"{kind}>{escape(name)}</th>' for name, kind in zip(header, kinds, strict=True))
    body = "".join(
        f"<tr>{''.join(f'<td{kind}>{cell}</td>' for cell, kind in zip(row, kinds, strict=True))}</tr>\n" for row in rows
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>\n{body}</tbody></table>"


def is_own(path: str) -> bool:
    """Whether a file is a page of ncfix, or the library of such pages."""
    try:
        with open(path, "rb") as file:
            begin = file.read(HEAD_BYTES)
    except OSError:
        return False
    return OWN in begin or begin[:HEAD_BYTES] == library()[:HEAD_BYTES]
