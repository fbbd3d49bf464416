"""Robot files to RobotSpecs.

The robots that come with dh2sim.

A tree of nodes against the models of a file: every complaint becomes a problem with its place.

The content of a robot file to a RobotSpec: defaults filled in, SI units, read-only arrays.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from dh2sim.errors import Dh2simError, UnknownRobotError
from dh2sim.messages import closest, did_you_mean, listed, shown
from dh2sim.robot.checks import check, default_name
from dh2sim.robot.expressions import evaluate_parameters
from dh2sim.robot.schema import (
    PROBLEM,
    ActuatorEntry,
    Context,
    DynamicsEntry,
    JointEntry,
    LimitsEntry,
    LinkEntry,
    MeshEntry,
    PoseEntry,
    RobotEntry,
)
from dh2sim.robot.spec import (
    ActuatorSpec,
    ActuatorType,
    BaseSpec,
    Convention,
    Dynamics,
    JointType,
    Limits,
    LinkSpec,
    MeshSpec,
    Pose,
    RobotSpec,
    Row,
    SourceFile,
    Units,
)
from dh2sim.robot.yaml_tree import MAX_BYTES, Loc, Node, Report, check_size, compose, decode, path_of
from dh2sim.typing import Array, read_only

_PACKAGE: Final = Path(__file__).resolve().parent.parent
_FOLDERS: Final = (_PACKAGE / "robots", _PACKAGE.parent / "robots")
"""In an installed wheel; in a checkout."""


def builtin_robots() -> tuple[str, ...]:
    """Return the names of the robots that come with dh2sim, sorted."""
    return tuple(sorted(path.stem for path in _folder().glob("*.yaml")))


def builtin_path(name: str) -> Path | None:
    """Return the file of a robot that comes with dh2sim, with or without ``.yaml``; None for others."""
    stem = name.removesuffix(".yaml")
    return _folder() / f"{stem}.yaml" if stem in builtin_robots() else None


def _folder() -> Path:
    """Return the folder of robot files; the package's own one where there is one."""
    return next((folder for folder in _FOLDERS if folder.is_dir()), _FOLDERS[0])


Model = TypeVar("Model", bound=BaseModel)


class _Nothing:
    """Stands for YAML's null, so that no optional field takes it."""

    def __str__(self) -> str:
        return "nothing"


_NOTHING: Final = _Nothing()


def read_structure(root: Node, context: Context, report: Report) -> RobotEntry | None:
    """Return the robot file's content, or None with what is wrong noted in ``report``."""
    return read_model(RobotEntry, root, context, report)


def read_model(model: type[Model], root: Node, context: Context, report: Report) -> Model | None:
    """Return the content of a file that ``model`` describes, or None with what is wrong noted in ``report``."""
    try:
        return model.model_validate(_plain(root), context=context)
    except ValidationError as error:
        errors = error.errors(include_url=False, include_input=False)
    guessed = {
        (*loc[:-1], closest(str(loc[-1]), _keys(model, loc[:-1])))
        for loc in (details["loc"] for details in errors if details["type"] == "extra_forbidden")
    }
    for details in errors:
        if details["type"] != "missing" or details["loc"] not in guessed:
            _note(model, details, root, report)
    return None


def _plain(node: Node) -> object:
    """Return a node's value as pydantic takes it."""
    match node.value:
        case None:
            return _NOTHING
        case dict() as entries:
            return {key: _plain(entry.value) for key, entry in entries.items()}
        case list() as items:
            return [_plain(item) for item in items]
        case scalar:
            return scalar


def _note(model: type[BaseModel], details: ErrorDetails, root: Node, report: Report) -> None:
    """Note a validation error at the place of the file that it is about."""
    loc = details["loc"]
    parent = root.at(*loc[:-1])
    match details["type"]:
        case "extra_forbidden":
            entry = root.entry(*loc)
            key, allowed = str(loc[-1]), _keys(model, loc[:-1])
            message = f"unknown key {shown(key)}.{did_you_mean(key, allowed)} Allowed keys: {listed(allowed)}"
            if entry is not None:
                report.add(entry.line, entry.column, loc[:-1], message)
        case "missing":
            if parent is not None and not parent.wrong:
                report.add(parent.line, parent.column, loc[:-1], f"missing key '{loc[-1]}'")
        case _:
            node = root.at(*loc) or parent or root
            if not node.wrong:
                report.add(node.line, node.column, loc, _message(model, details, node))


