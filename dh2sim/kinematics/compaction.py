"""A table rewritten so that every frame is within reach of the arm; arm, links and joint coordinates stay.

Between the joint parts Z = Rz(theta) Tz(d) of a table the axes are fixed in the links, and a frame can slide along
its axis and turn about it: what one row then gains in theta and d the next one loses. Nearly parallel axes have
their common normal far away, and rows that go there lead hundreds of metres out and back. Such a row is rewritten, as
Hayati's, from where its axis already has a frame to where the next axis crosses the plane there. Rows within reach
keep every number.
"""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass, field, replace
from decimal import Decimal
from typing import Any, Final, TypeVar

from dh2sim.kinematics.conversion import Conversion, convert_rows
from dh2sim.kinematics.exact import (
    ONE,
    ZERO,
    Matrix,
    Vector,
    column,
    exact_arithmetic,
    exact_cross,
    exact_dot,
    exact_frame,
    exact_inverse,
    exact_joint_part,
    exact_length,
    exact_link_part,
    exact_pose,
    exact_product,
    exact_sum,
    exact_unit,
    rounded,
    rounded_atan2,
    rounded_matrix,
)
from dh2sim.kinematics.far_frames import PARALLEL, Survey, tail_of
from dh2sim.kinematics.transforms import rotate_tensor, rpy_from_rotation
from dh2sim.robot.links import BaseSpec, LinkSpec, MeshSpec, Pose, ToolSpec
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only

_ON_AXIS: Final = Decimal("1e-12")
"""Of the reach: an axis that passes as near as that goes through the point, and leaves x free."""
_NOWHERE: Final[Vector] = (ZERO, ZERO, ZERO)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Cut:
    """A row that was rewritten."""

    numbers: dict[str, Any] = field(default_factory=dict)
    """theta, d, a, alpha and beta."""
    convention: Convention
    before: Matrix
    """Where Z ends, in the link's own frame of old."""
    behind: Matrix
    """Where the next Z begins, there."""


def compact_rows(spec: RobotSpec) -> Conversion:
    """Rewrite a robot's table so that every frame is within reach of the arm.

    Rows between nearly parallel axes whose common normal is far away become Hayati's. Where axes are exactly parallel
    frames slide along them; the axis of a prismatic joint that runs out of reach is put through the arm. The other
    rows keep their numbers, but for theta and d of those that begin at a frame that was moved. A modified table stays
    modified behind its last Hayati row (see ``convert_rows``).

    All is computed to 60 digits from the table's own numbers and rounded once. Centres of mass, inertias and meshes
    are written down in the new frames; every body stays where it is.

    Returns:
        The robot, without a source file unless nothing had to be changed, and a note on every row that changed.
    """
    with exact_arithmetic():
        survey = Survey(spec)
        if not any(survey.is_far(i) for i in range(survey.n + 1)):
            return Conversion(spec=spec, notes=())
    distal = spec
    if any(row.convention is Convention.MODIFIED for row in spec.rows):
        distal = convert_rows(spec, Convention.STANDARD).spec
    with exact_arithmetic():
        hayati: frozenset[int] = frozenset()
        while True:
            compact, moved, notes = _rewritten(distal, hayati)
            # a row that starts where a frame was left, far from the way, may end too far out: the row before goes too
            more = hayati | Survey(compact).nearly_parallel_up_to_far()
            if more == hayati:
                break
            hayati = more
        if spec.convention is Convention.MODIFIED:
            compact = convert_rows(compact, Convention.MODIFIED).spec
            first = compact.rows[0]
            unmoved = first.theta == spec.rows[0].theta and first.d == spec.rows[0].d and not survey.far[0]
            if unmoved and first.convention is Convention.MODIFIED is spec.rows[0].convention:
                # row 1 begins where it began: nothing has to go from it to the base
                first = replace(first, a=spec.rows[0].a, alpha=spec.rows[0].alpha)
                compact = replace(compact, rows=(first, *compact.rows[1:]), base=spec.base)
        shifts = [_shift(old, new, T) for old, new, T in zip(spec.rows, compact.rows, moved, strict=True)]
        compact = replace(
            compact,
            rows=tuple(
                replace(new, link=_moved_body(old.link, T_new_old))
                for old, new, T_new_old in zip(spec.rows, compact.rows, shifts, strict=True)
            ),
            tool=_moved_tool(spec.tool, compact.tool.pose, shifts[-1]),
            payload=replace(spec.payload, com=_moved_point(spec.payload.com, shifts[-1])),
            convention=spec.convention,
            source_file=None,
        )
    return Conversion(spec=compact, notes=tuple(notes))


