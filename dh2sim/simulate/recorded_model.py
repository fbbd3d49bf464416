"""The model in a run's attributes, compiled in a process of its own.

A run may come from a stranger. What dh2sim writes into a run reads no file and is of moderate size, so nothing else
is given to MuJoCo: elements that are not on the list, attributes that name files, and huge pictures are refused.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from dh2sim.errors import Dh2simError, ModelError, RunError
from dh2sim.formats.mjcf.compile import compile_text
from dh2sim.formats.mjcf.elements import MjcfOptions
from dh2sim.formats.mjcf.includes import MAX_ELEMENTS
from dh2sim.formats.mjcf.scene import to_scene
from dh2sim.messages import shown
from dh2sim.model.build import build_model
from dh2sim.robot.fields import name_problem
from dh2sim.robot.read import parse_robot
from dh2sim.robot.row import ActuatorType
from dh2sim.robot.variation import Variation
from dh2sim.simulate.design_plants import PlantRecipe

if TYPE_CHECKING:
    import mujoco

MOST_BYTES: Final = 16 * 2**20
LARGEST: Final = 8192
"""Pixels along a side of a texture, a shadow map or the off-screen buffer."""
_ELEMENTS: Final = frozenset(
    """mujoco compiler option flag default joint freejoint site geom inertial body worldbody asset material texture
    contact exclude equality connect weld actuator position velocity motor sensor jointpos jointvel jointactuatorfrc
    framepos framequat keyframe key statistic visual headlight global quality rgba map light camera include""".split()  # noqa: SIM905
)
"""What models in runs are made of; none of them reads a file or takes more memory than its text, but for pictures."""
_SIDES: Final = (
    "width",
    "height",
    "offwidth",
    "offheight",
    "shadowsize",
    "offsamples",
    "gridsize",
    "memory",
    "nstack",
)
_FILES: Final = re.compile("file|plugin|content_type")


def recorded_model(
    attributes: Mapping[str, Any], *, scene: bool = False, design: Mapping[str, float] = MappingProxyType({})
) -> mujoco.MjModel:
    """Compile the model that a run was made with.

    Args:
        attributes: Of the run.
        scene: Whether with floor, light and camera.
        design: Numbers of the robot file that the rollout has of its own.

    Raises:
        RunError: There is none, it is not one as dh2sim writes them, or MuJoCo refuses it.
    """
    missing = [name for name in ("robot", "mjcf", "scene") if not isinstance(attributes.get(name), str)]
    if missing:
        raise RunError(f"the attribute '{missing[0]}' is missing, so there is no model to show")
    if problem := name_problem(attributes["robot"]):
        raise RunError(f"the model in the run's attributes is not one that dh2sim wrote: {problem}")
    if design:
        attributes = {**attributes, **_of_design(attributes, design)}
    own = f"{attributes['robot']}.xml"
    for name in ("mjcf", "scene"):
        problem = next(_problems(attributes[name], included=own if name == "scene" else ""), None)
        if problem is not None:
            raise RunError(f"the model in the run's attributes is not one that dh2sim wrote: {name} {problem}")
    try:
        if scene:
            return compile_text(attributes["scene"], {own: attributes["mjcf"]})
        return compile_text(attributes["mjcf"], {})
    except ModelError as error:
        raise RunError(f"MuJoCo refuses the model in the run's attributes: {error}") from error


def _of_design(attributes: Mapping[str, Any], design: Mapping[str, float]) -> dict[str, str]:
    """Return the model and the scene of a design, made of the robot file in the attributes.

    Raises:
        RunError: There is no robot file, or it has no such design.
    """
    text, settings = attributes.get("robot_file"), attributes.get("settings")
    if not isinstance(text, str) or not text or not isinstance(settings, Mapping):
        raise RunError("the run has no robot file that the rollout's own model can be made of")
    try:
        spec = parse_robot(text, file="robot_file", mesh_files=False)
        model = build_model(Variation(spec, list(design)).make(list(design.values())))
        kinds = {*re.findall(r"<(position|velocity|motor) name=", str(attributes["mjcf"]))}
        kind = ActuatorType(min(kinds, default="none")) if len(kinds) < 2 else None  # several: the robot file's own
        recipe = PlantRecipe(
            actuation=kind,
            mjcf=MjcfOptions(floating_base=settings.get("floating_base") is True),
        )
        return {"mjcf": recipe.text(model), "scene": to_scene(recipe.shown(model))}
    except Dh2simError as error:
        raise RunError(f"the rollout's own model cannot be made of the robot file: {error}") from error


def _problems(text: str, *, included: str) -> Iterator[str]:
    """Yield what a model has that those of runs do not have."""
    if len(text) > MOST_BYTES or "<!DOCTYPE" in text or "<!ENTITY" in text:
        yield "is too large, or declares entities"
        return
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        yield f"is not XML: {error}"
        return
    if sum(1 for _ in root.iter()) > MAX_ELEMENTS:
        yield f"has more than {MAX_ELEMENTS} elements"
        return
    for element in root.iter():
        if element.tag not in _ELEMENTS:
            yield f"has an element {shown(element.tag)}"
        for name, value in element.attrib.items():
            allowed = element.tag == "include" and (name, value) == ("file", included)
            if _FILES.search(name) and not allowed:
                yield f"has an attribute {shown(name)} of {element.tag}"
            if name in _SIDES and not _is_moderate(value):
                yield f"has {element.tag} {shown(name)} {shown(value)}"


def _is_moderate(text: str) -> bool:
    try:
        return all(math.fabs(float(word)) <= LARGEST for word in text.split())
    except ValueError:
        return False
