"""Generated code, run as its users run it: each language with its own compiler or interpreter."""

from __future__ import annotations

import ctypes
import json
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dh2sim.typing import Array

STRICT = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-Wshadow", "-Wconversion", "-O1"]
SIZES = {"fk": (4, 4), "jacobian": (6, -1), "inverse_dynamics": (-1,)}
"""Shapes of the results; -1 is the number of joints."""


def python_functions(text: str) -> dict[str, Any]:
    """Run a module of Python or NumPy, and return its names."""
    names: dict[str, Any] = {}
    exec(compile(text, "<generated>", "exec"), names)
    return names


def require(program: str) -> None:
    if shutil.which(program) is None:
        pytest.skip(f"{program} is not installed")


def run(command: Sequence[str], folder: Path) -> str:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@dataclass(frozen=True, slots=True, kw_only=True)
class Call:
    """What is to be computed."""

    functions: Sequence[str]
    arguments: Sequence[Array]
    """q, and for inverse dynamics qd and qdd, each of shape (N, n)."""
    folder: Path

    def arguments_of(self, function: str) -> Sequence[Array]:
        return self.arguments if function == "inverse_dynamics" else self.arguments[:1]

    def shape_of(self, function: str) -> tuple[int, ...]:
        samples, n = self.arguments[0].shape
        return samples, *(n if size < 0 else size for size in SIZES[function])

    def shaped(self, results: Sequence[Any]) -> list[Array]:
        return [
            np.array(result, dtype=np.float64).reshape(self.shape_of(function))
            for function, result in zip(self.functions, results, strict=True)
        ]


def python_results(text: str, call: Call) -> list[Array]:
    names = python_functions(text)
    return call.shaped(
        [
            [names[function](*state) for state in zip(*call.arguments_of(function), strict=True)]
            for function in call.functions
        ]
    )


def numpy_results(text: str, call: Call) -> list[Array]:
    names = python_functions(text)
    return [names[function](*call.arguments_of(function)) for function in call.functions]


def c_results(text: str, prefix: str, call: Call) -> list[Array]:
    """Compile C99 without a warning, and call functions for every row of their arguments."""
    require("gcc")
    (call.folder / "robot.c").write_text(text)
    strict = ["-std=c99", "-Wmissing-prototypes", *STRICT]
    run(["gcc", *strict, "-shared", "-fPIC", "robot.c", "-o", "robot.so", "-lm"], call.folder)
    return _called(ctypes.CDLL(str(call.folder / "robot.so")), prefix, call)


def cpp_results(text: str, namespace: str, call: Call) -> list[Array]:
    """Compile C++ without a warning, behind functions of C."""
    require("g++")
    n = call.arguments[0].shape[1]
    lines = ['#include "robot.hpp"', "#include <algorithm>", 'extern "C" {']
    for function in call.functions:
        names = [f"a{i}" for i in range(len(call.arguments_of(function)))]
        lines.append(f"void f_{function}({', '.join(f'const double *{name}' for name in names)}, double *out) {{")
        for name in names:
            lines.append(f"  std::array<double, {n}> v{name};")
            lines.append(f"  std::copy({name}, {name} + {n}, v{name}.begin());")
        lines.append(f"  const auto result = {namespace}::{function}({', '.join(f'v{name}' for name in names)});")
        lines.append("  std::copy(result.begin(), result.end(), out);\n}")
    (call.folder / "robot.hpp").write_text(text)
    (call.folder / "robot.cpp").write_text("\n".join([*lines, "}", ""]))
    run(["g++", "-std=c++14", *STRICT, "-shared", "-fPIC", "robot.cpp", "-o", "robot_cpp.so"], call.folder)
    return _called(ctypes.CDLL(str(call.folder / "robot_cpp.so")), "f", call)


def _called(library: ctypes.CDLL, prefix: str, call: Call) -> list[Array]:
    results = []
    for function in call.functions:
        pointer = getattr(library, f"{prefix}_{function}")
        out = np.full(call.shape_of(function), np.nan)
        for state, row in zip(zip(*call.arguments_of(function), strict=True), out, strict=True):
            vectors = [np.ascontiguousarray(vector) for vector in state]
            pointer(*(ctypes.c_void_p(vector.ctypes.data) for vector in (*vectors, row)))
        results.append(out)
    return results


def javascript_results(text: str, call: Call) -> list[Array]:
    """Import the module into node."""
    require("node")
    (call.folder / "robot.mjs").write_text(text)
    lines = ["import * as robot from './robot.mjs';", "const results = [];"]
    for function in call.functions:
        states = json.dumps(np.stack(call.arguments_of(function), axis=1).tolist())
        lines.append(f"results.push({states}.map(state => robot.{function}(...state)));")
    (call.folder / "main.mjs").write_text("\n".join([*lines, "console.log(JSON.stringify(results));", ""]))
    return call.shaped(json.loads(run(["node", "main.mjs"], call.folder)))


def octave_results(text: str, name: str, call: Call) -> list[Array]:
    """Call the functions of the file in Octave; vectors are given as rows and as columns in turn."""
    require("octave-cli")
    (call.folder / f"{name}.m").write_text(text)
    lines = [f"arm = {name}();"]
    for function in call.functions:
        for k, state in enumerate(zip(*call.arguments_of(function), strict=True)):
            between = ", " if k % 2 else "; "
            vectors = ", ".join(f"[{between.join(map(repr, row.tolist()))}]" for row in state)
            lines.append(f"x = arm.{function}({vectors}); printf('%.17g ', x.'); printf('\\n');")
    (call.folder / "main.m").write_text("\n".join([*lines, ""]))
    printed = run(["octave-cli", "--no-init-file", "--quiet", "main.m"], call.folder).splitlines()
    numbers = iter([list(map(float, line.split())) for line in printed])
    return call.shaped([[next(numbers) for _ in call.arguments[0]] for _ in call.functions])
