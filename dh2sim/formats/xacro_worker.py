"""Expands xacro in a process of its own (``dh2sim.limited_process``): a request in JSON in, an answer in JSON out.

xacro evaluates Python expressions, and its own checks let some of them reach all of Python (a comprehension, or
``$(eval open(...))``). So here every expression is checked as a syntax tree, files are read below one folder only,
environment variables are not seen, and the process may not start others.
"""

from __future__ import annotations

import ast
import contextlib
import errno
import glob
import io
import json
import os
import re
import stat
from collections import deque
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from types import CodeType, SimpleNamespace
from typing import Any, Final
from xml.dom import expatbuilder, minidom

from dh2sim.errors import ImportedFileError, Problem
from dh2sim.formats.mesh_paths import package_name
from dh2sim.formats.xml_read import MAX_BYTES, parse_xml, tolerated
from dh2sim.messages import did_you_mean, listed, shown

MAX_FOLDERS: Final = 20_000
"""Searched for packages."""
MAX_MESSAGES: Final = 20
MAX_JOINTS: Final = 1500
"""Of an expanded file, fixed ones too: xacro takes half a millisecond for each."""
_PLACE: Final = "place"
_PATCHED: Final = (
    "parse", "safe_eval", "eval_all", "load_yaml", "glob", "_global_symbols", "init_stacks", "process_doc",
)  # fmt: skip
_PATCHED_ARGS: Final = ("ArgException", "_eval_find", "_eval_env", "_eval_optenv", "_eval_dict", "_eval")

_SYNTAX: Final = (
    ast.Expression, ast.Constant, ast.Name, ast.Load, ast.Store, ast.Attribute, ast.Subscript, ast.Slice, ast.Call,
    ast.keyword, ast.Starred, ast.BoolOp, ast.boolop, ast.BinOp, ast.operator, ast.UnaryOp, ast.unaryop, ast.Compare,
    ast.cmpop, ast.IfExp, ast.List, ast.Tuple, ast.Set, ast.Dict, ast.ListComp, ast.SetComp, ast.DictComp,
    ast.GeneratorExp, ast.comprehension, ast.Lambda, ast.arguments, ast.arg, ast.JoinedStr, ast.FormattedValue,
)  # fmt: skip
_INNER: Final = ("gi_", "cr_", "ag_", "tb_", "co_")
"""Beginnings of attributes that lead to Python's own frames and code."""


class _ForbiddenError(Exception):
    """Something that is not allowed; no ``optional`` of the file makes it so."""


def checked_eval(expression: str, symbols: dict[str, Any], local: Any = None) -> Any:
    """Evaluate an expression in which nothing leads out of the symbols.

    Raises:
        _ForbiddenError: It does more than expressions of xacro need.
    """
    symbols.update(__builtins__={})
    return eval(_compiled(expression.strip()), symbols, local)


@lru_cache(maxsize=4096)  # those of a macro are evaluated at each of its uses
def _compiled(expression: str) -> CodeType:
    """Return the code of an expression in which nothing leads out of its symbols."""
    tree = ast.parse(expression, "<expression>", "eval")
    for node in ast.walk(tree):
        if not isinstance(node, _SYNTAX):
            raise _ForbiddenError(f"{type(node).__name__.lower()} is not allowed in an expression")
        name = node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""
        if name.startswith(("__", *_INNER)) or (isinstance(node, ast.Attribute) and name.startswith("_")):
            raise _ForbiddenError(f"the name {shown(name)} is not allowed in an expression")
        if name in ("format", "format_map") and isinstance(node, ast.Attribute):
            text = node.value.value if isinstance(node.value, ast.Constant) else None
            if name != "format" or not isinstance(text, str) or re.search(r"\{[^{}:!]*[.\[]", text):
                raise _ForbiddenError(f"{name}() is allowed for plain texts only")
    return compile(tree, "<expression>", "eval")


