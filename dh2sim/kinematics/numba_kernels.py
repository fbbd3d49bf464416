"""Poses and Jacobians of batches by compiled code: the straight line of a chain, for many vectors at once.

The operations are those of :mod:`dh2sim.kinematics.straight_line`. They become a function of Python that Numba
compiles, for 16 joint vectors at a time, so that the processor's vector instructions are used. For that sines and
cosines must not branch: angles are reduced by Cody and Waite's method with sums that keep what rounding loses, and
their polynomials are fdlibm's. They are correct to 1 ulp for angles of up to ``LARGEST``; beyond, NumPy computes.
Dekker's sum needs its first number to be the larger; where it is not, near multiples of a quarter turn, the sums here
are exact.

Results differ from NumPy's in the last bits, and from one processor to another: nothing that reaches a file is
computed here. Sources: W. J. Cody, W. Waite, Software Manual for the Elementary Functions, 1980; T. J. Dekker, A
floating-point technique for extending the available precision, Numerische Mathematik 18, 1971; Sun Microsystems,
fdlibm 5.3, k_sin.c and k_cos.c, and FreeBSD's form of the latter.
"""

from __future__ import annotations

import hashlib
import os
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from pickle import UnpicklingError
from tempfile import NamedTemporaryFile
from typing import Any, Final

from dh2sim.extras import require_extra
from dh2sim.kinematics.batches import Kernel
from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.straight_line import Kind, number_text, statements, traced
from dh2sim.kinematics.trace import COSINE, SINE, VARIABLE, Token, Trace, live_nodes
from dh2sim.typing import Array

LARGEST: Final = 1.6e6
"""Angle, rad, up to which sines and cosines are correct: 2^20 quarter turns, whose products with parts of pi/2 of 33
bits are exact."""
_LANES: Final = 16
"""Joint vectors at a time: a few vector registers of each number."""
_COPIED: Final = 48
"""Results that are copied in one loop: the time to compile a loop grows faster than its length."""
_SOURCE: Final = '''\
"""Made by dh2sim: poses or Jacobians of a robot, for Numba. May be deleted at any time."""
from numba import njit
from numpy import empty, float64, int64, zeros

OPTIONS = {{"nogil": True, "error_model": "numpy", "fastmath": {{"contract"}}, "cache": {cache}}}


@njit(inline="always", **OPTIONS)
def with_sign(x, quarter):
    # changes the sign of x where the second bit of quarter is set
    return int64(float64(x).view(int64) ^ ((quarter & 2) << 62)).view(float64)


@njit(inline="always", **OPTIONS)
def sine_and_cosine(x):
    # x = k pi/2 + y + tail; the parts of pi/2 have 33 bits, so that products with k are exact, contracted or not
    shifted = x * 0.6366197723675814 + 6755399441055744.0
    quarter = float64(shifted).view(int64)  # k in its last bits
    k = shifted - 6755399441055744.0
    r = x - k * 1.57079632673412561417
    a = r - k * 6.07710050630396597660e-11
    t = ((r - a) - k * 6.07710050630396597660e-11) - k * 2.02226624871116645580e-21
    y = a + t
    tail = ((a - y) + t) - k * 8.47842766036889956997e-32
    z = y * y
    p = z * 1.58969099521155010221e-10 - 2.50507602534068634195e-08
    p = z * p + 2.75573137070700676789e-06
    p = z * p - 1.98412698298579493134e-04
    p = z * p + 8.33333333332248946124e-03
    p = z * p - 1.66666666666666324348e-01
    s = y + (p * (z * y) + tail)
    p = z * -1.13596475577881948265e-11 + 2.08757232129817482790e-09
    p = z * p - 2.75573143513906633035e-07
    p = z * p + 2.48015872894767294178e-05
    p = z * p - 1.38888888888741095749e-03
    p = z * p + 4.16666666666666019037e-02
    half = 0.5 * z
    w = 1.0 - half
    c = w + (p * (z * z) + (((1.0 - w) - half) - y * tail))
    odd = (quarter & 1) != 0
    return with_sign(c if odd else s, quarter), with_sign(s if odd else c, quarter + 1)


@njit("boolean(float64[:, ::1], float64[:, ::1])", **OPTIONS)
def kernel(q, out):
    far = 0
    a = zeros({inputs})
    sines, cosines = empty({angles}), empty({angles})
    b = empty({outputs})
    for start in range(0, len(q), {lanes}):
        count = min({lanes}, len(q) - start)
        for i in range(count):
{gather}
        for i in range({angles}):
            sines[i], cosines[i] = sine_and_cosine(a[i])
        for i in range({lanes}):
{compute}
{scatter}
    return far == 0
'''


