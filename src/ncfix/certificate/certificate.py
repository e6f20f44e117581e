"""The certificate: the result of a proof for certain files, as JSON, and the check whether it still holds."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any

from ncfix.certificate.coordinates import Given
from ncfix.certificate.findings import BlockProof
from ncfix.certificate.proof import prove
from ncfix.diagnostics import Place, SourceError
from ncfix.machine import Machine
from ncfix.values import frozen
from ncfix.version import __version__

SCHEMA = 1
MOST = 1000
"""Largest number of faults that a certificate lists."""
PROVED, PARTLY, FAULTY = "proved", "proved in part", "faulty"
HELD = ("original", "corrected", "machine", "setup_sha256", "dialect")
"""Keys that identify the files of a certificate."""
FOUND = ("verdict", "blocks", "motions", "proved", "proved_motions")
"""Keys of the result, which a repeated proof must confirm."""


@frozen
class Subject:
    """The subject of a certificate: names and contents of the files, and the values outside the program.

    dialect  name of the dialect of the program
    family   name of the dialect of which that is a variant, or that dialect
    """

    original: tuple[str, bytes]
    corrected: tuple[str, bytes]
    machine_file: tuple[str, bytes]
    machine: Machine
    given: Given
    dialect: str
    family: str
    tolerance_um: float

    def certificate(self) -> dict[str, Any]:
        """Prove the program, and return the certificate."""
        proof = prove(self.original[1], self.corrected[1], self.machine, self.given, self.family, self.tolerance_um)
        stamp = proof.stamp
        return {
            "schema": SCHEMA,
            "verdict": verdict_of(proof),
            "ncfix": __version__,
            "original": _file(*self.original),
            "corrected": _file(*self.corrected),
            "machine": {**_file(*self.machine_file), "name": self.machine.name, "hash": self.machine.hash},
            "setup_sha256": _digest(json.dumps(_in_order(asdict(self.given)), default=str).encode()),
            "dialect": self.dialect,
            "strategy": stamp.strategy if stamp else None,
            "tolerance_um": stamp.tolerance_um if stamp else self.tolerance_um,
            "blocks": proof.blocks,
            "motions": proof.motions,
            "proved": proof.proved,
            "proved_motions": proof.proved_motions,
            "faulty": len(proof.faulty) + sum(1 for fault in proof.faults if not fault.original),
            "not_proved": [
                {"reason": reason, "blocks": count, "lines": proof.lines(reason)}
                for reason, count in proof.reasons.most_common()
            ],
            "faults": [
                {"text": fault.text, "line": fault.line, "original_line": fault.original or None}
                for fault in proof.faults[:MOST]
            ],
            "largest_correction_um": round(proof.largest_um, 3),
            "farthest_um": round(proof.farthest_um, 3),
        }


def verdict_of(proof: BlockProof) -> str:
    """The verdict in words."""
    if proof.faults:
        return FAULTY
    return PARTLY if proof.unproved else PROVED


def _file(path: str, content: bytes) -> dict[str, str]:
    return {"path": path, "sha256": _digest(content)}


def _in_order(value: Any) -> Any:
    """The value with mappings sorted by key, numbers before names; tools may have both."""
    if not isinstance(value, Mapping):
        return value
    return {key: _in_order(value[key]) for key in sorted(value, key=lambda key: (isinstance(key, str), key))}


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def said(certificate: Mapping[str, Any]) -> Iterator[str]:
    """The lines of a certificate as text for people."""
    motions, blocks = certificate["motions"], certificate["blocks"]
    yield f"certificate: {certificate['verdict']}"
    yield (
        f"  blocks proved       {certificate['proved']} of {blocks}, "
        f"{certificate['proved_motions']} of the {motions} with motions"
    )
    if certificate["not_proved"]:
        left = sum(each["blocks"] for each in certificate["not_proved"])
        yield f"  not proved          {left}: the second reader cannot judge them; this is not a fault"
        for each in certificate["not_proved"]:
            lines = " ".join(map(str, each["lines"]))
            more = " ..." if each["blocks"] > len(each["lines"]) else ""
            yield f"    {each['blocks']:>6}  {each['reason']}: line {lines}{more}"
    if certificate["faults"]:
        yield f"  faults              {certificate['faulty']}"
        for each in certificate["faults"][:20]:
            of = f" (of {each['original_line']} in the original)" if each["original_line"] else ""
            yield f"    line {each['line']}{of}: {each['text']}"
    yield f"  largest correction  {certificate['largest_correction_um']:.1f} um"
    yield f"  path of the tip     at most {certificate['farthest_um']:.2f} um from the intended one, where proved"


def dumps(certificate: Mapping[str, Any]) -> str:
    """A certificate as the text of its file."""
    return json.dumps(certificate, indent=1) + "\n"


def loads(text: bytes, path: str) -> dict[str, Any]:
    """A certificate from the text of its file; raises `SourceError` NCF034."""
    hint = "give a file that `ncfix verify --certificate` has written"
    try:
        found = json.loads(text.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise SourceError.of("NCF034", f"is not a certificate: {error}", Place(path), hint) from None
    if not isinstance(found, dict) or found.get("schema") != SCHEMA or not all(key in found for key in (*HELD, *FOUND)):
        raise SourceError.of("NCF034", "is not a certificate of this version of ncfix", Place(path), hint)
    for name in HELD[:3]:
        if not isinstance(found[name], dict) or not isinstance(found[name].get("sha256"), str):
            raise SourceError.of("NCF034", f"is not a certificate: {name} has no hash", Place(path), hint)
    return found


def differences(certificate: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """The differences between a certificate and the proof made now; none if the certificate holds."""
    titles = {"original": "the original", "corrected": "the corrected program", "machine": "the machine file"}
    for name, title in titles.items():
        if certificate[name]["sha256"] != now[name]["sha256"]:
            yield f"{title} is not that of the certificate"
    if certificate["setup_sha256"] != now["setup_sha256"]:
        yield "the setup is not that of the certificate"
    if certificate["dialect"] != now["dialect"]:
        yield f"the dialect of the certificate is {certificate['dialect']}, not {now['dialect']}"
    for name in FOUND:
        if certificate[name] != now[name]:
            yield f"{name.replace('_', ' ')}: {certificate[name]} in the certificate, {now[name]} now"
