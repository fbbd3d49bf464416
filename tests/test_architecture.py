"""The shape of the package: imports have no rings, and a name means one thing in a folder."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import dh2sim

PACKAGE = Path(dh2sim.__file__).parent


@cache
def _modules() -> dict[str, ast.Module]:
    """Every module of the package by its name, parsed."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        found[name] = ast.parse(path.read_text(encoding="utf-8"))
    return found


def _imports(tree: ast.Module) -> Iterator[str]:
    """Yield the package's modules that a module imports anywhere: at its top, in functions, or for types alone."""
    modules = _modules()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in modules)
        elif isinstance(node, ast.ImportFrom) and node.module in modules:
            inner = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from (name if name in modules else node.module for name in inner)


def test_no_modules_import_each_other_in_a_ring() -> None:
    # the package's own __init__ only names where its public names live
    graph = {name: set(_imports(tree)) - {"dh2sim"} for name, tree in _modules().items() if name != "dh2sim"}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        raise AssertionError("a ring of imports: " + " -> ".join(error.args[1])) from None


def test_a_name_is_defined_in_one_module_of_a_folder() -> None:
    homes = defaultdict(list)
    for module, tree in _modules().items():
        folder = module.rpartition(".")[0]
        for node in tree.body:
            if isinstance(node, ast.ClassDef | ast.FunctionDef) and not node.name.startswith("__"):
                private = node.name.startswith("_") and isinstance(node, ast.FunctionDef)
                if not private:  # a module's own small helpers are not known outside it
                    homes[folder, node.name].append(module)
    assert {key: modules for key, modules in homes.items() if len(modules) > 1} == {}