def _rewritten(spec: RobotSpec, hayati: Set[int]) -> tuple[RobotSpec, list[Matrix | None], list[str]]:
    """Return a distal table made compact, where its Z now end in their links' old frames, and what changed.

    Args:
        spec: The robot.
        hayati: Rows, counted from 1, that become Hayati's in any case.
    """
    survey = Survey(spec)
    rows, n = spec.rows, len(spec.rows)
    rewritten = [survey.is_far(i) or i in hayati for i in range(n + 1)]
    for i in range(n - 1, 0, -1):  # a row that is to end with its X cannot begin with one
        rewritten[i] = rewritten[i] or (rewritten[i + 1] and _begins_with_link(rows[i]))
    base, shift = spec.base, None
    notes = _Notes(survey)
    if rewritten[0]:
        base, shift = _moved_base(spec.base, survey)
        notes.end(0)
    tool = spec.tool
    made: list[Row] = []
    moved: list[Matrix | None] = []
    for i, row in enumerate(rows, start=1):
        begins = exact_inverse(exact_joint_part(row.theta, row.d))
        begins = begins if shift is None else exact_product(begins, shift)
        if rewritten[i - 1] and row.convention is Convention.MODIFIED:
            row = replace(row, a=0.0, alpha=0.0)
        has_no_d = row.convention is Convention.HAYATI and row.type is not JointType.PRISMATIC
        if not rewritten[i] and not (shift is not None and has_no_d):
            if shift is not None:
                row = replace(row, **_joint_numbers(exact_inverse(begins)))
                notes.row(row)
            shift = None
            made.append(row)
            moved.append(None)
            continue
        if i < n:
            cut = _lead(begins, survey, i, hayati=i in hayati)
            shift = exact_product(exact_inverse(survey.links[i]), cut.behind)
        else:
            cut, tool = _last(begins, survey, spec)
        made.append(replace(row, convention=cut.convention, **cut.numbers))
        moved.append(cut.before)
        notes.cut(i, made[-1])
    return replace(spec, rows=tuple(made), base=base, tool=tool), moved, notes.sentences


def _begins_with_link(row: Row) -> bool:
    return row.convention is Convention.MODIFIED and (row.a != 0.0 or row.alpha != 0.0)


def _joint_numbers(Z: Matrix) -> dict[str, Any]:
    return {"theta": rounded_atan2(Z[1][0], Z[0][0]), "d": rounded(Z[2][3])}


def _decimals(point: Array) -> Vector:
    x, y, z = (Decimal(float(value)) for value in point)
    return (x, y, z)


def _moved_base(base: BaseSpec, survey: Survey) -> tuple[BaseSpec, Matrix]:
    """Slide frame 0 to where its axis is nearest to base_link; return the base, and the new frame in the old one."""
    T = survey.links[0]
    z, place = column(T, 2), _decimals(survey.path.entry(0))
    if not survey.beside[1]:
        along = exact_dot(exact_sum(place, column(T, 3), -ONE), z)
        place = exact_sum(column(T, 3), z, along)
    T_old_new = exact_product(exact_inverse(T), exact_frame(place, column(T, 0), z))
    pose = replace(base.pose, xyz=read_only([rounded(value) for value in place]))
    return replace(base, pose=pose, mesh=_moved_mesh(base.mesh, exact_inverse(T_old_new))), T_old_new


def _last(begins: Matrix, survey: Survey, spec: RobotSpec) -> tuple[_Cut, ToolSpec]:
    """End the last row on its own axis, beside the tool, which takes the rest."""
    height = Decimal(float(survey.path.own(survey.n)[2]))
    frame = exact_frame((begins[0][3], begins[1][3], height), (ONE, ZERO, ZERO), (ZERO, ZERO, ONE))
    tool = rounded_matrix(exact_product(exact_inverse(frame), survey.links[-1]))
    row = spec.rows[-1]
    turned = row.convention is not Convention.MODIFIED and (row.alpha != 0.0 or row.beta != 0.0)
    rpy = rpy_from_rotation(tool) if turned else spec.tool.rpy
    cut = _Cut(
        numbers={**_joint_numbers(exact_product(exact_inverse(begins), frame)), "a": 0.0, "alpha": 0.0, "beta": 0.0},
        convention=Convention.STANDARD,
        before=frame,
        behind=frame,
    )
    return cut, ToolSpec(xyz=read_only(tool[:3, 3]), rpy=rpy)


