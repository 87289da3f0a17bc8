"""From text to equations: operator precedence by binding power (Pratt 1973, "Top down operator precedence").

Nothing of the text is evaluated, and no name of it is looked up anywhere: what a name means is for
:mod:`sysid.equations.system` to say.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from sysid.equations.functions import CONSTANTS, FUNCTIONS
from sysid.equations.lexer import Word, words_of
from sysid.equations.syntax import (
    CONTINUOUS,
    DEFINITION,
    DISCRETE,
    Call,
    Delayed,
    Equation,
    Name,
    Node,
    Number,
    Operation,
    equation_error,
)
from sysid.errors import ConfigError

DEEPEST = 60
"""Brackets and signs within each other."""
SAMPLE, TIME = "k", "t"
"""How the number of a sample, and the time, are written: in ``x[k-1]`` and ``u(t - 0.5)``."""

BINDING = {
    "or": 1, "and": 2, "<": 4, "<=": 4, ">": 4, ">=": 4, "==": 4, "!=": 4,
    "+": 5, "-": 5, "*": 6, "/": 6, "^": 8, "**": 8,
}  # fmt: skip
"""How much each operator between two expressions binds."""
_NOT, _MINUS = 3, 7
_COMPARING = 4
_VALUE = "a number, a name, a function or a bracket"
RESERVED = frozenset({"and", "or", "not", TIME, "dt"})
"""Words that name nothing."""
_RATE = re.compile(r"d(\w+)")


def parse(text: str) -> tuple[Equation, ...]:
    """Read equations.

    Args:
        text: One a line: ``dx/dt = ...``, ``x[k+1] = ...`` or ``y = ...``.

    Returns:
        The equations in order.

    Raises:
        ConfigError: Where the text is none, with line and column.

    Example:
        >>> [(one.kind, one.name) for one in parse("dx/dt = -x/tau + u(t - 0.5); y = 2*x")]
        [('d/dt', 'x'), ('=', 'y')]
    """
    parser = _Parser(text=text, words=words_of(text))
    found = []
    while parser.place < len(parser.words) - 1 or parser.now.kind != "end":
        found.append(parser.equation())
        parser.skip_end()
        if parser.place >= len(parser.words):
            break
    if not found:
        raise ConfigError(
            "there is no equation",
            where="equations",
            expected="one a line, such as dx/dt = -x/tau + u",
            got=repr(text[:40]),
            remedy="write the equations of the states and of the output",
        )
    return tuple(found)


@dataclass(kw_only=True)
class _Parser:
    text: str
    words: list[Word]
    place: int = field(default=0)
    depth: int = field(default=0)

    @property
    def now(self) -> Word:
        return self.words[min(self.place, len(self.words) - 1)]

    def ahead(self, n: int) -> Word:
        return self.words[min(self.place + n, len(self.words) - 1)]

    def take(self) -> Word:
        word = self.now
        self.place += 1
        return word

    def wrong(self, what: str, word: Word, *, expected: str, remedy: str) -> ConfigError:
        return equation_error(what, self.text, word.at, expected=expected, remedy=remedy)

    def sign(self, text: str, *, after: str) -> Word:
        word = self.take()
        if word.kind != "sign" or word.text != text:
            got = "the end of the equation" if word.kind == "end" else repr(word.text)
            raise self.wrong(
                f"{got} where {text!r} belongs", word, expected=f"{text} after {after}", remedy=f"write {text} there"
            )
        return word

    def skip_end(self) -> None:
        if self.now.kind == "end":
            self.place += 1
            return
        raise self.wrong(
            f"{self.now.text!r} does not go on the equation",
            self.now,
            expected="an operator, or the end of the equation",
            remedy="write * between factors, and one equation a line or a ; between two",
        )

    # Left sides

    def equation(self) -> Equation:
        """One equation, from its left side to its end."""
        first = self.now
        kind, name = self._left()
        self.sign("=", after="the left side")
        return Equation(kind=kind, name=name, right=self.expression(0), at=first.at)

    def _left(self) -> tuple[str, str]:
        first = self.take()
        if first.kind == "name" and first.text == "der" and self.now.text == "(":
            self.take()
            name = self._named()
            self.sign(")", after="the state")
            return CONTINUOUS, name
        if first.kind == "name" and first.text == "d" and self.now.kind == "quoted" and self.ahead(2).text == "dt":
            name = self.take().text
            self.sign("/", after="the state")
            self.take()
            return CONTINUOUS, name
        rate = _RATE.fullmatch(first.text) if first.kind == "name" else None
        if rate is not None and self.now.text == "/" and self.ahead(1).text == "dt":
            self.place += 2
            return CONTINUOUS, rate.group(1)
        if first.kind not in {"name", "quoted"} or (first.kind == "name" and first.text in RESERVED):
            raise self.wrong(
                "an equation does not begin so",
                first,
                expected="dx/dt = ..., x[k+1] = ..., or y = ..., x and y being names",
                remedy="write what is computed on the left side of =",
            )
        if self.now.text == "[":
            lag = self._index()
            if lag not in {-1, 0}:
                raise self.wrong(
                    "a left side is now or the next sample",
                    first,
                    expected=f"{first.text}[k+1] = ... or {first.text} = ...",
                    remedy="write the equation for the sample k+1, and shift its right side likewise",
                )
            return (DISCRETE if lag == -1 else DEFINITION), first.text
        if self.now.text == "(" and self.ahead(1).text == TIME and self.ahead(2).text == ")":
            self.place += 3
        return DEFINITION, first.text

    def _named(self) -> str:
        word = self.take()
        if word.kind not in {"name", "quoted"}:
            raise self.wrong("no name", word, expected="the name of a state", remedy="write for example der(x) = ...")
        return word.text

    # Right sides

    def expression(self, binding: int) -> Node:
        """An expression whose operators bind more than so much."""
        first = self.now
        self.depth += 1
        if self.depth > DEEPEST:
            raise self.wrong(
                "the expression is too deep",
                first,
                expected=f"at most {DEEPEST} brackets and signs within each other",
                remedy="give parts of it names, in equations of their own",
            )
        left = self._prefix()
        while True:
            word = self.now
            power = BINDING.get(word.text, 0) if word.kind in {"sign", "name"} else 0
            if power <= binding:
                break
            self.take()
            left = self._operation(word, left, power)
        self.depth -= 1
        return left

    def _operation(self, word: Word, left: Node, power: int) -> Node:
        if word.text in {"==", "!="}:
            raise self.wrong(
                f"{word.text} between real numbers",
                word,
                expected="<, <=, > or >=",
                remedy="compare with a tolerance, as in abs(a - b) < 0.5",
            )
        right_first = word.text in {"^", "**"}
        right = self.expression(power - 1 if right_first else power)
        if power == _COMPARING and self.now.text in BINDING and BINDING[self.now.text] == _COMPARING:
            raise self.wrong(
                "two comparisons in a row",
                self.now,
                expected="a and between them",
                remedy="write a < b and b < c",
            )
        operator = "^" if right_first else word.text
        return Operation(operator=operator, operands=(left, right), at=word.at)

    def _prefix(self) -> Node:
        word = self.take()
        if word.kind == "number":
            value = float(word.text)
            if value == float("inf"):
                raise self.wrong("the number is too large", word, expected="below 1.8e308", remedy="correct it")
            return Number(value=value, at=word.at)
        if word.text == "(" and word.kind == "sign":
            inside = self.expression(0)
            self.sign(")", after="what ( opened")
            return inside
        if word.text == "-" and word.kind == "sign":
            return Operation(operator="-", operands=(self.expression(_MINUS),), at=word.at)
        if word.text == "+" and word.kind == "sign":
            return self.expression(_MINUS)
        if word.text == "not" and word.kind == "name":
            return Operation(operator="not", operands=(self.expression(_NOT),), at=word.at)
        if word.kind == "quoted" or (word.kind == "name" and word.text not in RESERVED):
            return self._name(word)
        if word.text == TIME:
            raise self._no_time(word)
        got = "the equation ends" if word.kind == "end" else f"{word.text!r} stands"
        raise self.wrong(
            f"{got} where a value belongs",
            word,
            expected=_VALUE,
            remedy="complete the expression, or remove the operator before it",
        )

    def _no_time(self, word: Word) -> ConfigError:
        return self.wrong(
            f"{word.text!r} stands where a value belongs",
            word,
            expected=_VALUE,
            remedy=f"{TIME} stands in delays only, as in u({TIME} - 0.5); give a time that is needed as an input",
        )

    def _name(self, word: Word) -> Node:
        if self.now.text == "[" and self.now.kind == "sign":
            lag = self._index()
            if lag < 0:
                raise self.wrong(
                    "the right side reads a sample that is not there yet",
                    word,
                    expected=f"{word.text}[k], {word.text}[k-1] and so on",
                    remedy="shift both sides of the equation by a sample",
                )
            return Delayed(name=word.text, lag=float(lag), seconds=False, at=word.at)
        if self.now.text != "(" or self.now.kind != "sign":
            if word.kind == "name" and word.text in CONSTANTS:
                return Number(value=CONSTANTS[word.text], at=word.at)
            return Name(name=word.text, at=word.at)
        self.take()
        if self.now.text == TIME and self.now.kind == "name":
            return self._past(word)
        return self._call(word)

    def _past(self, word: Word) -> Node:
        """``u(t)`` or ``u(t - 0.5)``, from ``t`` on."""
        time = self.take()
        if word.kind == "name" and word.text in FUNCTIONS:
            raise self._no_time(time)
        if self.now.text == ")":
            self.take()
            return Name(name=word.text, at=word.at)
        minus, number = self.take(), self.take()
        if minus.text != "-" or number.kind != "number":
            raise self.wrong(
                "a delay is a number of seconds",
                minus if minus.text != "-" else number,
                expected=f"{word.text}({TIME} - 0.5)",
                remedy="write the seconds as a number; a delay is not estimated, compare fits with several",
            )
        self.sign(")", after="the delay")
        return Delayed(name=word.text, lag=float(number.text), seconds=True, at=word.at)

    def _index(self) -> int:
        """``[k]``, ``[k-2]``: samples ago; ``[k+1]`` is -1."""
        opened = self.take()
        name = self.take()
        lag = 0
        if self.now.text in {"+", "-"}:
            sign, number = self.take(), self.take()
            if number.kind != "number" or not number.text.isdigit() or len(number.text) > 6:
                raise self.wrong("no number of samples", number, expected="[k-1]", remedy="write a whole number")
            lag = int(number.text) * (1 if sign.text == "-" else -1)
        if name.text != SAMPLE:
            raise self.wrong(
                "an index is a sample", name, expected="[k], [k-1], or [k+1] on the left", remedy="write it so"
            )
        self.sign("]", after=f"what {opened.text} opened")
        return lag

    def _call(self, word: Word) -> Node:
        arguments: list[Node] = []
        options: list[tuple[str, Node]] = []
        while not (self.now.text == ")" and self.now.kind == "sign"):
            if self.now.kind == "name" and self.ahead(1).text == "=":
                name = self.take().text
                self.take()
                options.append((name, self.expression(0)))
            elif options:
                raise self.wrong(
                    "an argument after an option",
                    self.now,
                    expected=f"{word.text}(x, name=value)",
                    remedy="put the options last",
                )
            else:
                arguments.append(self.expression(0))
            if self.now.text in {",", ";"} and self.now.kind == "sign":
                self.take()
            elif self.now.text != ")":
                raise self.wrong(
                    f"the arguments of {word.text} do not end",
                    self.now,
                    expected=", or ) after an argument",
                    remedy="close the bracket, or write * between factors",
                )
        self.sign(")", after="the arguments")
        return Call(function=word.text, arguments=tuple(arguments), options=tuple(options), at=word.at)
