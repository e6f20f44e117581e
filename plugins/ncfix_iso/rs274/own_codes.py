"""The codes and drilling cycles that a dialect adds to its family, as rules of the family."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ncfix.control.operations import Like
from ncfix.text.dialect import tenths
from ncfix_iso.rs274 import groups
from ncfix_iso.rs274.groups import OWN, Rules

if TYPE_CHECKING:
    from ncfix.text.dialect import CodeOperation, CycleTable, Dialect


def with_own_codes(rules: Rules, dialect: Dialect) -> Rules:
    """The rules of a dialect: those of its family, and what it adds."""
    for name, operations in dialect.codes:
        letter, code = name[0], tenths(name)
        if len(operations) == 1 and isinstance(operations[0], Like):
            rules = replace(rules, aliases={**rules.aliases, (letter, code): operations[0]})
        elif letter == "M":
            rules = with_m_code(rules, code, operations)
        else:
            rules = with_g_code(rules, code, operations)
    for name, table in dialect.cycles:
        rules = with_cycle(rules, tenths(name), table)
    return rules


def with_m_code(rules: Rules, code: int, operations: tuple[CodeOperation, ...]) -> Rules:
    """An M code that is a few operations, or none."""
    m_groups = {**rules.m_groups, code: f"{OWN}M{code}"}
    return replace(rules, m_groups=m_groups, operations={**rules.operations, ("M", code): operations})


def with_g_code(rules: Rules, code: int, operations: tuple[CodeOperation, ...]) -> Rules:
    """A G code that is a few operations; one with none is passed over."""
    known = {known: group for known, group in rules.g_groups.items() if known != code}
    takes = {code} if any(operation.takes for operation in operations) else set[int]()
    return replace(
        rules,
        g_groups=known | ({code: f"{OWN}G{code}"} if operations else {}),
        harmless_g=rules.harmless_g - {code} if operations else rules.harmless_g | {code},
        operations={**rules.operations, ("G", code): operations},
        takes=(rules.takes - {code}) | takes,
    )


def with_cycle(rules: Rules, code: int, table: CycleTable) -> Rules:
    """A drilling cycle."""
    return replace(
        rules,
        g_groups={**rules.g_groups, code: groups.MOTION},
        harmless_g=rules.harmless_g - {code},
        cycles=rules.cycles | {code},
        takes=rules.takes - {code},
        tables={**rules.tables, code: table},
    )
