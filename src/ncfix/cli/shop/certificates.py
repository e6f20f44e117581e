"""Certificates on the command line: `verify --certificate`, `verify --against`, and `fix --certificate`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ncfix import files
from ncfix.cli import console
from ncfix.cli.options import dialect_of
from ncfix.cli.targets import read, shown
from ncfix.diagnostics import ExitCode, Message, Place
from ncfix.values import frozen

if TYPE_CHECKING:
    from ncfix.certificate.coordinates import Given
    from ncfix.cli.targets import OutputTarget
    from ncfix.control.setup import Setup
    from ncfix.machine import Machine
    from ncfix.text.dialect import Dialect

SUFFIX = ".certificate.json"
"""Suffix of the certificate beside a corrected program."""


def given_of(setup: Setup, dialect: Dialect) -> Given:
    """The data of the setup in the form of the second reader."""
    from ncfix.certificate.coordinates import Given

    tools: dict[int | str, float | None] = {number: tool.length for number, tool in setup.tools.items()}
    tools |= {str(number): tool.length for number, tool in setup.tools.items()}
    tools |= {name.upper(): tool.length for name, tool in setup.named_tools.items()}
    return Given(
        offsets=setup.work_offsets,
        tools=tools,
        initial=setup.initial,
        references=setup.references,
        tcp=setup.tcp,
        assume_zero=setup.assume_zero,
        skip=setup.block_skip,
        workpiece_offset=setup.workpiece_offset,
        inputs=setup.inputs,
        pointless=setup.no_point.startswith("IS"),
        decimal_inches=dialect.decimal_inches,
        reference_ends_length=dialect.semantics == "haas",
    )


@frozen
class Proving:
    """What a correction is proved with; `dialect`: if given by option."""

    machine: Machine
    machine_path: str
    setup: Setup
    dialect: str | None
    tolerance_um: float

    def certificate(self, original: str, fixed: str) -> dict[str, Any]:
        """The certificate of a correction, from both programs as they are in their files."""
        from ncfix.certificate.certificate import Subject

        before, after, machine_file = ((shown(path), read(path)) for path in (original, fixed, self.machine_path))
        known = dialect_of(before[1], before[0], self.dialect, self.machine)
        subject = Subject(
            before,
            after,
            machine_file,
            self.machine,
            given_of(self.setup, known),
            known.name,
            known.variant_of or known.name,
            self.tolerance_um,
        )
        return subject.certificate()


def verify_certificate(
    proving: Proving, original: str, fixed: str, output: str | None, against: str | None, as_json: bool
) -> int:
    """Prove a corrected program with the second reader; write the certificate, or compare it with an earlier one."""
    from ncfix.certificate.certificate import FAULTY, differences, dumps, loads, said

    earlier = None if against is None else loads(read(against), shown(against))
    with console.busy(f"proving {shown(fixed)}"):
        now = proving.certificate(original, fixed)
    if output is not None:
        files.write_whole(output, dumps(now).encode())
    changed = [] if earlier is None else list(differences(earlier, now))
    if as_json:
        console.put_json(**({**now, "changed": changed} if against is not None else now))
    else:
        console.put("".join(f"{line}\n" for line in said(now)))
    for text in changed:
        console.tell(Message("NCF032", text, Place(shown(against or ""))))
    return ExitCode.FINDINGS if changed or now["verdict"] == FAULTY else ExitCode.DONE


def certify_output(proving: Proving, target: OutputTarget) -> dict[str, Any]:
    """Prove an output as it is on disk, and write its certificate beside it."""
    from ncfix.certificate.certificate import FAULTY, dumps

    found = proving.certificate(target.backup if target.in_place else target.source, target.path)
    path = target.path + SUFFIX
    files.write_whole(path, dumps(found).encode(), target.force or target.resume)
    counts = f"{found['proved']} of {found['blocks']} blocks"
    console.say(f"  certificate         {found['verdict']}, {counts}: {path}")
    if found["verdict"] == FAULTY:
        first = found["faults"][0]
        text = f"the second reader finds {found['faulty']} faults in the corrected program; the first: {first['text']}"
        console.tell(Message("NCF033", text, Place(shown(target.path), first["line"])))
    return found