class _Files:
    """Reads files below one folder."""

    def __init__(self, request: Mapping[str, Any]) -> None:
        self.main = os.path.abspath(request["path"])
        self.root = os.path.realpath(request["root"])
        self.allowed: str = request["allowed"]
        self.file: str = request["file"]
        self._main_text: bytes = request["text"].encode("latin-1")
        self._read = 0
        self._packages: dict[str, str] | None = None

    def label(self, path: str) -> str:
        """Return what messages call a file."""
        if os.path.abspath(path) == self.main:
            return self.file
        relative = os.path.relpath(path, os.path.dirname(self.main))
        return os.path.normpath(os.path.join(os.path.dirname(self.file), relative))

    def read(self, path: str) -> bytes:
        """Return a file's content."""
        if os.path.abspath(path) == self.main:
            return self._main_text
        real = os.path.realpath(path)
        if not Path(real).is_relative_to(self.root):
            raise _ForbiddenError(self._outside(path, real))
        if not os.path.exists(real):
            raise FileNotFoundError(errno.ENOENT, "no such file", self.label(path))
        if not stat.S_ISREG(os.stat(real).st_mode):
            raise _ForbiddenError(f"{self.label(path)}: not a regular file")
        with open(real, "rb") as stream:
            data = stream.read(MAX_BYTES - self._read + 1)
        self._read += len(data)
        if self._read > MAX_BYTES:
            raise _ForbiddenError(f"more than {MAX_BYTES} bytes in all files together")
        return data

    def open(self, path: str, *_: object, **__: object) -> io.StringIO:
        """Open a text for reading."""
        return io.StringIO(self.read(path).decode("utf-8-sig"))

    def glob(self, pattern: str) -> list[str]:
        """Return the files of a pattern, which must begin in the folder."""
        fixed = re.split(r"[*[?]", pattern)[0]
        real = os.path.realpath(fixed if fixed.endswith("/") else os.path.dirname(fixed))
        if not Path(real).is_relative_to(self.root):
            raise _ForbiddenError(self._outside(pattern, real))
        return glob.glob(pattern)

    def find(self, package: str) -> str:
        """Return the folder of a package: one with a package.xml of this name, or else one that is called so."""
        if self._packages is None:
            self._packages = {}
            for folder in _folders(self.root):
                name = package_name(Path(folder))
                if name:
                    self._packages.setdefault(name, folder)
                self._packages.setdefault(f"/{os.path.basename(folder)}", folder)
        found = self._packages.get(package) or self._packages.get(f"/{package}")
        if found is None:
            above = Path(self.main).parents
            hint = next((self._hint(str(f)) for f in above if package in (f.name, package_name(f))), "")
            raise _ForbiddenError(f"no package {shown(package)} in {self.allowed} and those below it{hint}")
        return found

    def _outside(self, path: str, real: str) -> str:
        hint = self._hint(os.path.commonpath([self.root, os.path.dirname(real)])) if os.path.exists(real) else ""
        return f"found {shown(self.label(path))}; only files in {self.allowed} and those below it are read{hint}"

    def _hint(self, folder: str) -> str:
        """Return how to allow a folder; nothing for a whole disk."""
        if folder == os.path.dirname(folder):
            return ""
        return f"; allow others with root={self.label(folder)!r}"


def _folders(root: str) -> Iterator[str]:
    """Yield a folder and those below it, the higher ones first."""
    waiting = deque([root])
    for _ in range(MAX_FOLDERS):
        if not waiting:
            return
        folder = waiting.popleft()
        yield folder
        with contextlib.suppress(OSError), os.scandir(folder) as entries:
            inside = [e.path for e in entries if e.is_dir(follow_symlinks=False) and not e.name.startswith(".")]
            waiting += sorted(inside)


