"""Programs as text: Python, NumPy, C, C++, MATLAB and JavaScript."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence
from enum import StrEnum
from typing import Final

from dh2sim.codegen.program import Body, Function, Listing, Program, Statement, identifier
from dh2sim.codegen.reserved_words import C_NAMES, CPP_NAMES, JAVASCRIPT_NAMES, MATLAB_NAMES, PYTHON_NAMES

_WIDTH: Final = 110


class Language(StrEnum):
    """A language that code is written in."""

    PYTHON = "python"
    NUMPY = "numpy"
    C = "c"
    CPP = "cpp"
    MATLAB = "matlab"
    JAVASCRIPT = "javascript"


def program_text(program: Program, language: Language) -> str:
    """Return the text of a file that holds a program and needs no other."""
    return _PRINTERS[language](program)


def _python(program: Program) -> str:
    listing = Listing(program, PYTHON_NAMES)
    lines = [
        *_commented(program.header, "# "),
        "",
        "from collections.abc import Iterable",
        *(["from math import cos, sin"] if _uses_functions(program) else []),
        "",
        *_assigned(listing.constants, "{} = {}", "  # "),
        *_assigned(listing.derived, "{} = {}", "  # "),
    ]
    for function in program.functions:
        body = listing.body(function)
        arguments = ", ".join(f"{name}: Iterable[float]" for name in function.arguments)
        kind = "list[float]" if len(function.shape) == 1 else "list[list[float]]"
        lines += ["", "", f"def {function.name}({arguments}) -> {kind}:", f'    """Return {function.text}."""']
        for name, entries in body.arguments.items():
            if any(entries):
                lines.append(f"    {_unpacked(entries)} = map(float, {name})")
        lines += _assigned(body.statements, "    {} = {}", "")
        lines += _nested("return ", body, function, "    ", "")
    return _joined(lines)


def _numpy(program: Program) -> str:
    listing = Listing(program, PYTHON_NAMES, prefix="np.")
    lines = [
        *_commented(program.header, "# "),
        "",
        "import numpy as np",
        "from numpy.typing import ArrayLike, NDArray",
        "",
        *_assigned(listing.constants, "{} = {}", "  # "),
        *_assigned(listing.derived, "{} = {}", "  # "),
    ]
    for function in program.functions:
        body = listing.body(function)
        arguments = ", ".join(f"{name}: ArrayLike" for name in function.arguments)
        shape = ", ".join(("...", *map(str, function.shape)))
        result = function.result
        lines += [
            "",
            "",
            f"def {function.name}({arguments}) -> NDArray[np.float64]:",
            f'    """Return {function.text}.',
            "",
            f"    Arguments have the shape (..., {program.n}), the result ({shape}).",
            '    """',
        ]
        if len(function.arguments) > 1:
            names = ", ".join(function.arguments)
            lines.append(f"    {names} = np.broadcast_arrays(*(np.asarray(v, dtype=np.float64) for v in ({names})))")
        else:
            lines.append("    q = np.asarray(q, dtype=np.float64)")
        for name, entries in body.arguments.items():
            if any(entries):
                unpacked = ", ".join(entry or "_" for entry in entries)
                lines.append(
                    f"    {f'({unpacked},)' if len(entries) == 1 else unpacked} = np.moveaxis({name}, -1, 0)"
                )
        lines += _assigned(body.statements, "    {} = {}", "")
        lines.append(f"    {result} = np.zeros((*q.shape[:-1], {', '.join(map(str, function.shape))}))")
        lines += [
            f"    {result}[..., {place}] = {value}"
            for place, value in zip(_places(function.shape), body.results, strict=True)
            if value != "0.0"
        ]
        lines.append(f"    return {result}")
    return _joined(lines)