def _lead(begins: Matrix, survey: Survey, i: int, *, hayati: bool) -> _Cut:
    """Rewrite row i: from where it begins, in link i's frame, to the next axis, as near to the arm as it can."""
    origin, z = column(begins, 3), column(begins, 2)
    T = survey.links[i]
    direction = column(T, 2)
    point = _decimals(survey.path.outlines[i][2]) if survey.beside[i + 1] else column(T, 3)
    cross = exact_cross(z, direction)
    sine, cosine = exact_length(cross), exact_dot(z, direction)
    if sine <= PARALLEL:
        foot = _slid(origin, z, survey, i)
        gap = exact_sum(point, foot, -ONE)
        end = exact_sum(point, z, -exact_dot(gap, z))
        return _cut(begins, foot, end, _sense(exact_sum(end, foot, -ONE), begins, survey), direction)
    along = exact_dot(exact_sum(point, origin, -ONE), exact_cross(direction, cross)) / exact_dot(cross, cross)
    foot = exact_sum(origin, z, along)  # of the common normal
    height = exact_dot(exact_sum(point, foot, -ONE), cross) / exact_dot(cross, cross)
    end = exact_sum(foot, cross, height)
    far = hayati or survey.leads_away(i, float(foot[2]), float(origin[2]))
    if not (far and abs(cosine) > sine):
        normal = exact_unit(cross)
        forwards = exact_dot(normal, column(begins, 0)) >= 0
        return _cut(begins, foot, end, normal if forwards else exact_sum(_NOWHERE, normal, -ONE), direction)
    foot = _slid(origin, z, survey, i) if survey.rows[i - 1].type is JointType.PRISMATIC else origin
    end = exact_sum(point, direction, exact_dot(exact_sum(foot, point, -ONE), z) / cosine)
    x = _sense(exact_sum(end, foot, -ONE), begins, survey)
    return _cut(begins, foot, end, x, direction, Convention.HAYATI)


def _slid(origin: Vector, z: Vector, survey: Survey, i: int) -> Vector:
    """Return the point of axis i, through ``origin``, that is beside the path's own, in link i's frame."""
    place = _decimals(survey.path.own(i))
    return exact_sum(origin, z, exact_dot(exact_sum(place, origin, -ONE), z))


def _sense(gap: Vector, begins: Matrix, survey: Survey) -> Vector:
    """Return x along a gap or against it, whichever leaves theta the smaller; as it was where there is no gap."""
    x_before = column(begins, 0)
    if exact_length(gap) <= _ON_AXIS * Decimal(survey.path.reach):
        return x_before
    x = exact_unit(gap)
    return x if exact_dot(x, x_before) >= 0 else exact_sum(_NOWHERE, x, -ONE)


def _cut(
    begins: Matrix,
    foot: Vector,
    end: Vector,
    x: Vector,
    direction: Vector,
    convention: Convention = Convention.STANDARD,
) -> _Cut:
    """Return the row from where it begins by way of x at ``foot`` to ``end`` on the next axis, along ``direction``.

    S. Hayati, M. Mirmirani, Improving the absolute positioning accuracy of robot manipulators, J. Robotic Systems
    2(4), 1985: z of the next axis is (sin beta, -sin alpha cos beta, cos alpha cos beta).
    """
    z = column(begins, 2)
    before = exact_frame(foot, x, z)
    Z = exact_product(exact_inverse(begins), before)
    s_beta, minus_y, cosine = (exact_dot(column(before, k), direction) for k in range(3))
    hayati = convention is Convention.HAYATI
    y = exact_unit(exact_cross(direction, x))
    return _Cut(
        numbers={
            **_joint_numbers(Z),
            "a": rounded(exact_dot(exact_sum(end, foot, -ONE), x)),
            "alpha": rounded_atan2(-minus_y, cosine),
            "beta": rounded_atan2(s_beta, exact_length((minus_y, cosine, ZERO))) if hayati else 0.0,
        },
        convention=convention,
        before=before,
        behind=exact_frame(end, exact_cross(y, direction), direction),
    )