class _Placed(expatbuilder.ExpatBuilderNS):  # type: ignore[misc, unused-ignore]
    """Builds a document whose elements know where they come from, and their copies too."""

    def __init__(self, file: str) -> None:
        super().__init__()
        self._file = file

    def start_element_handler(self, name: str, attributes: list[str]) -> None:
        super().start_element_handler(name, attributes)
        parser = self.getParser()
        place = (self._file, parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)
        self.curNode.setUserData(_PLACE, place, _Copied)


class _Copied:
    """Keeps the place of an element in its copies."""

    @staticmethod
    def handle(_operation: int, key: str, data: object, _source: object, copy: Any) -> None:
        if copy is not None:
            copy.setUserData(key, data, _Copied)


class _Expansion:
    """xacro, with what it reads and evaluates replaced."""

    def __init__(self, request: Mapping[str, Any]) -> None:
        import xacro
        from xacro import substitution_args

        self._xacro: Any = xacro
        self._arguments = dict(request["arguments"])
        self._files = files = _Files(request)
        self._known: set[str] = set()
        self._messages: dict[str, None] = {}
        self._joints = 0
        missing = [n for n in _PATCHED if not hasattr(xacro, n)]
        missing += [n for n in _PATCHED_ARGS if not hasattr(substitution_args, n)]
        if missing:
            raise _ForbiddenError(f"this version of xacro is not supported: it has no {listed(missing)}")
        replaced: Any = xacro
        replaced.parse, replaced.safe_eval, replaced.open = self._parse, checked_eval, files.open
        self._eval_all, replaced.eval_all = xacro.eval_all, self._bounded
        replaced.message = replaced.warning = replaced.error = self._say
        replaced.print_location = lambda: None
        xacro._global_symbols["xacro"].update(message=self._say, warning=self._say, error=self._say)
        replaced.glob = SimpleNamespace(glob=files.glob)
        python = xacro._global_symbols["python"]
        for name in ("vars", "type"):  # which make classes, and show what is inside of things
            python.pop(name, None)
        arguments: Any = substitution_args
        self._argument_error = arguments.ArgException
        arguments.eval = lambda expression, _globals, names: checked_eval(expression, {}, names)
        arguments._eval_find, arguments._eval_env, arguments._eval_optenv = files.find, _no_variable, _default
        arguments._eval_dict.update(find=files.find, env=_no_variable, optenv=_default)

    def answer(self) -> dict[str, Any]:
        """Return the expanded text with the place of every element, or the problems."""
        try:
            return self._expanded()
        except ImportedFileError as error:
            problems = list(error.problems)
        except Exception as error:  # xacro raises many types, and so do expressions
            problems = [self._problem(error)]
        keys = ("file", "line", "column", "path", "message")
        return {"problems": [{key: getattr(problem, key) for key in keys} for problem in problems]}

    def _expanded(self) -> dict[str, Any]:
        main = self._files.main
        self._xacro.init_stacks(main)
        document = self._parse(None, main)
        self._xacro.process_doc(document, mappings=dict(self._arguments))
        unknown = [name for name in self._arguments if name not in self._known]
        if unknown:
            guess = did_you_mean(unknown[0], self._known)
            message = f"the file has no argument {shown(unknown[0])}.{guess} It has: {listed(sorted(self._known))}"
            raise ImportedFileError(
                [Problem(file=self._files.file, line=1, column=1, path="arguments", message=message)]
            )
        elements: list[Any] = []
        robot: Any = document.documentElement
        _without_comments(robot, elements)
        return {
            "text": robot.toxml(),
            "messages": list(self._messages)[:MAX_MESSAGES],
            "places": [element.getUserData(_PLACE) or (self._files.file, 1, 1) for element in elements],
        }

    def _say(self, *words: object, **_: object) -> str:
        self._messages[" ".join(" ".join(map(str, words)).split())[:500]] = None
        return ""

    def _bounded(self, node: Any, macros: Any, symbols: Any) -> Any:
        """Evaluate an element, as long as there are not too many joints."""
        self._joints += node.nodeName == "joint"
        if self._joints > MAX_JOINTS:
            instead = "expand the file with xacro itself, and import what it writes"
            raise _ForbiddenError(f"there are more than {MAX_JOINTS} joints; {instead}")
        return self._eval_all(node, macros, symbols)

    def _parse(self, _given: object, filename: str | None = None) -> minidom.Document:
        path = filename or self._files.main
        label = self._files.label(path)
        try:
            data = self._files.read(path)
        except OSError as error:
            self._xacro.filestack.pop()
            raise self._xacro.XacroException(f"{label}: no such file", exc=error) from error
        root = parse_xml(data, file=label)  # with its limits, and its messages
        for element in root.walk():
            if element.tag == "xacro:arg":
                self._known.add(element.attributes.get("name", ""))
        self._known.update(name.decode() for name in re.findall(rb"\$\(arg +(\w+)", data))
        builder = _Placed(label)
        return builder.parseString(tolerated(data))

    def _problem(self, error: Exception) -> Problem:
        file, line, column = _place_of(error) or (self._files.file, 1, 1)
        missing = next((cause for cause in _causes(error) if isinstance(cause, FileNotFoundError)), None)
        text = str(error) if missing is None else f"{missing.filename}: no such file"
        text = text.replace("\n", ", ").replace(", when evaluating", ", evaluating")
        for cause in _causes(error):
            match cause:
                case _ForbiddenError():
                    text = str(cause)
                case RecursionError():
                    text = "macros or properties call themselves without end"
                case MemoryError():
                    text = "the file needs too much memory"
                case self._argument_error():
                    name = str(cause)
                    text = f"argument {name!r} has no value, and no default; give it one: arguments={{{name!r}: ...}}"
        text = " ".join(text.replace(" (<expression>, line 1)", "").replace(" ,", ",").split())
        macro = self._xacro.macrostack[-1].body.getAttribute("name") if self._xacro.macrostack else ""
        where = f", in macro {shown(macro)}" if macro else ""
        return Problem(file=file, line=line, column=column, path="xacro", message=f"{text[:1000]}{where}")


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    """Yield an error and those that it wraps."""
    while error is not None:
        yield error
        error = getattr(error, "exc", None) or error.__cause__