def _c(program: Program) -> str:
    prefix = identifier(program.name)
    listing = Listing(program, C_NAMES, derived_in_functions=True)
    heads = {
        function.name: f"void {prefix}_{function.name}("
        + ", ".join([*(f"const double *{name}" for name in function.arguments), f"double *{function.result}"])
        + ")"
        for function in program.functions
    }
    lines = [
        *_block_comment(program.header),
        "",
        *(["#include <math.h>", ""] if _uses_functions(program) else []),
        *(f"{head};" for head in heads.values()),
        "",
        *_assigned(listing.constants, "static const double {} = {};", " /* ", " */"),
    ]
    for function in program.functions:
        body = listing.body(function)
        lines += ["", f"/* {_first_upper(function.text)}, {_layout(function)}. */", heads[function.name], "{"]
        lines += _loaded(body, "    const double {} = {}[{}];", 0)
        lines += [f"    (void){name};" for name in _unused(body) + ([] if body.results else [function.result])]
        lines += _assigned(body.statements, "    const double {} = {};", "")
        lines += [f"    {function.result}[{i}] = {value};" for i, value in enumerate(body.results)]
        lines.append("}")
    return _joined(lines)


def _cpp(program: Program) -> str:
    listing = Listing(program, CPP_NAMES, prefix="std::")
    namespace = identifier(program.name)
    while namespace in CPP_NAMES or namespace in ("std", "posix"):
        namespace += "_"
    lines = [
        *_block_comment(program.header),
        "",
        f"#ifndef DH2SIM_{namespace}",
        f"#define DH2SIM_{namespace}",
        "",
        "#include <array>",
        *(["#include <cmath>"] if _uses_functions(program) else []),
        "",
        f"namespace {namespace} {{",
        "",
        *_assigned(listing.constants, "constexpr double {} = {};", "  // "),
        *_assigned(listing.derived, "constexpr double {} = {};", "  // "),
    ]
    for function in program.functions:
        body = listing.body(function)
        size = len(function.values)
        arguments = ", ".join(f"const std::array<double, {program.n}>& {name}" for name in function.arguments)
        lines += [
            "",
            f"/// {_first_upper(function.text)}, {_layout(function)}.",
            f"inline std::array<double, {size}> {function.name}({arguments})",
            "{",
            *_loaded(body, "    const double {} = {}[{}];", 0),
            *(f"    (void){name};" for name in _unused(body)),
            *_assigned(body.statements, "    const double {} = {};", ""),
        ]
        if size:
            lines += ["    return {{", *(f"        {value}," for value in body.results), "    }};"]
        else:
            lines.append("    return {};")
        lines.append("}")
    return _joined([*lines, "", f"}}  // namespace {namespace}", "", "#endif"])


def _matlab(program: Program) -> str:
    name = identifier(program.name)
    while name in MATLAB_NAMES:
        name += "_"
    listing = Listing(program, {*MATLAB_NAMES, name, "arm", "p"}, derived_in_functions=True)
    first, *more = program.header
    calls = [f"arm.{function.name}({', '.join(function.arguments)})" for function in program.functions]
    lines = [
        f"function arm = {name}()",
        f"%{name.upper()}  {first}",
        *_commented(more, "%   "),
        "%",
        f"%   arm = {name}(); {'; '.join(calls)}",
        "",
        *_assigned(listing.constants, "p.{} = {};", "  % "),
        "arm.parameters = p;",
        *(
            f"arm.{function.name} = @({', '.join(function.arguments)}) "
            f"{function.name}({', '.join((*function.arguments, 'p'))});"
            for function in program.functions
        ),
        "end",
    ]
    for function in program.functions:
        body = listing.body(function)
        lines += [
            "",
            f"function {function.result} = {function.name}({', '.join((*function.arguments, 'p'))})",
            f"% {_first_upper(function.text)}.",
            *(f"{constant} = p.{constant};" for constant in body.constants),
            *_loaded(body, "{} = {}({});", 1),
            *_assigned(body.statements, "{} = {};", ""),
        ]
        if not function.values:
            lines.append(f"{function.result} = zeros({', '.join(map(str, (*function.shape, 1)[:2]))});")
        elif len(function.shape) == 1:
            lines += [f"{function.result} = [", *(f"    {value}" for value in body.results), "];"]
        else:
            lines += [f"{function.result} = zeros({', '.join(map(str, function.shape))});"]
            lines += [
                f"{function.result}({i + 1}, {k + 1}) = {value};"
                for (i, k), value in zip(_indices(function.shape), body.results, strict=True)
                if value != "0.0"
            ]
        lines.append("end")
    return _joined(lines)