def _message(model: type[BaseModel], details: ErrorDetails, node: Node) -> str:
    found = shown(node.value)
    match details["type"]:
        case kind if kind == PROBLEM:
            return str(details["ctx"]["message"])
        case "model_type" | "dict_type":
            keys = _keys(model, details["loc"])
            return f"expected a mapping{f' with the keys {listed(keys)}' if keys else ''}, found {found}"
        case "list_type":
            return f"expected a list, found {found}"
        case "too_short":
            return "the list is empty; at least one entry is needed"
        case _:
            return f"{details['msg']}, found {found}"


def _keys(model: type[BaseModel], loc: Loc) -> Mapping[str, Any] | tuple[str, ...]:
    """Return the keys that the mapping at a place may hold; none where they are free."""
    here: type[BaseModel] | None = model
    for part in loc:
        if isinstance(part, str):
            field = here.model_fields.get(part) if here else None
            here = _model_in(field.annotation) if field else None
    return here.model_fields if here else ()


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """Return the model that a field's type holds: itself, or inside a list or an optional."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((model for inner in get_args(annotation) if (model := _model_in(inner))), None)


def to_spec(entry: RobotEntry, root: Node, source: SourceFile) -> RobotSpec:
    """Return the robot that a file describes.

    Args:
        entry: The file's content, valid as a whole.
        root: The tree it was read from, for the places that later messages name.
        source: The file.
    """
    return _Converter(entry, root, source).robot()


class _Converter:
    """Knows the units of one file."""

    def __init__(self, entry: RobotEntry, root: Node, source: SourceFile) -> None:
        self._entry = entry
        self._root = root
        self._source = source
        self._units = Units(angle=entry.units.angle, length=entry.units.length)

    def robot(self) -> RobotSpec:
        entry = self._entry
        rows = tuple(self._row(index, joint) for index, joint in enumerate(entry.joints))
        moving = [row for row in rows if row.type.moves]
        return RobotSpec(
            name=entry.name,
            rows=rows,
            description=entry.description,
            source=entry.source,
            convention=entry.convention,
            units=self._units,
            parameters=MappingProxyType(dict(entry.parameters)),
            base=BaseSpec(
                pose=self._pose(entry.base),
                mesh=self._mesh(entry.base.mesh, ("base", "mesh")),
                color=_color(entry.base.color),
            ),
            tool=self._pose(entry.tool),
            gravity=read_only(entry.gravity),
            configurations=MappingProxyType(
                {name: self._coordinates(values, moving) for name, values in entry.configurations.items()}
            ),
            source_file=self._source,
        )

    def _row(self, index: int, joint: JointEntry) -> Row:
        units = self._units
        return Row(
            name=joint.name or default_name(index),
            type=joint.type,
            convention=Convention(joint.convention or self._entry.convention),
            a=units.metres(joint.a),
            alpha=units.radians(joint.alpha),
            d=units.metres(joint.d),
            theta=units.radians(joint.theta),
            beta=units.radians(joint.beta),
            flip=joint.flip,
            limits=self._limits(joint.limits, turns=joint.type.turns),
            dynamics=_dynamics(joint.dynamics),
            link=self._link(joint.link, ("joints", index, "link")),
            actuator=_actuator(joint, self._entry.actuators),
        )

    def _limits(self, limits: LimitsEntry, *, turns: bool) -> Limits:
        position, velocity = limits.position, limits.velocity
        to_si = self._units.coordinate
        return Limits(
            position=(to_si(position[0], turns=turns), to_si(position[1], turns=turns)) if position else None,
            velocity=None if velocity is None else to_si(velocity, turns=turns),
            effort=limits.effort,
        )

    def _link(self, link: LinkEntry, loc: Loc) -> LinkSpec:
        return LinkSpec(
            mass=link.mass,
            com=None if link.com is None else self._lengths(link.com),
            inertia=None if link.inertia is None else read_only(link.inertia.matrix),
            density=link.density,
            radius=None if link.radius is None else self._units.metres(link.radius),
            color=_color(link.color),
            mesh=self._mesh(link.mesh, (*loc, "mesh")),
        )

    def _mesh(self, mesh: MeshEntry | None, loc: Loc) -> MeshSpec | None:
        if mesh is None:
            return None
        loc = (*loc, "file")
        node = self._root.at(*loc)
        place = f":{node.line}:{node.column}" if node else ""
        location = f"{self._source.path}{place}: {path_of(loc)}"
        return MeshSpec(file=mesh.file, scale=mesh.scale, pose=self._pose(mesh), location=location)

    def _pose(self, pose: PoseEntry | MeshEntry) -> Pose:
        return Pose(xyz=self._lengths(pose.xyz), rpy=read_only([self._units.radians(x) for x in pose.rpy]))

    def _lengths(self, values: Sequence[float]) -> Array:
        return read_only([self._units.metres(value) for value in values])

    def _coordinates(self, values: Sequence[float], moving: Sequence[Row]) -> Array:
        pairs = zip(values, moving, strict=True)
        return read_only([self._units.coordinate(value, turns=row.type.turns) for value, row in pairs])


def _dynamics(dynamics: DynamicsEntry) -> Dynamics:
    return Dynamics(damping=dynamics.damping, friction=dynamics.friction, armature=dynamics.armature)


def _color(color: Sequence[float] | None) -> tuple[float, float, float, float] | None:
    """Return a colour with its alpha, opaque where the file gives none."""
    if color is None:
        return None
    red, green, blue, alpha = (*color, 1.0)[:4]
    return red, green, blue, alpha


def _actuator(joint: JointEntry, shared: ActuatorEntry) -> ActuatorSpec:
    """Return a joint's actuator: its own, else the file's; gains are inherited where the types agree."""
    if joint.type is JointType.FIXED:
        return ActuatorSpec(type=ActuatorType.NONE)
    shared_type = shared.type or ActuatorType.POSITION
    own = joint.actuator
    kind = own.type or shared_type
    same = kind is shared_type
    return ActuatorSpec(
        type=kind,
        kp=own.kp if own.kp is not None or not same else shared.kp,
        kv=own.kv if own.kv is not None or not same else shared.kv,
    )


def load_robot(path_or_name: str | os.PathLike[str]) -> RobotSpec:
    """Return the robot that a file describes.

    Args:
        path_or_name: A robot file; or the name of a robot that comes with dh2sim, with or without ``.yaml``.
            A path that exists wins.

    Raises:
        UnknownRobotError: There is neither such a file nor such a robot.
        RobotFileError: The file is wrong; the error holds everything that is.
        Dh2simError: The file cannot be read.
    """
    given = os.fsdecode(path_or_name)
    path, file = _find(given)
    try:
        with path.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
            size = max(len(data), os.fstat(stream.fileno()).st_size)
    except OSError as error:
        raise Dh2simError(f"{given}: cannot be read: {error.strerror or error}") from error
    check_size(size, Report(file))
    return parse_robot(data, file=file, directory=path.parent)


def parse_robot(
    text: str | bytes, *, file: str = "<string>", directory: Path | None = None, mesh_files: bool = True
) -> RobotSpec:
    """Return the robot that the text of a robot file describes.

    Args:
        text: The file's content.
        file: Its name, for messages.
        directory: Where paths in it start; by default the current folder.
        mesh_files: Whether it may name mesh files; if not, no path in it is followed.

    Raises:
        RobotFileError: The text is wrong; the error holds everything that is.
    """
    data = text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text
    report = Report(file)
    decoded = decode(data, report)
    root = compose(decoded, report)
    parameters = evaluate_parameters(root, report)
    folder = directory or Path.cwd()
    context = Context(parameters=parameters, directory=folder if mesh_files else None)
    entry = read_structure(root, context, report)
    check(root, parameters, report)
    if entry is None or report.problems:
        raise report.error()
    source = SourceFile(name=Path(file).name, path=file, text=decoded, sha256=hashlib.sha256(data).hexdigest())
    return to_spec(entry, root, source)


def _find(given: str) -> tuple[Path, str]:
    """Return the file that a path or a name stands for, and what messages call it."""
    path = Path(given)
    if given and os.path.lexists(given):
        if path.is_dir():
            named = given in builtin_robots()
            hint = f"; '{given}.yaml' is the robot that comes with dh2sim" if named else ""
            raise Dh2simError(f"{given}: is a folder, not a robot file{hint}")
        return path, given
    builtin = builtin_path(given)
    if builtin is not None:
        return builtin, builtin.name
    known = builtin_robots()
    hint = did_you_mean(given.removesuffix(".yaml"), known)
    list_of_them = f"Robots that come with dh2sim: {listed(known)}"
    raise UnknownRobotError(f"there is no file and no robot named {shown(given)}.{hint} {list_of_them}")
