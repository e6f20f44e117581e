"""What pages with pictures are made of: templates, scripts and style of this package, data, and plotly's library.

A page holds everything it needs and asks no network for anything. Data and library are in it as gzip in base64, which
browsers unpack by themselves. Equal input gives equal bytes.
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
"""What says that a file is a page of ncfix's, which a newer one may replace."""
LIBRARY = "plotly.js"
"""Name of the library beside the pages of a batch."""
WITHIN = 600
"""Bytes at the beginning of a page in which OWN stands."""


@cache
def asset(name: str) -> str:
    """A template, style or script of this package."""
    return (Path(__file__).parent / "assets" / name).read_text("utf-8")


@cache
def library() -> bytes:
    """The library that draws, with its licence at its head; raises `UsageError` NCF031 where it is not installed."""
    found = find_spec("plotly")
    if found is None or not found.submodule_search_locations:
        text = "a page of a program is drawn by plotly, which is not installed"
        raise UsageError.of("NCF031", text, hint="pip install 'ncfix[report]'")
    return (Path(found.submodule_search_locations[0]) / "package_data" / "plotly.min.js").read_bytes()


def packed(content: bytes) -> str:
    """Bytes as they stand in a page."""
    return b64encode(gzip.compress(content, 9, mtime=0)).decode()


def with_columns(head: Mapping[str, Any], columns: Mapping[str, Array]) -> bytes:
    """Plain data and columns of numbers, as the script of the page reads them: length of the head, head, columns."""
    kinds = [[name, f"{values.dtype.kind}{values.dtype.itemsize}", len(values)] for name, values in columns.items()]
    text = json.dumps({**head, "columns": kinds}, ensure_ascii=False, allow_nan=False).encode()
    little = (np.ascontiguousarray(each, each.dtype.newbyteorder("<")).tobytes() for each in columns.values())
    return b"".join([len(text).to_bytes(4, "little"), text, *little])


def filled(template: str, values: Mapping[str, str]) -> bytes:
    """A template of this package with values in the places of their names, which are HTML."""
    return re.sub(r"\{\{(\w+)\}\}", lambda found: values[found[1]], asset(template)).encode()


def card(value: str, about: str) -> str:
    """A figure at the head of a page; `value` is HTML."""
    return f'<div class="card"><b>{value}</b><span>{escape(about)}</span></div>'


def table(header: Sequence[str], rows: Iterable[Sequence[str]], right: Sequence[int] = ()) -> str:
    """A table; cells are HTML; columns `right` stand to the right."""
    kinds = [' class="n"' if column in right else "" for column in range(len(header))]
    head = "".join(f'<th scope="col"{kind}>{escape(name)}</th>' for name, kind in zip(header, kinds, strict=True))
    body = "".join(
        f"<tr>{''.join(f'<td{kind}>{cell}</td>' for cell, kind in zip(row, kinds, strict=True))}</tr>\n" for row in rows
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>\n{body}</tbody></table>"


def is_own(path: str) -> bool:
    """Whether a file is a page of ncfix's, or the library of its pages."""
    try:
        with open(path, "rb") as file:
            begin = file.read(WITHIN)
    except OSError:
        return False
    return OWN in begin or begin[:WITHIN] == library()[:WITHIN]