def _javascript(program: Program) -> str:
    listing = Listing(program, JAVASCRIPT_NAMES, prefix="Math.")
    lines = [
        *_commented(program.header, "// "),
        "",
        *_assigned(listing.constants, "export const {} = {};", " // "),
        *_assigned(listing.derived, "const {} = {};", " // "),
    ]
    for function in program.functions:
        body = listing.body(function)
        lines += [
            "",
            f"/** {_first_upper(function.text)}. */",
            f"export function {function.name}({', '.join(function.arguments)}) {{",
        ]
        for name, entries in body.arguments.items():
            if any(entries):
                lines.append(f"  const [{', '.join(entry or '' for entry in entries).rstrip(', ')}] = {name};")
        lines += _assigned(body.statements, "  const {} = {};", "")
        lines += [*_nested("return ", body, function, "  ", ";"), "}"]
    return _joined(lines)


_PRINTERS: Final[dict[Language, Callable[[Program], str]]] = {
    Language.PYTHON: _python,
    Language.NUMPY: _numpy,
    Language.C: _c,
    Language.CPP: _cpp,
    Language.MATLAB: _matlab,
    Language.JAVASCRIPT: _javascript,
}


def _uses_functions(program: Program) -> bool:
    return any(program.operations(function).functions for function in program.functions)


def _joined(lines: Iterable[str]) -> str:
    return "\n".join(lines) + "\n"


def _commented(lines: Iterable[str], mark: str) -> list[str]:
    return [f"{mark}{line}".rstrip() for line in lines]


def _block_comment(lines: Iterable[str]) -> list[str]:
    inner = [f" * {line}".rstrip().replace("*/", "* /").replace("/*", "/ *") for line in lines]
    return ["/*", *inner, " */"]


def _assigned(statements: Iterable[Statement], form: str, mark: str, end: str = "") -> list[str]:
    """Return assignments; notes follow ``mark``, if there is one."""
    return [
        form.format(name, expression) + (f"{mark}{note}{end}" if mark and note else "")
        for name, expression, note in statements
    ]


def _loaded(body: Body, form: str, first: int) -> list[str]:
    """Return assignments of the entries of arguments; ``first`` is the index of the first."""
    return [
        form.format(entry, name, place)
        for name, entries in body.arguments.items()
        for place, entry in enumerate(entries, start=first)
        if entry
    ]


def _unused(body: Body) -> list[str]:
    """Return the arguments that nothing is read from."""
    return [name for name, entries in body.arguments.items() if not any(entries)]


def _indices(shape: Sequence[int]) -> list[tuple[int, ...]]:
    return list(itertools.product(*map(range, shape)))


def _unpacked(entries: Sequence[str | None]) -> str:
    """Return Python's names for the entries of a vector."""
    names = ", ".join(entry or "_" for entry in entries)
    return f"({names},)" if len(entries) == 1 else names


def _places(shape: Sequence[int]) -> list[str]:
    return [", ".join(map(str, index)) for index in _indices(shape)]


def _nested(before: str, body: Body, function: Function, step: str, end: str) -> list[str]:
    """Return a statement with the result as lists, in a function that is indented by one step."""
    if len(function.shape) == 1:
        return _list(f"{step}{before}", body.results, step, 1, end)
    rows, columns = function.shape
    lines = [f"{step}{before}["]
    for i in range(rows):
        lines += _list(2 * step, body.results[i * columns : (i + 1) * columns], step, 2, ",")
    return [*lines, f"{step}]{end}"]


def _list(before: str, values: Sequence[str], step: str, depth: int, end: str) -> list[str]:
    """Return a list on one line, or on several if it is too long for one."""
    line = f"{before}[{', '.join(values)}]{end}"
    if len(line) <= _WIDTH:
        return [line]
    return [f"{before}[", *(f"{(depth + 1) * step}{value}," for value in values), f"{depth * step}]{end}"]


def _first_upper(text: str) -> str:
    return text[:1].upper() + text[1:]


def _layout(function: Function) -> str:
    """Return in words how the numbers of a result lie."""
    if len(function.shape) == 1:
        return f"{function.shape[0]} numbers"
    return f"{function.shape[0]} x {function.shape[1]} numbers row by row"