def _shift(old: Row, new: Row, T_old_new: Matrix | None) -> Matrix | None:
    """Return the old DH frame of a row in its new one; None where they are the same."""
    tails = (tail_of(old), tail_of(new))
    if T_old_new is None and tails[0] == tails[1]:
        return None
    Z = exact_link_part(0.0, 0.0) if T_old_new is None else T_old_new
    return exact_inverse(exact_product(exact_inverse(tails[0]), Z, tails[1]))


_BodySpec = TypeVar("_BodySpec", LinkSpec, ToolSpec)


def _moved_body(body: _BodySpec, T_new_old: Matrix | None) -> _BodySpec:
    """Return what a link or the tool says of itself, written down in its new DH frame."""
    if T_new_old is None:
        return body
    inertia = None if body.inertia is None else rotate_tensor(rounded_matrix(T_new_old), body.inertia)
    com, mesh = _moved_point(body.com, T_new_old), _moved_mesh(body.mesh, T_new_old)
    return replace(body, com=com, inertia=inertia, mesh=mesh)


def _moved_tool(tool: ToolSpec, pose: Pose, T_new_old: Matrix | None) -> ToolSpec:
    """Return the tool with tool0 at ``pose`` in the new DH frame n."""
    shape = tool.shape
    if shape is not None and T_new_old is not None:
        shape = replace(shape, pose=_moved_pose(shape.pose, T_new_old))
    return replace(_moved_body(tool, T_new_old), xyz=pose.xyz, rpy=pose.rpy, shape=shape)


def _moved_point(point: Array | None, T_new_old: Matrix | None) -> Array | None:
    if point is None or T_new_old is None:
        return point
    at = _decimals(point)
    return read_only([rounded(exact_dot(row[:3], at) + row[3]) for row in T_new_old])


def _moved_mesh(mesh: MeshSpec | None, T_new_old: Matrix) -> MeshSpec | None:
    return None if mesh is None else replace(mesh, pose=_moved_pose(mesh.pose, T_new_old))


def _moved_pose(pose: Pose, T_new_old: Matrix) -> Pose:
    T = rounded_matrix(exact_product(T_new_old, exact_pose(pose.xyz, pose.rpy)))
    return Pose(xyz=read_only(T[:3, 3]), rpy=rpy_from_rotation(T))


class _Notes:
    """Sentences on what was changed, and why."""

    def __init__(self, survey: Survey) -> None:
        self._survey = survey
        self.sentences: list[str] = []

    def _stood(self, i: int) -> str:
        survey = self._survey
        return f"frame {i} was {survey.distance(i):.4g} m away from the arm, which is {survey.path.reach:.3g} m long"

    def end(self, i: int) -> None:
        """Note the first or the last frame."""
        what = "base" if i == 0 else "tool"
        self.sentences.append(f"{self._stood(i).capitalize()}; {what} changed with it.")

    def row(self, row: Row) -> None:
        """Note a row that only begins elsewhere."""
        self.sentences.append(f"{row.name} begins at the frame that was moved: its theta and d changed.")

    def cut(self, i: int, row: Row) -> None:
        """Note a row that was rewritten."""
        survey = self._survey
        if i == survey.n:
            if survey.is_far(i):
                self.end(i)
            else:
                self.sentences.append(f"{row.name} is a standard row now, as a Hayati row has no d.")
            return
        stood, following = self._stood(i), survey.rows[i].name
        if row.convention is Convention.HAYATI and survey.far[i]:
            self.sentences.append(
                f"{row.name} is a Hayati row now: {stood}, because its axis and that of {following} are nearly "
                f"parallel, {survey.angle(i):.2e} rad apart."
            )
        elif survey.far[i]:
            self.sentences.append(f"{row.name} ends beside the arm now: {stood}, along parallel axes.")
        elif survey.beside[i] or survey.beside[i + 1]:
            sliding = row.name if survey.beside[i] else following
            self.sentences.append(
                f"{row.name} ends beside the arm now: the axis of {sliding}, which may be anywhere, was out of reach."
            )
        else:
            self.sentences.append(f"{row.name} was rewritten, so that a row next to it ends beside the arm.")
