"""Robots that Python scripts make with Corke's Robotics Toolbox: read as text with ``ast``, never run.

What is read: assignments of numbers, lists and poses; ``RevoluteDH``, ``PrismaticDH``, ``RevoluteMDH``,
``PrismaticMDH``, ``DHLink``; ``DHRobot`` and what a subclass hands to it; the properties of links and robots;
loops over known lists. What else a script does is passed over, and matters only where a robot needs a value of it.
"""

from __future__ import annotations

import ast
import contextlib
import re
import warnings
from collections.abc import Mapping, Sequence
from typing import Final

from dh2sim.formats.table.toolbox import (
    FUNCTIONS_OF_NUMBERS,
    IDENTITY,
    MAX_ITEMS,
    MAX_PROBLEMS,
    NUMBERS,
    NumberArray,
    ScriptError,
    ToolboxLink,
    ToolboxRobot,
    Unknown,
    are_links,
    elementwise,
    links_in,
    loose_robot,
    numbers_of,
    pose_function,
    power,
    product,
    set_property,
    transform,
)
from dh2sim.messages import shown

_REVOLUTE: Final = ("d", "a", "alpha", "offset", "qlim", "flip")
_PRISMATIC: Final = ("theta", "a", "alpha", "offset", "qlim", "flip")
LINKS: Final[Mapping[str, tuple[bool | None, bool | None, tuple[str, ...]]]] = {
    "RevoluteDH": (False, False, _REVOLUTE), "PrismaticDH": (True, False, _PRISMATIC),
    "RevoluteMDH": (False, True, _REVOLUTE), "PrismaticMDH": (True, True, _PRISMATIC),
    "DHLink": (False, None, ("d", "alpha", "theta", "a", "sigma", "mdh", "offset", "flip", "qlim")),
}  # fmt: skip
"""Constructors of links: whether the joint is prismatic, the row modified, and the names of positional arguments."""
ROBOTS: Final = ("DHRobot", "SerialLink")
_CHANGES: Final = ("append", "extend", "insert", "reverse", "pop", "remove", "clear", "sort")
"""Methods that change a list."""
MADE_IN_PYTHON: Final = re.compile(r"\b(?:(?:Revolute|Prismatic)M?DH|DHLink|DHRobot)\b")
_ATTEMPTS: Final = 20
"""Lines that are no Python and are passed over, such as the magic of a notebook."""


def read_python(text: str) -> tuple[list[ToolboxRobot], list[ScriptError]]:
    """Return the robots of a script, and what of them cannot be read.

    Where links are made and no robot of them, the links are the robot.
    """
    try:
        tree = _parsed(text)
        script = _PythonScript()
        script.block(tree.body)
    except ScriptError as error:
        return [], [error]
    except RecursionError:
        return [], [ScriptError("nested too deep", 1, 1)]
    return script.robots or script.loose_robot(), script.problems


def _parsed(text: str) -> ast.Module:
    lines = text.split("\n")
    for attempt in range(_ATTEMPTS):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return ast.parse("\n".join(lines))
        except SyntaxError as error:
            line = min(max(error.lineno or 1, 1), len(lines))
            if attempt == _ATTEMPTS - 1 or not lines[line - 1].strip() or MADE_IN_PYTHON.search(lines[line - 1]):
                message = f"this cannot be read as Python: {error.msg}"
                raise ScriptError(message, line, max(error.offset or 1, 1)) from None
            lines[line - 1] = ""
        except (ValueError, MemoryError, RecursionError) as error:
            raise ScriptError(f"this cannot be read as Python: {error}", 1, 1) from None
    raise ScriptError("this cannot be read as Python", 1, 1)


def _place(node: ast.AST) -> tuple[int, int]:
    return getattr(node, "lineno", 1), getattr(node, "col_offset", 0) + 1


