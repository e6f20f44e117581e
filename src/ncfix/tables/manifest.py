"""The side file of exported tables: which machine they are for, which files they are, under which settings."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ncfix.diagnostics import ConfigError, Message, Place, RefusedError
from ncfix.machine import Machine
from ncfix.tables.control import Least

NAME = "ncfix-tables.json"
SCHEMA = 1


@dataclass(frozen=True, slots=True)
class Manifest:
    """What is known of a set of files.

    control      the plugin that wrote them
    machine      its name, and the hash of everything that matters to its correction
    ranges       axis -> lowest and highest position covered, mm or degree
    tool_length  the length that they hold for, mm
    settings     the control's options
    files        name -> SHA-256 of the content
    """

    control: str
    machine: str
    hash: str
    ranges: Mapping[str, tuple[float, float]]
    tool_length: float
    settings: Mapping[str, str]
    files: Mapping[str, str]

    def as_bytes(self, **more: Any) -> bytes:
        """The file, with more that people may want to know."""
        fields = {name: getattr(self, name) for name in Manifest.__slots__}
        return (json.dumps({"ncfix-tables": SCHEMA, **fields, **more}, indent=1) + "\n").encode()

    def changed(self, files: Mapping[str, bytes], folder: str) -> tuple[Message, ...]:
        """Remarks on files that are not as they were written (NCF488)."""
        return tuple(
            Message("NCF488", "was changed since it was exported", Place(f"{folder}/{name}"), "export again")
            for name, expected in self.files.items()
            if name in files and digest(files[name]) != expected
        )


def digest(content: bytes) -> str:
    """SHA-256 in hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def loads(data: bytes, path: str) -> Manifest:
    """Read the side file; raises `ConfigError` NCF486."""
    try:
        found = json.loads(data)
        if found["ncfix-tables"] != SCHEMA:
            raise ValueError(f"schema {found['ncfix-tables']!r}, not {SCHEMA}")
        ranges = {str(axis): (float(low), float(high)) for axis, (low, high) in found["ranges"].items()}
        texts = (str(found["control"]), str(found["machine"]), str(found["hash"]))
        return Manifest(*texts, ranges, float(found["tool_length"]), _texts(found["settings"]), _texts(found["files"]))
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        text = f"is not the side file of exported tables: {error}"
        raise ConfigError.of("NCF486", text, Place(path), "export again") from error


def said(data: bytes) -> tuple[tuple[str, ...], Least | None]:
    """What export remarked on the tables, and how little such tables could leave; nothing where it does not say so."""
    found = json.loads(data)
    notes, least = found.get("notes"), found.get("least_um")
    texts = tuple(str(note) for note in notes) if isinstance(notes, list) else ()
    try:
        return texts, Least(float(least["max"]) / 1e3, str(least["why"])) if least else None
    except (KeyError, TypeError, ValueError):
        return texts, None


def _texts(record: Mapping[str, Any]) -> dict[str, str]:
    return {str(name): str(value) for name, value in record.items()}


def check(manifest: Manifest, control: str, machine: Machine | None, path: str) -> None:
    """Refuse tables of another control, or of another machine if one is given: raises `RefusedError` NCF487."""
    place = Place(path)
    if manifest.control != control:
        raise RefusedError.of("NCF487", f"these are tables for {manifest.control}, not {control}", place)
    if machine is not None and manifest.hash != machine.hash:
        text = f"these tables were made for another machine, or for other errors of it: {manifest.machine}"
        raise RefusedError.of("NCF487", text, place, "export them again for this machine file, or say --other-machine")