def _no_variable(name: str) -> str:
    raise _ForbiddenError(f"the environment variable {shown(name)} is not read; replace it, or make it an argument")


def _default(_name: str, default: str = "") -> str:
    return default


def _without_comments(element: Any, found: list[Any]) -> None:
    """Remove all comments, and list all elements in the order of the text."""
    found.append(element)
    for child in list(element.childNodes):
        if child.nodeType == child.ELEMENT_NODE:
            _without_comments(child, found)
        elif child.nodeType == child.COMMENT_NODE:
            element.removeChild(child)


def _place_of(error: BaseException) -> tuple[str, int, int] | None:
    """Return the place of the innermost element that was being expanded."""
    found = None
    trace = error.__traceback__
    while trace is not None:
        for name in ("node", "elt", "tag"):
            element = trace.tb_frame.f_locals.get(name)
            if isinstance(element, minidom.Element):
                found = element.getUserData(_PLACE) or found
        trace = trace.tb_next
    return found


def answer(request: bytes) -> bytes:
    """Expand the xacro file of a request; environment variables and other processes are out of reach meanwhile."""
    asked = json.loads(request)
    try:
        expansion = _Expansion(asked)
    except _ForbiddenError as error:
        problem = {"file": asked["file"], "line": 1, "column": 1, "path": "xacro", "message": str(error)}
        return json.dumps({"problems": [problem]}).encode()
    os.environ.clear()
    with contextlib.suppress(ImportError, ValueError, OSError):  # not on Windows
        import resource

        resource.setrlimit(resource.RLIMIT_NPROC, (0, 0))
    return json.dumps(expansion.answer()).encode()
