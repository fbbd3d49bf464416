"""Robots that MATLAB scripts make with Corke's Robotics Toolbox: read as text, never run.

What is read: assignments of numbers, matrices and transforms; ``Link``, ``Revolute``, ``Prismatic``, ``SerialLink``
and their modified kin; the properties of links and robots. What else a script does is passed over, and matters only
where a robot needs a value of it.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Mapping, Sequence
from typing import Final

from dh2sim.formats.table.matlab_expression import MatlabParser
from dh2sim.formats.table.matlab_tokens import (
    END,
    Token,
    closing_bracket,
    equals_sign,
    names_in_tokens,
    statements_of,
    tokens_of,
)
from dh2sim.formats.table.toolbox import (
    FUNCTIONS_OF_NUMBERS,
    IDENTITY,
    MAX_ITEMS,
    MAX_PROBLEMS,
    NumberArray,
    ScriptError,
    ToolboxLink,
    ToolboxRobot,
    Unknown,
    are_links,
    described,
    elementwise,
    links_in,
    loose_robot,
    number,
    numbers_of,
    pose_function,
    set_property,
    transform,
)
from dh2sim.messages import shown

LINKS: Final[Mapping[str, tuple[bool | None, bool | None]]] = {
    "Link": (None, None), "link": (None, None), "Revolute": (False, None), "Prismatic": (True, None),
    "RevoluteMDH": (False, True), "PrismaticMDH": (True, True),
}  # fmt: skip
"""Constructors of links: whether the joint is prismatic, and the row modified, as far as the name says."""
ROBOTS: Final = ("SerialLink", "robot")
"""Constructors of robots; lower case in the first toolboxes."""
MADE_IN_MATLAB: Final = re.compile(r"\b(?:Link|link|Revolute|Prismatic|RevoluteMDH|PrismaticMDH|SerialLink)\s*\(")


_SKIPPED: Final = ("for", "parfor", "while", "if", "switch")
_OPENING: Final = (*_SKIPPED, "function", "try", "classdef", "methods", "properties")
_PASSED: Final = (
    "function",
    "try",
    "catch",
    "classdef",
    "methods",
    "properties",
    "end",
    "return",
    "else",
    "endfunction",
)


def read_matlab(text: str) -> tuple[list[ToolboxRobot], list[ScriptError]]:
    """Return the robots of a script, and what of them cannot be read.

    Where links are made and no robot of them, the links are the robot.
    """
    script = _MatlabScript()
    try:
        tokens = tokens_of(text)
    except ScriptError as error:
        return [], [error]
    script.block(statements_of(tokens))
    return script.robots or script.loose_robot(), script.problems


def _block_end(statements: Sequence[Sequence[Token]], index: int) -> int:
    """Return the index behind the end of a loop or a condition."""
    depth = 0
    for stop in range(index, len(statements)):
        first, *others = statements[stop]
        if first.kind == "name":
            depth += first.text in _OPENING
            depth -= first.text in ("end", "endfor", "endif", "endwhile")
        depth += sum(token.kind == "name" and token.text in _SKIPPED for token in others)
        if depth <= 0:
            return stop + 1
    return len(statements)


def _unwrapped(tokens: Sequence[Token], sign: str) -> Sequence[Token]:
    """Return words without the brackets around those up to the first closing one, where a sign is between them."""
    if not tokens or tokens[0].text not in ("(", "["):
        return tokens
    close = closing_bracket(tokens)
    inside = tokens[1:close]
    return [*inside, *tokens[close + 1 :]] if any(token.text == sign for token in inside) else tokens


class _MatlabScript:
    """Follows the statements of a script."""

    def __init__(self) -> None:
        self.values: dict[str, object] = {}
        self.robots: list[ToolboxRobot] = []
        self.problems: list[ScriptError] = []
        self._links: list[ToolboxLink] = []
        self._turns = 0
        """Elements that loops have gone through; their number is limited, as loops in loops multiply it."""

    def block(self, statements: Sequence[Sequence[Token]]) -> None:
        """Follow statements, one after the other."""
        index = 0
        while index < len(statements) and len(self.problems) <= MAX_PROBLEMS:
            first = statements[index][0]
            if first.kind != "name" or first.text not in _SKIPPED:
                self.run(statements[index])
                index += 1
            elif first.text != "for" or (stop := self._loop(statements, index)) is None:
                index = self.skip(statements, index)
            else:
                index = stop

    def _loop(self, statements: Sequence[Sequence[Token]], index: int) -> int | None:
        """Follow a loop over numbers that are known; return the index behind its end, or None where it cannot be."""
        stop, ends = _block_end(statements, index), ("break", "continue", "return")
        if any(token.kind == "name" and token.text in ends for tokens in statements[index:stop] for token in tokens):
            return None
        try:
            tokens = _unwrapped(statements[index][1:], "=")
            if len(tokens) < 3 or tokens[0].kind != "name" or tokens[1].text != "=":
                return None
            items, rest = self._items(_unwrapped(tokens[2:], ":"))
        except (ScriptError, RecursionError):
            return None
        self._turns += len(items)
        if self._turns > MAX_ITEMS:
            return None
        if rest and rest[0].kind != "name":
            return None
        body = [*([rest] if rest else []), *statements[index + 1 : stop - 1]]
        for item in items:
            self.values[tokens[0].text] = item
            self.block(body)
        return stop

    def _items(self, tokens: Sequence[Token]) -> tuple[list[object], Sequence[Token]]:
        """Return what a loop goes through, and the words behind it.

        Raises:
            ScriptError: It is not known.
        """
        bounds: list[float] = []
        while True:
            parser = MatlabParser(self, tokens)
            value, tokens = parser.sum(), parser.rest
            if not tokens or tokens[0].text != ":":
                break
            bounds.append(number(value))
            tokens = tokens[1:]
        if not bounds:
            numbers = isinstance(value, list) and all(isinstance(item, float) for item in value)
            if not numbers:
                raise ScriptError("a loop over something else")
            return list(value) if isinstance(value, list) else [], tokens
        first, last, step = bounds[0], number(value), bounds[1] if len(bounds) > 1 else 1.0
        if len(bounds) > 2 or not all(bound.is_integer() for bound in (first, last, step)) or not step:
            raise ScriptError("a range that is not read")
        whole = range(int(first), int(last) + (1 if step > 0 else -1), int(step))
        return [float(item) for item in whole[: MAX_ITEMS + 1]], tokens

    def run(self, tokens: Sequence[Token]) -> None:
        """Follow a statement."""
        if tokens[0].kind == "name" and tokens[0].text in _PASSED:
            return
        try:
            self._statement(tokens)
        except ScriptError as error:
            if self._concerns_robots(tokens) and not error.reported:
                first = next((t for t in tokens if t.text in LINKS or t.text in ROBOTS), tokens[0])
                self.problems.append(ScriptError(str(error), error.line or first.line, error.column or first.column))
        except RecursionError:
            self.problems.append(ScriptError("nested too deep", tokens[0].line, tokens[0].column))

    def skip(self, statements: Sequence[Sequence[Token]], index: int) -> int:
        """Pass over a loop or a condition, whose values are not known then; return the index behind its end."""
        first, stop = statements[index][0], _block_end(statements, index)
        for tokens in statements[index:stop]:
            word = tokens[0].text if tokens[0].kind == "name" else ""
            if self._concerns_robots(tokens) and word not in _SKIPPED:
                place = tokens[0]
                what = "a condition" if first.text in ("if", "switch") else "a loop"
                message = f"links that are made or changed in {what} are not read: write them one after the other"
                self.problems.append(ScriptError(message, place.line, place.column))
            self._forget(tokens, first, reported=bool(self.problems))
        return stop

    def loose_robot(self) -> list[ToolboxRobot]:
        """Return the robot of all links, where a script makes none."""
        return loose_robot(self._links, self.values.values(), self.problems)

    def _concerns_robots(self, tokens: Sequence[Token]) -> bool:
        """Whether a statement makes a link or a robot, or changes one."""
        for token, following in zip(tokens, [*tokens[1:], END], strict=True):
            if (
                (token.text in LINKS or token.text in ROBOTS)
                and following.text == "("
                and token.text not in self.values
            ):
                return True
        held = self.values.get(tokens[0].text) if tokens[0].kind == "name" else None
        changes = len(tokens) > 2 and any(token.text == "=" for token in tokens)
        if isinstance(held, ToolboxRobot):
            return changes and bool(names_in_tokens(tokens) & {"base", "tool", "links", "offset", "qlim"})
        return changes and (isinstance(held, ToolboxLink) or are_links(held))

    def _forget(self, tokens: Sequence[Token], first: Token, *, reported: bool) -> None:
        """Make unknown what a statement that is passed over may assign."""
        what = "condition" if first.text in ("if", "switch") else "loop"
        if not any(token.text == "=" for token in tokens):
            return
        for token, following in zip(tokens, [*tokens[1:], END], strict=True):
            kept = isinstance(self.values.get(token.text), ToolboxLink | ToolboxRobot | list)
            if token.kind == "name" and (following.text == "=" or token is tokens[0]) and not kept:
                self.values[token.text] = Unknown(
                    f"{shown(token.text)} is set in the {what} on line {first.line}, which is not followed",
                    reported=reported,
                )

    def _statement(self, tokens: Sequence[Token]) -> None:
        equals = equals_sign(tokens)
        if tokens[0].text in ("clear", "clearvars"):
            for name in {token.text for token in tokens[1:]} & self.values.keys() if len(tokens) > 1 else ():
                del self.values[name]
        elif equals is None and self._concerns_robots(tokens):
            self.value(tokens)
        if equals is None:
            return
        target = tokens[:equals]
        try:
            value = self.value(tokens[equals + 1 :])
        except ScriptError as error:
            if self._concerns_robots(tokens):
                with contextlib.suppress(ScriptError):
                    self._assign(target, Unknown(str(error), reported=True))
                raise
            value = Unknown(f"{shown(target[0].text)} on line {target[0].line} cannot be read: {error}")
        if isinstance(value, ToolboxLink):
            value.line, value.column = target[0].line, target[0].column
        self._assign(target, value)

    def value(self, tokens: Sequence[Token]) -> object:
        """Return the value of an expression."""
        parser = MatlabParser(self, tokens)
        value = parser.sum()
        if parser.next is not END:
            raise ScriptError(f"unexpected {shown(parser.next.text)}", parser.next.line, parser.next.column)
        return value

    def _assign(self, target: Sequence[Token], value: object) -> None:
        name = target[0].text
        if target[0].kind != "name":
            return
        if len(target) == 1:
            self.values[name] = value
            return
        rest = list(target[1:])
        holder: object = self.values.get(name)
        if isinstance(holder, ToolboxRobot) and [t.text for t in rest[:2]] == [".", "links"] and len(rest) > 2:
            holder, rest = holder.links, rest[2:]
        if rest[0].text in ("(", "{"):
            close = closing_bracket(rest)
            index = self._index(rest[1:close], holder)
            rest = rest[close + 1 :]
            if not rest:
                self._put(name, holder, index, value)
                return
            if not isinstance(holder, list) or not isinstance(index, int) or not 0 < index <= len(holder):
                if are_links(holder):
                    raise ScriptError(f"{shown(name)} has no such link")
                return
            holder = holder[index - 1]
        if len(rest) == 2 and rest[0].text == ".":
            self._set_field(name, holder, rest[1].text, value)

    def _index(self, tokens: Sequence[Token], holder: object) -> int | None:
        size = len(holder) if isinstance(holder, list) else 0
        parser = MatlabParser(self, tokens, end=float(size))
        try:
            index = number(parser.sum())
        except ScriptError:
            return None
        return int(index) if parser.next is END and index == int(index) else None

    def _put(self, name: str, holder: object, index: int | None, value: object) -> None:
        held = holder if isinstance(holder, list) else NumberArray()
        if index is None or not 0 < index <= MAX_ITEMS:
            if isinstance(value, ToolboxLink) or are_links(held):
                raise ScriptError("the index of the link cannot be read")
            self.values[name] = Unknown(f"{shown(name)} is assigned at an index that cannot be read")
            return
        while len(held) < index:
            held.append(Unknown(f"element {len(held) + 1} of {shown(name)} is not given"))
        held[index - 1] = value
        self.values[name] = held

    def _set_field(self, name: str, holder: object, key: str, value: object) -> None:
        if isinstance(holder, ToolboxLink):
            set_property(holder, key, value)
        elif isinstance(holder, ToolboxRobot):
            _set_on_robot(holder, key, value)
        else:
            self.values[f"{name}.{key}"] = value

    def call(self, token: Token, arguments: list[object]) -> object:
        """Return what a function gives."""
        name = token.text
        if name in LINKS:
            link = _link(token, arguments)
            self._links.append(link)
            return link
        if name in ROBOTS and arguments:
            robot = _robot(token, arguments)
            self.robots.append(robot)
            return robot
        pose = pose_function(name, arguments, {"order": ""})
        if pose is not None:
            return pose
        if name in FUNCTIONS_OF_NUMBERS and arguments:
            return elementwise(FUNCTIONS_OF_NUMBERS[name], *arguments)
        if name in _SIZES and arguments and isinstance(arguments[0], list):
            return _size(name, arguments)
        if name in ("zeros", "ones") and arguments and 0 < (size := number(arguments[-1])) <= MAX_ITEMS:
            return NumberArray([float(name == "ones")] * int(size))
        if name in ("inches", "inch") and len(arguments) == 1:
            return number(arguments[0]) * 0.0254
        return Unknown(f"the function {shown(name)} on line {token.line} is not known")


_SIZES: Final = ("size", "length", "numel", "numrows", "rows", "numcols", "columns", "height", "width")


def _size(name: str, arguments: Sequence[object]) -> object:
    """Return how many rows, columns or elements a matrix has."""
    held = arguments[0]
    assert isinstance(held, list)
    nested = bool(held) and isinstance(held[0], list)
    rows = len(held) if nested else 1
    columns = len(held[0]) if nested else len(held)
    match name:
        case "numel":
            return float(rows * columns)
        case "length":
            return float(max(rows, columns) if rows and columns else 0)
        case "size" if len(arguments) == 1:
            return NumberArray([float(rows), float(columns)])
        case "size":
            return float({1.0: rows, 2.0: columns}.get(number(arguments[1]), 1))
        case "numrows" | "rows" | "height":
            return float(rows)
        case _:
            return float(columns)


_VECTOR: Final = ("theta", "d", "a", "alpha", "sigma", "offset")
_OLD_VECTOR: Final = ("alpha", "a", "theta", "d", "sigma")
"""Of ``link([alpha A theta D sigma])`` in the first toolboxes."""


def _link(token: Token, arguments: Sequence[object]) -> ToolboxLink:
    prismatic, modified = LINKS[token.text]
    link = ToolboxLink(line=token.line, column=token.column, prismatic=prismatic, modified=modified)
    rest = list(arguments)
    try:
        if rest and isinstance(vector := rest[0], list):
            rest = rest[1:]
            _set_vector(link, vector, _OLD_VECTOR if token.text == "link" else _VECTOR)
        while rest:
            key = rest.pop(0)
            if not isinstance(key, str):
                raise ScriptError(f"expected the name of a property, found {described(key)}")
            match key.lower():
                case "standard" | "sta" | "stddh":
                    link.modified = False
                case "modified" | "mod" | "moddh":
                    link.modified = True
                case "revolute":
                    link.prismatic = False
                case "prismatic":
                    link.prismatic = True
                case "flip":
                    link.flip = True
                    if rest and not isinstance(rest[0], str):
                        set_property(link, "flip", rest.pop(0))
                case "sym" | "fast" | "nofast":
                    continue
                case _:
                    if not rest:
                        raise ScriptError(f"{shown(key)} has no value")
                    set_property(link, key, rest.pop(0))
    except ScriptError as error:
        raise ScriptError(
            str(error), error.line or token.line, error.column or token.column, reported=error.reported
        ) from None
    return link


def _set_vector(link: ToolboxLink, values: list[object], names: Sequence[str]) -> None:
    if len(values) < 4:
        raise ScriptError(f"a link has at least four numbers, theta, d, a and alpha; found {len(values)}")
    sigma = values[4] if len(values) > 4 else 0.0
    link.prismatic = number(sigma) == 1
    coordinate = "d" if link.prismatic else "theta"
    for name, value in zip(names, values, strict=False):
        if name != "sigma" and not (name == coordinate and isinstance(value, Unknown)):
            set_property(link, name, value)
    if len(values) > len(names):
        link.unused.add("what follows the kinematic numbers")


def _robot(token: Token, arguments: Sequence[object]) -> ToolboxRobot:
    first, rest = arguments[0], list(arguments[1:])
    if isinstance(first, list) and first and not are_links(first) and not isinstance(first[0], Unknown):
        rows = first if isinstance(first[0], list) else [first]
        links = []
        for row in rows:
            link = ToolboxLink(line=token.line, column=token.column)
            _set_vector(link, row if isinstance(row, list) else [row], _VECTOR)
            links.append(link)
    else:
        links = links_in(first)
    robot = ToolboxRobot(line=token.line, column=token.column, links=links)
    while rest:
        key = rest.pop(0)
        if not isinstance(key, str):
            raise ScriptError(f"expected the name of an option, found {described(key)}")
        if key.lower() in ("modified", "standard"):
            for link in links:
                link.modified = key.lower() == "modified"
        elif rest and key not in ("fast", "nofast"):
            _set_on_robot(robot, key, rest.pop(0))
    return robot


def _set_on_robot(robot: ToolboxRobot, key: str, value: object) -> None:
    match key:
        case "name" if isinstance(value, str):
            robot.name = value
        case "base" | "tool":
            try:
                T = transform(value)
            except ScriptError as error:
                raise ScriptError(f"{key}: {error}", reported=error.reported) from None
            if key == "base":
                robot.base = None if T == IDENTITY else T
            else:
                robot.tool = None if T == IDENTITY else T
        case "offset" | "qlim":
            values = value if isinstance(value, list) else [value]
            if key == "offset":
                values = [float(v) for v in numbers_of(values)]
            if len(values) != len(robot.links):
                raise ScriptError(f"{key} has {len(values)} values for {len(robot.links)} links")
            for link, one in zip(robot.links, values, strict=True):
                set_property(link, key, one)
        case _:
            pass