def numba_kernel(
    kind: Kind, chain: KinematicChain, frame: str, carriers: int, T_joint_frame: Array, rows: int
) -> Kernel | None:
    """Return a function that computes poses or Jacobians of a frame.

    It is compiled when it is first asked for, in some seconds, and kept on disk in the user's folder for such things,
    from where it is read in milliseconds.

    Args:
        kind: Which of them.
        chain: The robot; the function is kept there.
        frame: Name of the frame.
        carriers: Number of joints that carry the frame.
        T_joint_frame: Its pose in the last of them, shape (4, 4).
        rows: Of the result: a pose may lack its last one.

    Returns:
        None where no coordinate enters the result.

    Raises:
        MissingExtraError: Numba is not installed.
    """
    key = (kind, frame, rows)
    if key not in chain.code.compiled:
        require_extra("fast", "numba", what="backend='numba'")
        trace, entries = traced(kind, chain, carriers, T_joint_frame)
        entries = entries[: rows * (kind.columns or chain.n)]
        varies = any(isinstance(entry, Token) for entry in entries)
        chain.code.compiled[key] = _compiled(trace, entries) if varies else None
    return chain.code.compiled[key]


def cache_folder() -> Path:
    """Return where compiled code is kept: the user's folder for caches, by the conventions of the platform."""
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = str(Path.home() / "Library" / "Caches")
    else:
        base = os.environ.get("XDG_CACHE_HOME") or ""
        base = base if Path(base).is_absolute() else str(Path.home() / ".cache")
    return Path(base) / "dh2sim" / "kernels"


def _compiled(trace: Trace, entries: list[Any]) -> Kernel:
    try:
        kernel: Kernel = _loaded(_kept(_source(trace, entries, cache=True)))
    except (OSError, RuntimeError, EOFError, UnpicklingError):
        # no home, a folder that cannot be written to, damaged files: compiled for this process alone
        scope: dict[str, Any] = {}
        exec(_source(trace, entries, cache=False), scope)
        kernel = scope["kernel"]
    return kernel


def _loaded(path: Path) -> Kernel:
    """Return the kernel of a file, which Numba compiles, or reads from beside it."""
    spec = spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[path.stem] = module_from_spec(spec)  # by this name what is kept refers to it
    spec.loader.exec_module(module)
    kernel: Kernel = module.kernel
    return kernel


def _kept(source: str) -> Path:
    """Write a source file, unless it is there already, and return its path."""
    folder = cache_folder()
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    path = folder / f"dh2sim_kernel_{hashlib.sha256(source.encode()).hexdigest()[:32]}.py"
    if not path.is_file() or path.read_text(encoding="utf-8") != source:
        with NamedTemporaryFile("w", dir=folder, suffix=".partial", encoding="utf-8", delete=False) as file:
            file.write(source)
        Path(file.name).replace(path)
    return path


def _source(trace: Trace, entries: list[Any], *, cache: bool) -> str:
    """Return the text of a module with a function ``kernel``."""
    live = live_nodes(trace, entries)
    functions = {SINE: "sines", COSINE: "cosines"}
    turned = {trace.nodes[i].operands[0]: None for i in live if trace.nodes[i].kind in functions}
    others = (i for i, node in enumerate(trace.nodes) if node.kind == VARIABLE and i not in turned)
    place = {i: _LANES * k for k, i in enumerate([*turned, *others])}
    compute = [f"v{i} = a[i + {start}]" for i, start in place.items()]
    compute += [f"far |= not abs(v{i}) <= {LARGEST!r}" for i in place]
    for i in live:
        if (kind := trace.nodes[i].kind) in functions:
            compute.append(f"v{i} = {functions[kind]}[i + {place[trace.nodes[i].operands[0]]}]")
    compute += [text for _, text in statements(trace, live)]
    varying = {k: j for j, k in enumerate(k for k, entry in enumerate(entries) if isinstance(entry, Token))}
    # four results of one joint vector stand side by side: so they are transposed by registers, and copied as one
    places = [f"b[4 * i + {4 * _LANES * (j // 4) + j % 4}]" for j in varying.values()]
    compute += [f"{place} = {number_text(entries[k])} + 0.0" for place, k in zip(places, varying, strict=True)]
    scatter = []
    for start in range(0, len(entries), _COPIED):
        part = range(start, min(start + _COPIED, len(entries)))
        scatter.append("        for i in range(count):")
        scatter += [f"            r{k} = {places[varying[k]]}" for k in part if k in varying]  # read before written
        scatter += [
            f"            out[start + i, {k}] = {f'r{k}' if k in varying else repr(entries[k] + 0.0)}" for k in part
        ]
    return _SOURCE.format(
        cache=cache,
        lanes=_LANES,
        inputs=_LANES * len(place),
        angles=_LANES * len(turned),
        outputs=4 * _LANES * -(-len(varying) // 4),
        gather=_indented(f"a[i + {start}] = q[start + i, {int(trace.nodes[i].value)}]" for i, start in place.items()),
        compute=_indented(compute),
        scatter="\n".join(scatter),
    )


def _indented(lines: Any) -> str:
    return "\n".join(f"            {line}" for line in lines)
