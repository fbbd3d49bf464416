"""Points and tensors seen from another frame, the same bits on every machine."""

from __future__ import annotations

from dh2sim.typing import Array, read_only


def move_point(T_a_b: Array, point: Array) -> list[float]:
    """Return a point of frame b in frame a.

    Args:
        T_a_b: Pose of frame b in frame a, shape (4, 4).
        point: m, in frame b, shape (3,).

    Returns:
        Its three coordinates, m.
    """
    x, y, z = point.tolist()
    return [row[0] * x + row[1] * y + row[2] * z + row[3] for row in T_a_b[:3].tolist()]


def rotate_tensor(T_a_b: Array, tensor: Array) -> Array:
    """Return a symmetric tensor given along the axes of frame b along those of frame a: R A Rᵀ.

    Args:
        T_a_b: Pose of frame b in frame a, of which the rotation R counts; shape (4, 4) or (3, 3).
        tensor: A, shape (3, 3).

    Returns:
        Exactly symmetric, shape (3, 3).
    """
    R, A = T_a_b.tolist(), tensor.tolist()
    RA = [[R[i][0] * A[0][j] + R[i][1] * A[1][j] + R[i][2] * A[2][j] for j in range(3)] for i in range(3)]
    turned = [[0.0] * 3 for _ in range(3)]
    for i in range(3):
        for j in range(i, 3):
            value = RA[i][0] * R[j][0] + RA[i][1] * R[j][1] + RA[i][2] * R[j][2]
            turned[i][j] = turned[j][i] = value + 0.0
    return read_only(turned)
