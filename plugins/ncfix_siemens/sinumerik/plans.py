"""The plan of a block shape: its words, names, assignments and jumps, with functions that evaluate their values."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator
from dataclasses import field, replace

from ncfix.control.coordinates import CENTRE_LETTERS, INDEX
from ncfix.control.expressions import Evaluate, Unknown, left_out
from ncfix.control.lanes.block_rows import Lane
from ncfix.text.reach import Deletable, deletable
from ncfix.text.tree import (
    Assignment,
    Binary,
    Command,
    Comment,
    Constant,
    Expression,
    FunctionCall,
    Literal,
    NamedParameter,
    NumberedParameter,
    Opaque,
    OWordLine,
    Span,
    StringLiteral,
    Template,
    Unary,
    Word,
)
from ncfix.values import frozen, mutable
from ncfix_siemens.sinumerik.blocks import BRACKET, STATEMENT
from ncfix_siemens.sinumerik.expressions import (
    FUNCTIONS_OF_NUMBERS,
    TEXT_FUNCTIONS,
    SinumerikVariables,
    compiled,
    key_of,
)
from ncfix_siemens.sinumerik.vocabulary import ABSOLUTE, FORMS, SHORTEST_WAY, VECTOR

DWELL_WORDS = "FS"
"""Words of the duration of a dwell (G4)."""
LISTS = frozenset({BRACKET, "set", "rep"})
"""Functions that give values to several elements of an array."""
OWN_FUNCTIONS = LISTS | FORMS | FUNCTIONS_OF_NUMBERS.keys() | TEXT_FUNCTIONS.keys() | {"<<"}
"""Functions that ncfix evaluates."""

ANY_PARAMETER = "r[]"
LANE_LETTERS = INDEX.keys() | {"F", "N"}
RADIUS = "CR"
ARC_LETTERS = frozenset({*CENTRE_LETTERS, RADIUS})


@frozen
class Setting:
    """A word: its address, its value as a function, and its form (`ac`, `ic`, `dc`, ... or "")."""

    address: str
    value: Evaluate
    form: str
    span: Span

    def unsure(self) -> Setting:
        """The word with an unknown value, as its block assigns a variable of it before or after it is read."""
        return replace(self, value=left_out)


@frozen
class AssignedVariable:
    """An assignment: the name of the variable, its index if it is an element, and the value (None: a list).

    listed    the values of a list, `SET(..)` or `REP(..)`
    repeated  whether the list is `REP`
    """

    name: str
    index: tuple[Evaluate, ...]
    value: Evaluate | None
    span: Span
    listed: tuple[Evaluate, ...] = ()
    repeated: bool = False


@frozen
class Calling:
    """A name that is executed, with its arguments as functions, and as written."""

    name: str
    arguments: tuple[Evaluate, ...]
    written: tuple[Expression | None, ...]
    called: bool
    span: Span


@frozen
class Branching:
    """A control structure or jump; composed: the label of a jump as a function, if it is computed (`"MARK"<<R1`)."""

    keyword: str
    label: str
    values: tuple[Evaluate, ...]
    written: tuple[Expression, ...]
    span: Span
    composed: Evaluate | None = None


Step = AssignedVariable | Calling | Branching


@mutable
class SinumerikPlan:
    """The plan of all blocks of a shape.

    settings   words, without N and plain G and M codes
    steps      assignments, names and jumps, in the order written
    g, m       codes in tenths
    axes       bit mask of the axis words
    skip       block skip levels at its beginning (`/` is `/0`)
    opaque     kinds of text that is ignored or not understood
    lane       layout for the fast lane, if the block may use it
    functions  functions in its expressions that only the control can evaluate
    vector     slots of A3 B3 C3, -1 for none, if a block for the fast lane has any
    shortest   bit mask of the axes with `DC`, if it is a block for the fast lane
    """

    template: Template
    settings: tuple[Setting, ...] = ()
    steps: tuple[Step, ...] = ()
    g: tuple[int, ...] = ()
    m: tuple[int, ...] = ()
    axes: int = 0
    skip: Deletable | None = None
    opaque: frozenset[str] = frozenset()
    lane: Lane | None = None
    vector: tuple[int, ...] | None = None
    shortest: int = 0
    functions: tuple[Calling, ...] = ()
    names: frozenset[str] = field(default=frozenset())


def plan_of(template: Template) -> SinumerikPlan:
    """The plan for a shape."""
    items = template.items
    plan = SinumerikPlan(template)
    plan.settings = settings_of(template)
    makers: dict[type, Callable[..., Step]] = {Assignment: letting, Command: calling, OWordLine: branching}
    plan.steps = tuple(makers[type(item)](item) for item in items if type(item) in makers)
    plan.g, plan.m = template.g_codes, template.m_codes
    plan.axes = sum({1 << INDEX[each.address] for each in plan.settings if each.address in INDEX})
    plan.skip = deletable(template, DWELL_WORDS)
    plan.opaque = frozenset(item.kind for item in items if isinstance(item, Opaque))
    plan.names = frozenset(step.name for step in plan.steps if isinstance(step, Calling))
    plan.functions = tuple(functions_of(template))
    plan.lane = lane_of(plan)
    if plan.lane is not None and not template.slots.keys().isdisjoint(VECTOR):
        plan.vector = tuple(template.slots.get(address, -1) for address in VECTOR)
    if plan.lane is not None:
        plan.shortest = sum(1 << INDEX[letter] for letter in in_form(template, "ABC", SHORTEST_WAY))
    return plan


def settings_of(template: Template) -> tuple[Setting, ...]:
    """The words of a block without N and plain codes; unsure if the block assigns a variable that they use."""
    words = [word for word in template.words if word.address not in ("N", ":") and not is_code(word)]
    let = {name for item in template.items if isinstance(item, Assignment) for name in names_in(item.target)}
    return tuple(setting(word).unsure() if names_one(let, word.value) else setting(word) for word in words)


def is_code(word: Word) -> bool:
    """Whether a word is G or M with a plain number."""
    return word.address in ("G", "M") and isinstance(word.value, Constant)


def setting(word: Word) -> Setting:
    """A word as a setting, with its value as a function."""
    value = word.value
    if isinstance(value, FunctionCall) and value.name in FORMS and not value.indexed:
        inner = value.arguments[0] if value.arguments else None
        return Setting(word.address, left_out if inner is None else compiled(inner), value.name, word.span)
    return Setting(word.address, compiled(value), "", word.span)


def names_one(names: set[str], expression: Expression) -> bool:
    """Whether an expression may use one of these variables."""
    named = set(names_in(expression))
    if named & names:
        return True
    mine, theirs = (set(filter(is_parameter, each)) for each in (named, names))
    return bool(mine and theirs) and ANY_PARAMETER in mine | theirs


def is_parameter(name: str) -> bool:
    """Whether a name is that of an R parameter."""
    return name == ANY_PARAMETER or (name[0] == "r" and name[1:].isdigit())


def names_in(expression: Expression) -> Iterator[str]:
    """The variables that an expression uses; an R parameter with a computed number is `ANY_PARAMETER`."""
    for part in parts_in(expression):
        match part:
            case NumberedParameter(Constant(number)):
                yield f"r{number:g}"
            case NumberedParameter():
                yield ANY_PARAMETER
            case NamedParameter(name) | FunctionCall(name):
                yield name


def has_value(variables: SinumerikVariables, name: str) -> bool:
    """Whether a name in an expression is, or may be, that of a variable whose value is known."""
    return name == ANY_PARAMETER or not isinstance(variables.value(key_of(name)), Unknown)


def parts_in(expression: Expression) -> Iterator[Expression]:
    """An expression and all of its parts."""
    yield expression
    match expression:
        case NumberedParameter(inner) | Unary(_, inner):
            yield from parts_in(inner)
        case Binary(_, left, right):
            yield from (*parts_in(left), *parts_in(right))
        case FunctionCall(_, arguments):
            yield from (each for part in arguments if part is not None for each in parts_in(part))


def functions_of(template: Template) -> Iterator[Calling]:
    """The functions in the expressions of a block that only the control can evaluate."""
    for item in template.items:
        match item:
            case Word(_, value) | Assignment(_, value):
                written: tuple[Expression | None, ...] = (value,)
            case Command(_, arguments) | OWordLine(_, _, arguments):
                written = arguments
            case _:
                continue
        for part in (each for value in written if value is not None for each in parts_in(value)):
            if isinstance(part, FunctionCall) and not part.indexed and part.name not in OWN_FUNCTIONS:
                yield Calling(part.name, evaluates(part.arguments), part.arguments, True, item.span)


def letting(item: Assignment) -> AssignedVariable:
    """An assignment with its value as a function."""
    name, index = target_of(item)
    if isinstance(item.value, FunctionCall) and item.value.name in LISTS:
        return AssignedVariable(name, index, None, item.span, evaluates(item.value.arguments), item.value.name == "rep")
    return AssignedVariable(name, index, compiled(item.value), item.span)


def target_of(item: Assignment) -> tuple[str, tuple[Evaluate, ...]]:
    """The variable of an assignment, and the index if it is an element."""
    match item.target:
        case NumberedParameter(number):
            return "r", (compiled(number),)
        case NamedParameter(name):
            return name, ()
        case FunctionCall(name, arguments):
            return name, evaluates(arguments)
    raise AssertionError("there are no other targets")


def evaluates(arguments: tuple[Expression | None, ...]) -> tuple[Evaluate, ...]:
    """Arguments as functions; omitted ones give an unknown value."""
    return tuple(left_out if part is None else compiled(part) for part in arguments)


def calling(item: Command) -> Calling:
    """A name with its arguments as functions."""
    return Calling(item.name, evaluates(item.arguments), item.arguments, item.called, item.span)


def branching(item: OWordLine) -> Branching:
    """A control structure with its values as functions."""
    label, composed = (item.label, None) if isinstance(item.label, str) else ("", compiled(item.label))
    return Branching(item.keyword, label, tuple(map(compiled, item.arguments)), item.arguments, item.span, composed)


def lane_of(plan: SinumerikPlan) -> Lane | None:
    """The fast lane's layout of a block that is only a straight motion or an arc with plain numbers; else None."""
    template, fixed = plan.template, fixed_centre(plan.template)
    words = [word for word in template.words if not is_code(word)]
    slots = {**template.slots, **fixed, **in_form(template, "ABC", SHORTEST_WAY)}
    if len(slots) < len(words) or not all(isinstance(item, Word | Comment) for item in template.items):
        return None
    pointed = not slots.keys().isdisjoint(VECTOR)
    round_ = not slots.keys().isdisjoint(ARC_LETTERS)
    allowed = (LANE_LETTERS - set("ABC")) | set(VECTOR) if pointed else LANE_LETTERS | ARC_LETTERS
    if plan.m or plan.g not in (((), (20,), (30,)) if round_ else ((), (0,), (10,))) or not slots.keys() <= allowed:
        return None
    axes = tuple((INDEX[letter], slot) for letter, slot in slots.items() if letter in INDEX)
    i, j, k = (slots.get(letter, -1) for letter in CENTRE_LETTERS)
    motion, radius = plan.g[0] if plan.g else -1, slots.get(RADIUS, -1)
    if radius >= 0 and max(i, j, k) >= 0:
        return None
    return Lane(axes, slots.get("F", -1), motion, (i, j, k), radius, ("I" in fixed, "J" in fixed, "K" in fixed))


def fixed_centre(template: Template) -> dict[str, int]:
    """Absolute words of a centre, `I=AC(5)`: address -> slot of the number."""
    return in_form(template, CENTRE_LETTERS, ABSOLUTE)


def in_form(template: Template, letters: Container[str], form: str) -> dict[str, int]:
    """Words of some addresses with a plain number in a form, `I=AC(5)`: address -> slot of the number."""
    found = {}
    for word in template.words:
        match word.value:
            case FunctionCall(name, (Literal(slot),), indexed=False) if name == form and word.address in letters:
                found[word.address] = slot
    return found


def plain_text(expression: Expression | None) -> str | None:
    """The text of an argument that is a string; else None."""
    while isinstance(expression, Unary):
        expression = expression.operand
    return expression.value if isinstance(expression, StringLiteral) else None


def is_statement(plan: SinumerikPlan) -> bool:
    """Whether the block was not understood."""
    return STATEMENT in plan.opaque
