"""Expressions in the Verilog that Yosys writes, with the rules of width and sign of Verilog."""

import re
from dataclasses import dataclass, field

from fpga.rewrite.syntax import Declaration, spaced

LEX = re.compile(
    r"\s*(\d+'s?[bdho][0-9a-fA-FxXzZ_?]+|\$signed|\\\S+|[A-Za-z_]\w*|\d+"
    r"|>>>|<<<|===|!==|==|!=|<=|>=|<<|>>|&&|\|\||[-+*/%&|^~!<>?:(){}\[\],])"
)
MODULAR = {"+", "-", "*", "&", "|", "^", "~", "?"}
"""Whose lowest bits depend on the lowest bits of their operands only."""

COMPARES = {"==", "!=", "<", ">", "<=", ">=", "===", "!=="}
SHIFTS = {"<<", ">>", ">>>", "<<<"}
LOGIC = {"&&", "||"}
BINARY = {"+", "-", "*", "/", "%", "&", "|", "^", *COMPARES, *SHIFTS, *LOGIC}


@dataclass
class Expression:
    """An operator and its operands; or an atom, `text`, of which `name` is the signal if whole."""

    operator: str
    operands: list["Expression"] = field(default_factory=list)
    text: str = ""
    width: int = 0
    signed: bool = False
    name: str = ""

    def __str__(self) -> str:
        parts = [str(x) if x.operator in ("", "{", "$") else f"({x})" for x in self.operands]
        match self.operator:
            case "":
                return self.text
            case "{":
                return "{ " + ", ".join(map(str, self.operands)) + " }"
            case "$":
                return f"$signed({self.operands[0]})"
            case "?":
                return f"{parts[0]} ? {parts[1]} : {parts[2]}"
            case "!" if self.operands[0].width > 1:
                return f"{parts[0]} == {self.operands[0].width}'h0"
            case _ if len(parts) == 1:
                return f"{self.operator[-1]}{parts[0]}"
            case _:
                return f"{parts[0]} {self.operator} {parts[1]}"

    def measured(self) -> "Expression":
        """Width and sign as they are by itself, given those of the operands."""
        widths = [x.width for x in self.operands]
        match self.operator:
            case "":
                return self
            case "{":
                self.width = sum(widths)
            case "$":
                self.width, self.signed = widths[0], True
            case "?":
                self.width = max(widths[1:])
                self.signed = all(x.signed for x in self.operands[1:])
            case op if op in COMPARES or op in LOGIC or op == "!" or op[0] == "r":
                self.width = 1
            case op if op in SHIFTS:
                self.width, self.signed = widths[0], self.operands[0].signed
            case _:
                self.width = max(widths)
                self.signed = all(x.signed for x in self.operands)
        return self

    def contexts(self, around: int) -> list[int]:
        """For each operand the width that it is extended to; 0 where that is its own.

        `around` is that of this expression; 0 where that is its own.
        """
        here = max(around, self.width)
        match self.operator:
            case "{" | "$" | "!":
                return [0] * len(self.operands)
            case op if op[0] == "r" or op in LOGIC:
                return [0] * len(self.operands)
            case op if op in COMPARES:
                return [max(x.width for x in self.operands)] * 2
            case op if op in SHIFTS:
                return [here, 0]
            case "?":
                return [0, here, here]
            case _:
                return [here] * len(self.operands)


class Parser:
    """Parses what stands at the right of an assignment: at most one operator around atoms.

    Yosys puts no parentheses; so an expression has one level, but for concatenations.
    """

    def __init__(self, signals: dict[str, Declaration]):
        self.signals = signals

    def parse(self, text: str) -> Expression | None:
        """The expression; None where it is of another kind."""
        self.tokens, end = [], 0
        while match := LEX.match(text, end):
            self.tokens.append(match[1])
            end = match.end()
        if text[end:].strip():
            return None
        self.at = 0
        try:
            found = self._expression()
        except (KeyError, IndexError):
            return None
        return found if self.at == len(self.tokens) else None

    def _peek(self) -> str:
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def _next(self) -> str:
        self.at += 1
        return self.tokens[self.at - 1]

    def _expression(self) -> Expression:
        if self._peek() in ("~", "!", "-", "|", "&", "^", "+"):
            operator = self._next()
            # `| x` is a reduction, of which the operator has an r before it.
            operator = f"r{operator}" if operator in "|&^" else operator
            return Expression(operator, [self._atom()]).measured()
        first = self._atom()
        operator = self._peek()
        if operator == "?":
            self._next()
            second = self._atom()
            if self._next() != ":":
                raise KeyError
            return Expression("?", [first, second, self._atom()]).measured()
        if operator in BINARY:
            self._next()
            return Expression(operator, [first, self._atom()]).measured()
        return first

    def _atom(self) -> Expression:
        token = self._next()
        if token == "$signed":
            self._next()
            inner = self._atom()
            if self._next() != ")":
                raise KeyError
            return Expression("$", [inner]).measured()
        if token == "{":
            return self._concatenation()
        if "'" in token:
            return Expression("", text=token, width=int(token.split("'")[0]), signed="'s" in token)
        signal = self.signals[token]
        if self._peek() != "[":
            if signal.rest.startswith("["):
                raise KeyError
            return Expression("", text=spaced(token), width=signal.width, name=token)
        return self._slice(token, signal)

    def _slice(self, token: str, signal: Declaration) -> Expression:
        self._next()  # the bracket
        inside: list[str] = []
        while (part := self._next()) != "]" or inside.count("[") > inside.count("]"):
            inside.append(part)
        numbers = "".join(inside).split(":")
        index = "".join(map(spaced, inside))
        text = f"{spaced(token)}[{index}]"
        if signal.rest.startswith("["):
            return Expression("", text=text, width=signal.width)
        if not all(number.isdigit() for number in numbers):
            raise KeyError  # indexed by a signal
        width = int(numbers[0]) - int(numbers[-1]) + 1
        return Expression("", text=text, width=width)

    def _concatenation(self) -> Expression:
        parts = []
        if self._peek().isdigit():  # a repetition
            count = int(self._next())
            inner = self._atom()
            if self._next() != "}":
                raise KeyError
            text = f"{{{count}{inner}}}"
            return Expression("", text=text, width=count * inner.width)
        while True:
            parts.append(self._atom())
            if (separator := self._next()) == "}":
                return Expression("{", parts).measured()
            if separator != ",":
                raise KeyError
