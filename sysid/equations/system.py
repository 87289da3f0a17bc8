"""Equations read: which names are states and definitions, what is left for inputs, and what cannot be."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Mapping as Dict
from dataclasses import dataclass
from functools import cached_property

from sysid.equations.functions import CONSTANTS, FUNCTIONS, OWN
from sysid.equations.parser import RESERVED, parse
from sysid.equations.syntax import (
    CONTINUOUS,
    DEFINITION,
    DISCRETE,
    Call,
    Delayed,
    Equation,
    Name,
    Node,
    equation_error,
    nodes_of,
)
from sysid.errors import ConfigError, did_you_mean, near_words

MOST_STATES = 100
"""States with a name."""


@dataclass(frozen=True, kw_only=True)
class System:
    """Equations whose names are sorted.

    Args:
        text: As they are written.
        equations: In the order in which they stand.
        parameters: Names of parameters.
        tables: Names of tables.
    """

    text: str
    equations: tuple[Equation, ...]
    parameters: tuple[str, ...]
    tables: tuple[str, ...] = ()

    @classmethod
    def read(cls, text: str, parameters: Iterable[str], tables: Iterable[str] = ()) -> System:
        """Read equations and check that their names go together.

        Args:
            text: The equations.
            parameters: Names of parameters.
            tables: Names of tables.

        Returns:
            The system.

        Raises:
            ConfigError: With line and column, of whatever is wrong.

        Example:
            >>> system = System.read("dx/dt = -x/tau + u; y = 2*x", ["tau"])
            >>> system.continuous, system.others
            (('x',), ('u',))
        """
        found = cls(text=text, equations=parse(text), parameters=tuple(parameters), tables=tuple(tables))
        found._check_left_sides()
        found._check_calls()
        found._check_used()
        assert len(found.order) == len(found.definitions)  # noqa: S101 - asked for here so that circles are told now
        return found

    def _named(self, kind: str) -> tuple[str, ...]:
        return tuple(one.name for one in self.equations if one.kind == kind)

    @cached_property
    def continuous(self) -> tuple[str, ...]:
        """States with a rate."""
        return self._named(CONTINUOUS)

    @cached_property
    def discrete(self) -> tuple[str, ...]:
        """States with a value at the next sample."""
        return self._named(DISCRETE)

    @cached_property
    def states(self) -> tuple[str, ...]:
        """All states with a name, those with a rate first."""
        return self.continuous + self.discrete

    @cached_property
    def definitions(self) -> Dict[str, Equation]:
        """What is computed from other things, by name."""
        return {one.name: one for one in self.equations if one.kind == DEFINITION}

    @cached_property
    def others(self) -> tuple[str, ...]:
        """Names that are read and nothing says what they are: inputs, in the order in which they are read first."""
        known = {*self.states, *self.definitions, *self.parameters}
        return tuple(dict.fromkeys(name for name, _ in self._reads if name not in known))

    @cached_property
    def _reads(self) -> tuple[tuple[str, int], ...]:
        return tuple(
            (node.name, node.at)
            for one in self.equations
            for node in _in_order(one.right)
            if isinstance(node, Name | Delayed)
        )

    def where_read(self, name: str) -> int:
        """Where a name is read first, in characters.

        Args:
            name: The name.

        Returns:
            The place; 0 for one that is not read.
        """
        return next((at for one, at in self._reads if one == name), 0)

    def check_names(self, inputs: tuple[str, ...], outputs: tuple[str, ...]) -> None:
        """Refuse inputs that are not there, and outputs that nothing computes.

        Args:
            inputs: Channels that go in.
            outputs: Channels that come out.

        Raises:
            ConfigError: Naming the first that does not fit.
        """
        computed = (*self.states, *self.definitions)
        for name in inputs:
            if name in (*computed, *self.parameters):
                raise ConfigError(
                    f"the input {name} is computed by the equations, or a parameter of theirs",
                    where="equations",
                    expected="inputs that the equations only read",
                    got=name,
                    remedy=f"rename {name} in the equations, or leave it out of the mapping's inputs",
                )
        for name in outputs:
            if name not in computed:
                near = near_words(name, computed)
                raise ConfigError(
                    f"no equation computes the output {name}",
                    where="equations",
                    expected=f"a state or a definition named {name}",
                    got=", ".join(computed),
                    remedy=f"add the equation {written_name(name)} = {near[0] if near else computed[0]}",
                )
        for name in self.others:
            if name not in inputs:
                known = (*inputs, *computed, *self.parameters)
                near = near_words(name, known)
                raise equation_error(
                    f"nothing says what {name} is",
                    self.text,
                    self.where_read(name),
                    expected="one of " + ", ".join(known),
                    got=name,
                    remedy=(f"did you mean {near[0]}? If not, " if near else "")
                    + f"add {name}: 1 to the parameters, or {name} to the mapping's inputs",
                )

    def _check_left_sides(self) -> None:
        seen: set[str] = set()
        if len(self.states) > MOST_STATES:
            raise ConfigError(
                "too many states", where="equations", expected=f"at most {MOST_STATES}", got=len(self.states)
            )
        for one in self.equations:
            own = {*self.tables} if self.text[one.at] == '"' else {*WORDS, *self.tables}
            if one.name in own:
                raise equation_error(
                    f"{one.name} is a word of the language, or a table",
                    self.text,
                    one.at,
                    expected="another name",
                    remedy=f'write for example {one.name}_ in its place, everywhere, or "{one.name}" in double quotes',
                )
            if one.name in seen:
                raise equation_error(
                    f"{one.name} has two equations",
                    self.text,
                    one.at,
                    expected="one equation for each name",
                    remedy="remove one of them, or rename what it computes",
                )
            if one.name in self.parameters:
                raise equation_error(
                    f"{one.name} is a parameter and has an equation",
                    self.text,
                    one.at,
                    expected="one or the other",
                    remedy=f"remove {one.name} from the parameters, or the equation",
                )
            seen.add(one.name)
        for name in (*self.parameters, *self.tables):
            if name in WORDS:
                raise ConfigError(
                    f"{name} is a word of the language",
                    where="parameters" if name in self.parameters else "tables",
                    expected="another name",
                    got=name,
                    remedy=f"write for example {name}_ in its place, in the equations too",
                )

    def _check_calls(self) -> None:
        """Refuse functions that there are not, and arguments that do not go with them."""
        for one in self.equations:
            for node in nodes_of(one.right):
                if isinstance(node, Call):
                    self._check_call(node)

    def _check_call(self, node: Call) -> None:
        name, n = node.function, len(node.arguments)
        if name in OWN:
            return  # checked where they are lowered: each takes its own
        if name in self.tables or name in FUNCTIONS:
            wanted = ("x",) if name in self.tables else FUNCTIONS[name].arguments
            more = name in FUNCTIONS and FUNCTIONS[name].more
            given = [option for option, _ in node.options]
            if n + len(given) < len(wanted) or (n + len(given) > len(wanted) and not (more and not given)):
                raise equation_error(
                    f"{name} takes {len(wanted)} argument{'s' * (len(wanted) != 1)}{' or more' * more}",
                    self.text,
                    node.at,
                    expected=f"{name}({', '.join(wanted)})",
                    remedy="give it those",
                )
            if given != list(wanted[n : n + len(given)]):
                raise equation_error(
                    f"{name} has no such option here",
                    self.text,
                    node.at,
                    expected=f"{name}({', '.join(wanted)})",
                    remedy=f"leave the names out: {name}({', '.join(wanted)})",
                )
            return
        known = (*FUNCTIONS, *self.tables)
        value = name in {*self.states, *self.definitions, *self.parameters}
        raise equation_error(
            f"there is no function {name}",
            self.text,
            node.at,
            expected="one of " + ", ".join(known),
            remedy=f"write {name}*(...) for a product" if value else did_you_mean(
                name, known, "write * between factors, or give a table of that name in tables"
            ),
        )  # fmt: skip

    def _check_used(self) -> None:
        read = {name for name, _ in self._reads}
        for name in self.parameters:
            if name not in read:
                raise ConfigError(
                    f"no equation reads the parameter {name}",
                    where="parameters",
                    expected="parameters that the equations read",
                    got=name,
                    remedy=did_you_mean(name, self.others, f"remove {name} from the parameters"),
                )

    @cached_property
    def order(self) -> tuple[str, ...]:
        """Definitions, each after those that it reads now.

        Raises:
            ConfigError: If some need each other.
        """
        done: dict[str, None] = {}

        def visit(name: str, path: tuple[str, ...]) -> None:
            if name in done or name not in self.definitions:
                return
            if name in path:
                circle = (*path[path.index(name) :], name)
                raise equation_error(
                    f"{name} needs itself: {' -> '.join(circle)}",
                    self.text,
                    self.definitions[name].at,
                    expected="definitions that can be computed one after the other",
                    remedy="solve them for it, make one of them a state, or read it a sample ago, as in "
                    f"{written_name(name)}[k-1]",
                )
            for node in nodes_of(self.definitions[name].right):
                if isinstance(node, Name) or (isinstance(node, Delayed) and node.lag == 0.0):
                    visit(node.name, (*path, name))
            done[name] = None

        if len(self.definitions) > MOST_DEFINITIONS:
            raise ConfigError(
                "too many definitions", where="equations", expected=f"at most {MOST_DEFINITIONS}",
                got=len(self.definitions), remedy="put some into others",
            )  # fmt: skip
        for name in self.definitions:
            visit(name, ())
        return tuple(done)


MOST_DEFINITIONS = 300
"""Names that are computed from others: they may need each other in a row."""


WORDS = frozenset({*FUNCTIONS, *CONSTANTS, *RESERVED})
"""Words of the language: in double quotes they are names like any other."""


def written_name(name: str) -> str:
    """A name as an equation has it: in double quotes where it is no plain word, or one of the language's own.

    Args:
        name: The name.

    Returns:
        It, as it is written.

    Example:
        >>> print(*map(written_name, ("flow", "P 1", "max", 'a"b')))
        flow "P 1" "max" "a""b"
    """
    return name if name.isidentifier() and name not in WORDS else '"' + name.replace('"', '""') + '"'


def as_term(value: float) -> str:
    """A number as it stands in a term, in brackets where it has a sign.

    Args:
        value: The number.

    Returns:
        The text, with 13 digits.

    Example:
        >>> as_term(0.5), as_term(-2.0)
        ('0.5', '(-2)')
    """
    text = f"{value:.13g}"
    return f"({text})" if text.startswith("-") else text


def _in_order(node: Node) -> list[Node]:
    """A tree's nodes from left to right."""
    return sorted(nodes_of(node), key=lambda one: one.at)