class _PythonScript:
    """Follows the statements of a script."""

    def __init__(self) -> None:
        self.scopes: list[dict[str, object]] = [{}]
        self.robots: list[ToolboxRobot] = []
        self.problems: list[ScriptError] = []
        self._links: list[ToolboxLink] = []
        self._turns = 0
        """Elements that loops have gone through; their number is limited, as loops in loops multiply it."""
        self._own: ToolboxRobot | None = None
        """The robot that the class at hand hands to ``super().__init__``."""

    def loose_robot(self) -> list[ToolboxRobot]:
        """Return the robot of all links, where a script makes none."""
        return loose_robot(self._links, self.scopes[0].values(), self.problems)

    def block(self, statements: Sequence[ast.stmt]) -> None:
        """Follow statements, one after the other; what cannot be read of robots goes to the problems."""
        for statement in statements:
            if len(self.problems) > MAX_PROBLEMS:
                break
            try:
                self._statement(statement)
            except ScriptError as error:
                if self._concerns_robots(statement) and not error.reported:
                    line, column = _place(statement)
                    self.problems.append(ScriptError(str(error), error.line or line, error.column or column))

    def _statement(self, node: ast.stmt) -> None:
        match node:
            case ast.Assign(targets=targets, value=value):
                try:
                    result = self._computed(value, node)
                except ScriptError as error:
                    with contextlib.suppress(ScriptError):
                        for target in targets:
                            self._assign(target, Unknown(str(error), reported=True))
                    raise
                for target in targets:
                    self._assign(target, result)
            case ast.AnnAssign(target=target, value=value) if value is not None:
                self._assign(target, self._computed(value, node))
            case ast.AugAssign(target=target, op=op, value=value):
                self._assign(target, self._operation(op, self.value(target), self.value(value)))
            case ast.Expr(value=value) | ast.Return(value=value) if value is not None:
                self.value(value)
            case ast.If():
                self._condition(node)
            case ast.For():
                self._loop(node)
            case ast.While() | ast.AsyncFor():
                self._pass_over(node, "a loop")
            case ast.With(body=body) | ast.Try(body=body):
                self.block(body)
            case ast.FunctionDef(args=arguments, body=body):
                self.scopes.append(self._parameters(arguments))
                self.block(body)
                self.scopes.pop()
            case ast.ClassDef(body=body):
                before, self._own = self._own, None
                self.scopes.append({})
                self.block(body)
                self.scopes.pop()
                self._own = before
            case ast.ImportFrom(names=names):
                for alias in names:
                    if alias.asname:
                        self.scopes[-1][alias.asname] = _Function(alias.name)
            case _:
                pass

    def _computed(self, value: ast.expr, statement: ast.stmt) -> object:
        try:
            return self.value(value)
        except ScriptError as error:
            if self._concerns_robots(statement):
                raise
            return Unknown(f"line {statement.lineno} cannot be read: {error}")

    def _parameters(self, arguments: ast.arguments) -> dict[str, object]:
        every = [*arguments.posonlyargs, *arguments.args]
        defaults = [None] * (len(every) - len(arguments.defaults)) + list(arguments.defaults)
        pairs = [*zip(every, defaults, strict=True), *zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True)]
        return {
            argument.arg: Unknown(f"{shown(argument.arg)} is an argument without a value")
            if default is None
            else self._computed(default, ast.Pass(lineno=argument.lineno, col_offset=0))
            for argument, default in pairs
        }

    def _condition(self, node: ast.If) -> None:
        test = self._truth(node.test)
        if test is not None:
            self.block(node.body if test else node.orelse)
        elif isinstance(node.test, ast.Compare) and "__name__" in ast.dump(node.test):
            self.block(node.body)
        else:
            self._pass_over(node, "a condition")

    def _loop(self, node: ast.For) -> None:
        """Follow a loop over a list whose elements are known."""
        ends = any(isinstance(inner, ast.Break | ast.Continue | ast.Return) for inner in ast.walk(node))
        items = None if ends or node.orelse else self._items(node.iter)
        if items is None:
            self._pass_over(node, "a loop")
            return
        for item in items:
            self._assign(node.target, item)
            self.block(node.body)

    def _items(self, node: ast.expr) -> list[object] | None:
        """Return what a loop goes through; None where that is not known, or more than a script may go through."""
        match node:
            case ast.Call(func=ast.Name(id="range"), args=[_, *_] as bounds):
                values = [self.value(bound) for bound in bounds]
                whole = all(isinstance(value, float) and value.is_integer() for value in values)
                if not whole or len(values) > 3 or values[2:] == [0.0]:
                    return None
                numbers = range(*(int(value) for value in values if isinstance(value, float)))
                items: list[object] = [float(i) for i in numbers[: MAX_ITEMS + 1]]
            case ast.Call(func=ast.Name(id="enumerate"), args=[inner]):
                listed = self._items(inner)
                items = [[float(i), item] for i, item in enumerate(listed or ())]
                return None if listed is None else items
            case ast.Call(func=ast.Name(id="zip"), args=[_, *_] as inners):
                columns = [self._items(inner) for inner in inners]
                known = [column for column in columns if column is not None]
                return [list(row) for row in zip(*known, strict=False)] if len(known) == len(columns) else None
            case _:
                value = self.value(node)
                if not isinstance(value, list):
                    return None
                items = list(value)
        self._turns += len(items)
        return items if self._turns <= MAX_ITEMS else None

    def _comprehension(self, node: ast.ListComp | ast.GeneratorExp) -> object:
        """Return the list that a comprehension makes."""
        first = node.generators[0]
        items = None if first.ifs or len(node.generators) > 1 else self._items(first.iter)
        if items is not None:
            self.scopes.append({})
            made = []
            for item in items:
                self._assign(first.target, item)
                made.append(self.value(node.elt))
            self.scopes.pop()
            return made
        if self._concerns_robots(node):
            message = "links that are made in a loop are not read: write them one after the other"
            raise ScriptError(message, *_place(node))
        return Unknown(f"the loop on line {node.lineno} is not followed")

    def _truth(self, node: ast.expr) -> bool | None:
        match node:
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                inner = self._truth(operand)
                return None if inner is None else not inner
            case ast.Name() | ast.Constant():
                value = self.value(node)
                return bool(value) if isinstance(value, bool | int | float) or value is None else None
            case _:
                return None

    def _pass_over(self, node: ast.stmt, what: str) -> None:
        """Pass over statements whose values are not known then."""
        reported = self._concerns_robots(node)
        if reported:
            place = next((n for n in ast.walk(node) if n is not node and self._makes_links(n)), node)
            line, column = _place(place)
            message = f"links that are made or changed in {what} are not read: write them one after the other"
            self.problems.append(ScriptError(message, line, column))
        for inner in ast.walk(node):
            if isinstance(inner, ast.Name) and isinstance(inner.ctx, ast.Store):
                self.scopes[-1][inner.id] = Unknown(
                    f"{shown(inner.id)} is set in {what} on line {node.lineno}, which is not followed",
                    reported=reported,
                )

    def _concerns_robots(self, node: ast.AST) -> bool:
        """Whether a statement makes a link or a robot, or changes one."""
        return any(self._makes_links(inner) for inner in ast.walk(node))

    def _makes_links(self, node: ast.AST) -> bool:
        match node:
            case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name)):
                held = node.func.value if isinstance(node.func, ast.Attribute) else None
                if name in _CHANGES and isinstance(held, ast.Name):
                    return are_links(self._named(held.id))
                return self._function(name) in (*LINKS, *ROBOTS) or (name == "__init__" and _is_super(node))
            case ast.Attribute(attr=attribute, ctx=ast.Store()):
                return attribute in ("tool", "base", "offset", "qlim", "alpha", "flip", "_tool", "_base")
            case _:
                return False

    def _assign(self, target: ast.expr, value: object) -> None:
        match target:
            case ast.Name(id=name):
                self.scopes[-1][name] = value
            case ast.Tuple(elts=targets) | ast.List(elts=targets):
                values = value if isinstance(value, list) and len(value) == len(targets) else None
                for index, inner in enumerate(targets):
                    self._assign(
                        inner, Unknown("it is unpacked from something else") if values is None else values[index]
                    )
            case ast.Attribute(value=ast.Name(id="self"), attr=attribute):
                if self._own is not None and attribute.lstrip("_") in ("tool", "base"):
                    _set_on_robot(self._own, attribute.lstrip("_"), value)
                self.scopes[-1][f"self.{attribute}"] = value
            case ast.Attribute(value=holder, attr=attribute):
                held = self.value(holder)
                if isinstance(held, ToolboxLink):
                    set_property(held, attribute, value)
                elif isinstance(held, ToolboxRobot):
                    _set_on_robot(held, attribute.lstrip("_"), value)
            case ast.Subscript(value=holder, slice=index):
                held, place = self.value(holder), self.value(index)
                if isinstance(held, list) and isinstance(place, int | float) and -len(held) <= place < len(held):
                    held[int(place)] = value
            case _:
                pass

    def _named(self, name: str) -> object:
        """Return the value of a name, the innermost scope first; None where it has none."""
        return next((scope[name] for scope in reversed(self.scopes) if name in scope), None)

    def _function(self, name: str) -> str:
        held = self._named(name)
        return held.name if isinstance(held, _Function) else name

    def value(self, node: ast.expr) -> object:
        """Return the value of an expression."""
        match node:
            case ast.Constant(value=bool() | None | str() as value):
                return value
            case ast.Constant(value=int() | float() as value):
                try:
                    return float(value)
                except OverflowError:
                    return Unknown("the number is too large")
            case ast.Name(id=name):
                return self._value_of(name)
            case ast.Attribute():
                return self._attribute(node)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return elementwise(lambda a: -a, self.value(operand))
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return self.value(operand)
            case ast.BinOp(left=left, op=op, right=right):
                return self._operation(op, self.value(left), self.value(right))
            case ast.List(elts=items) | ast.Tuple(elts=items):
                if len(items) > MAX_ITEMS:
                    raise ScriptError(f"more than {MAX_ITEMS} elements", *_place(node))
                return [self.value(item) for item in items]
            case ast.Subscript(value=holder, slice=index):
                return _element(self.value(holder), self.value(index))
            case ast.Call():
                return self._call(node)
            case ast.ListComp() | ast.GeneratorExp():
                return self._comprehension(node)
            case _:
                return Unknown(f"line {getattr(node, 'lineno', 0)} is not read: {shown(ast.unparse(node)[:60])}")

    def _value_of(self, name: str) -> object:
        held = self._named(name)
        if isinstance(held, _Function):
            return NUMBERS.get(held.name, held)
        if any(name in scope for scope in self.scopes):
            return held
        if name in NUMBERS:
            return NUMBERS[name]
        return Unknown(f"{shown(name)} has no value; give it one above, such as {name} = 0.4")

    def _attribute(self, node: ast.Attribute) -> object:
        match node.value:
            case ast.Name(id="self"):
                held = self._named(f"self.{node.attr}")
                return Unknown(f"self.{node.attr} has no value") if held is None else held
            case ast.Name(id=name) if any(name in scope for scope in self.scopes):
                held = self.value(node.value)
                if isinstance(held, ToolboxLink):
                    return held.numbers.get(node.attr, Unknown(f"{name}.{node.attr} has no value"))
                if isinstance(held, ToolboxRobot) and node.attr in ("tool", "base"):
                    return (held.tool if node.attr == "tool" else held.base) or IDENTITY
                if isinstance(held, ToolboxRobot) and node.attr == "links":
                    return held.links
        if isinstance(node.value, ast.Name | ast.Attribute) and node.attr in NUMBERS:
            return NUMBERS[node.attr]
        if node.attr == "A":  # the matrix of an SE3
            return self.value(node.value)
        return Unknown(f"{shown(ast.unparse(node)[:60])} has no value")

    def _operation(self, op: ast.operator, left: object, right: object) -> object:
        match op:
            case ast.Mult() | ast.MatMult() if isinstance(left, tuple) or isinstance(right, tuple):
                return product(transform(left), transform(right))
            case ast.Add() if (
                isinstance(left, list) and isinstance(right, list) and type(left) is type(right) is list
            ):
                if len(left) + len(right) > MAX_ITEMS:
                    raise ScriptError(f"more than {MAX_ITEMS} elements")
                return left + right
            case ast.Mult() if type(left) is list and isinstance(right, float):
                return (
                    list(left) * int(right)
                    if right.is_integer() and len(left) * right <= MAX_ITEMS
                    else Unknown("a list times something is not read")
                )
            case ast.Add():
                return elementwise(lambda a, b: a + b, left, right)
            case ast.Sub():
                return elementwise(lambda a, b: a - b, left, right)
            case ast.Mult():
                return elementwise(lambda a, b: a * b, left, right)
            case ast.Div():
                return elementwise(lambda a, b: a / b, left, right)
            case ast.Pow():
                return elementwise(power, left, right)
            case _:
                return Unknown(f"the operation {type(op).__name__} is not read")

    def _call(self, node: ast.Call) -> object:
        holder: ast.expr | None = None
        match node.func:
            case ast.Name(id=called):
                name = self._function(called)
            case ast.Attribute(attr=called, value=holder):
                name = called
            case _:
                return Unknown("a call of this kind is not read")
        if name in LINKS:
            return self._link(name, node)
        if name in ROBOTS or (name == "__init__" and _is_super(node) and self._gives_links(node)):
            return self._robot(node, own=name == "__init__")
        if name in _CHANGES and holder is not None:
            held = self.value(holder)
            if isinstance(held, list):
                self._change(held, name, node)
            return None
        if name.startswith("addconfiguration") and holder is not None and len(node.args) == 2:
            self._configuration(holder, node)
            return None
        arguments = [self.value(argument) for argument in node.args]
        keywords = {word.arg: self.value(word.value) for word in node.keywords if word.arg}
        if name in ("array", "asarray", "r_") and arguments and isinstance(arguments[0], list):
            return NumberArray(arguments[0])
        pose = pose_function(name, arguments, keywords)
        if pose is not None:
            return pose
        if name in FUNCTIONS_OF_NUMBERS and arguments:
            return elementwise(FUNCTIONS_OF_NUMBERS[name], *arguments)
        if name == "len" and len(arguments) == 1 and isinstance(arguments[0], list):
            return float(len(arguments[0]))
        if name in ("zero", "zeros") and not arguments:
            return 0.0
        return Unknown(f"the function {shown(name)} on line {node.lineno} is not known")

    def _change(self, held: list[object], name: str, node: ast.Call) -> None:
        """Follow a method that changes a list."""
        match name, [self.value(argument) for argument in node.args]:
            case "append", [item]:
                held[len(held) :] = [item][: MAX_ITEMS - len(held)]
            case "extend", [list() as items]:
                held[len(held) :] = items[: MAX_ITEMS - len(held)]
            case "extend", [other]:
                held.append(other if isinstance(other, Unknown) else Unknown("it is no list"))
            case "insert", [float() as place, item] if len(held) < MAX_ITEMS:
                held.insert(int(place), item)
            case "reverse", []:
                held.reverse()
            case _ if are_links(held):
                raise ScriptError(f"what '{name}' does to a list of links is not read", *_place(node))

    def _gives_links(self, node: ast.Call) -> bool:
        first = node.args[0] if node.args else next((w.value for w in node.keywords if w.arg == "links"), None)
        return first is not None and are_links(self.value(first))

    def _arguments(self, node: ast.Call, names: Sequence[str]) -> dict[str, object]:
        if len(node.args) > len(names) or any(isinstance(argument, ast.Starred) for argument in node.args):
            raise ScriptError("these arguments cannot be read", *_place(node))
        if any(word.arg is None for word in node.keywords):
            raise ScriptError("arguments behind ** cannot be read", *_place(node))
        given = dict(zip(names, map(self.value, node.args), strict=False))
        return {**given, **{word.arg: self.value(word.value) for word in node.keywords if word.arg}}

    def _link(self, name: str, node: ast.Call) -> ToolboxLink:
        prismatic, modified, names = LINKS[name]
        line, column = _place(node)
        link = ToolboxLink(line=line, column=column, prismatic=prismatic, modified=modified)
        for key, value in self._arguments(node, names).items():
            try:
                set_property(link, key, value)
            except ScriptError as error:
                raise ScriptError(str(error), line, column, reported=error.reported) from None
        if len(self._links) == MAX_ITEMS:
            raise ScriptError(f"more than {MAX_ITEMS} links", line, column)
        self._links.append(link)
        return link

    def _robot(self, node: ast.Call, *, own: bool) -> ToolboxRobot:
        line, column = _place(node)
        given = self._arguments(node, ("links", "name", "manufacturer"))
        robot = ToolboxRobot(line=line, column=column, links=[])
        try:
            robot.links = links_in(given.get("links"))
            for key in ("name", "base", "tool"):
                if given.get(key) is not None:
                    _set_on_robot(robot, key, given[key])
        except ScriptError as error:
            raise ScriptError(str(error), line, column, reported=error.reported) from None
        if own:
            self._own = robot
        self.robots.append(robot)
        return robot

    def _configuration(self, holder: ast.expr, node: ast.Call) -> None:
        robot = self._own if isinstance(holder, ast.Name) and holder.id == "self" else self.value(holder)
        name = self.value(node.args[0])
        if isinstance(robot, ToolboxRobot) and isinstance(name, str):
            try:
                robot.configurations[name] = numbers_of(self.value(node.args[1]))
            except ScriptError:
                return


class _Function:
    """A name that an import gave to a function or a constant."""

    def __init__(self, name: str) -> None:
        self.name = name


def _is_super(node: ast.Call) -> bool:
    match node.func:
        case ast.Attribute(attr="__init__", value=ast.Call(func=ast.Name(id="super"))):
            return True
        case ast.Attribute(attr="__init__", value=ast.Name(id=name) | ast.Attribute(attr=name)):
            return name in ROBOTS
        case _:
            return False


def _element(value: object, index: object) -> object:
    if isinstance(value, Unknown):
        return value
    for place in index if isinstance(index, list) else [index]:
        if not isinstance(value, list) or not isinstance(place, float) or not -len(value) <= place < len(value):
            return Unknown("an element of something else cannot be read")
        value = value[int(place)]
    return value


def _set_on_robot(robot: ToolboxRobot, key: str, value: object) -> None:
    if key == "name" and isinstance(value, str):
        robot.name = value
    elif key in ("base", "tool") and value is not None:
        try:
            T = transform(value)
        except ScriptError as error:
            raise ScriptError(f"{key}: {error}", reported=error.reported) from None
        setattr(robot, key, None if T == IDENTITY else T)
