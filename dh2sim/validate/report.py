"""Report of a validation, as JSON and as JUnit XML."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from dh2sim.errors import EngineCapacityError, EngineError
from dh2sim.messages import counted, listed
from dh2sim.model.slips import Slip


class Quantity(StrEnum):
    """Quantity that is compared."""

    POSE = "pose"
    JACOBIAN = "jacobian"
    MASS_MATRIX = "mass matrix"
    BIAS = "bias force"
    GRAVITY = "gravity force"
    INERTIA = "link inertia"
    UNIT_QUATERNIONS = "unit quaternions"
    FILE = "file"
    ENERGY = "energy order"
    MOMENTUM = "momentum"
    REST = "rest"
    TRACKING = "tracking"
    INVERSE = "inverse dynamics"
    SELF_CONTACT = "self-contact"
    CLOSED = "loops at home"
    FREEDOMS = "freedoms of loops"
    LOOP_GAP = "loops in motion"


@dataclass(frozen=True, slots=True, kw_only=True)
class Worst:
    """Where the worst error was found."""

    where: str
    """Frame, joint or link."""
    q: tuple[float, ...]
    """Joint vector, rad and m; empty where it does not depend on one."""
    sample: int | None = None
    """Index among the sampled configurations."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LeftOut:
    """Rollouts that a check leaves out, as the controls of joints were clipped: their motors are too weak."""

    rollouts: int
    joints: Mapping[str, int]
    """Number of them by joint."""

    def __str__(self) -> str:
        """Return how many rollouts are left out, and the joints."""
        joints = ", ".join(f"{joint} in {count}" for joint, count in self.joints.items())
        were = "rollout was" if self.rollouts == 1 else "rollouts were"
        return f"{self.rollouts} {were} left out, where a motor is too weak: {joints}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """Comparison of one quantity of one engine with its reference."""

    engine: str
    quantity: Quantity
    ok: bool | None
    """None if it was not checked, for the ``reason`` given."""
    reference: str = "table"
    samples: int = 0
    frames: int | None = None
    """Number of frames compared; for poses."""
    max_position_error: float | None = None
    """m; for poses."""
    max_rotation_error: float | None = None
    """rad; for poses."""
    max_error: float | None = None
    """For everything but poses; relative for dynamics."""
    tolerance: float | None = None
    """Positions and the linear part of a Jacobian may differ by this times the larger of 1 m and the reach."""
    reason: str | None = None
    worst: Worst | None = None
    left_out: LeftOut | None = None
    seconds: float = field(default=0.0, compare=False)
    """Time that the comparison took."""

    def to_json(self) -> dict[str, Any]:
        """Return the entry of the ``engines`` list, without what does not apply."""
        entry: dict[str, Any] = {"engine": self.engine, "quantity": self.quantity.value}
        for key, value in (
            ("reference", self.reference if self.ok is not None else None),
            ("samples", self.samples or None),
            ("frames", self.frames),
            ("max_position_error", self.max_position_error),
            ("max_rotation_error", self.max_rotation_error),
            ("max_error", self.max_error),
            ("tolerance", self.tolerance),
        ):
            if value is not None:
                entry[key] = _finite(value)
        entry["ok"] = self.ok
        if self.reason is not None:
            entry["reason"] = self.reason
        if self.left_out is not None:
            entry["left_out"] = {"rollouts": self.left_out.rollouts, "joints": dict(self.left_out.joints)}
        if self.ok is False and self.worst is not None:
            entry["worst"] = {
                "where": self.worst.where,
                "q": list(self.worst.q),
                "sample": self.worst.sample,
            }
        return entry


def unread_check(engine: str, package: str, error: ImportError | EngineCapacityError | EngineError) -> Check:
    """Return why an engine did not read its file: not installed or too small, which says nothing of it, or wrong.

    Args:
        engine: The engine.
        package: What installs it, as given to ``pip install``.
        error: What it raised.
    """
    if isinstance(error, ImportError):
        reason = f"not installed ({error}); pip install {package}"
        return Check(engine=engine, quantity=Quantity.POSE, ok=None, reason=reason)
    if isinstance(error, EngineCapacityError):
        return Check(engine=engine, quantity=Quantity.POSE, ok=None, reason=str(error))
    return Check(engine=engine, quantity=Quantity.FILE, ok=False, reason=str(error))


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotReport:
    """All checks of a robot."""

    name: str
    samples: int
    reach: float
    """m."""
    checks: tuple[Check, ...]
    slips: tuple[Slip, ...] = ()
    """What looks like a slip in the robot; it fails nothing."""
    warnings: tuple[str, ...] = ()
    """What MuJoCo finds questionable in the files, one sentence each; it fails nothing."""

    def __repr__(self) -> str:
        failed = [f"{check.engine} {check.quantity.value}" for check in self.checks if check.ok is False]
        verdict = f"failed: {listed(failed)}" if failed else "ok"
        return f"<RobotReport of '{self.name}': {counted(len(self.checks), 'check')}, {verdict}>"

    @property
    def ok(self) -> bool:
        """Whether no check failed."""
        return all(check.ok is not False for check in self.checks)

    def to_json(self) -> dict[str, Any]:
        """Return the entry of the ``robots`` list."""
        return {
            "name": self.name,
            "ok": self.ok,
            "samples": self.samples,
            "reach": self.reach,
            "engines": [check.to_json() for check in self.checks],
            "notes": [slip.to_json() for slip in self.slips],
            "warnings": list(self.warnings),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class ValidationReport:
    """All robots of a validation."""

    robots: tuple[RobotReport, ...]

    def __repr__(self) -> str:
        return f"<ValidationReport: {listed(map(repr, self.robots))}>"

    @property
    def ok(self) -> bool:
        """Whether no robot failed."""
        return all(robot.ok for robot in self.robots)

    def to_json(self) -> dict[str, Any]:
        """Return what ``dh2sim validate --json`` prints."""
        return {"ok": self.ok, "robots": [robot.to_json() for robot in self.robots]}


def _finite(value: object) -> object:
    """Return a value as JSON can hold it: NaN and infinity become text."""
    if isinstance(value, float) and not abs(value) < float("inf"):
        return str(value)
    return value


MOTION_ENGINE = "mujoco-rollout"
"""Engine of the checks of motions."""


def finding(
    quantity: Quantity,
    error: float,
    tolerance: float,
    *,
    samples: int,
    failure: str,
    reference: str = "physics",
    worst: Worst | None = None,
    left_out: LeftOut | None = None,
) -> Check:
    """Return a check of a motion; ``failure`` is the reason if the error exceeds the tolerance."""
    ok = bool(error <= tolerance)
    return Check(
        engine=MOTION_ENGINE,
        quantity=quantity,
        ok=ok,
        reference=reference,
        samples=samples,
        max_error=error,
        tolerance=tolerance,
        reason=None if ok else failure,
        worst=worst,
        left_out=left_out,
    )


def impossible(quantity: Quantity, reason: str, left_out: LeftOut | None = None) -> Check:
    """Return a check of a motion that could not be made."""
    return Check(
        engine=MOTION_ENGINE, quantity=quantity, ok=None, reason=f"{quantity.value}: {reason}", left_out=left_out
    )


_UNWRITABLE = re.compile("[^\t\n\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def to_junit(report: ValidationReport) -> str:
    """Return a JUnit document: a suite for every robot, a case for every check."""
    checks = [check for robot in report.robots for check in robot.checks]
    root = ET.Element("testsuites", {"name": "dh2sim validate", **_counts(checks)})
    for robot in report.robots:
        suite = ET.SubElement(root, "testsuite", {"name": robot.name, **_counts(robot.checks)})
        for check in robot.checks:
            case = ET.SubElement(
                suite,
                "testcase",
                classname=f"dh2sim.{robot.name}",
                name=f"{check.engine}: {check.quantity.value}",
                time=f"{check.seconds:.3f}",
            )
            if check.ok is None:
                ET.SubElement(case, "skipped", message=writable(check.reason or ""))
            elif not check.ok:
                ET.SubElement(case, "failure", message=writable(failure_text(check)))
            if check.left_out is not None:
                ET.SubElement(case, "system-out").text = writable(str(check.left_out))
    ET.indent(root)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def failure_text(check: Check) -> str:
    """Return in one line by how much a check failed, and where."""
    if check.reason is not None:
        return check.reason
    if check.max_position_error is not None and check.max_rotation_error is not None:
        text = f"{check.max_position_error:.3g} m, {check.max_rotation_error:.3g} rad"
    else:
        text = f"{check.max_error:.3g}" if check.max_error is not None else "no result"
    text += f" (tolerance {check.tolerance:g})" if check.tolerance is not None else ""
    if check.worst is not None:
        text += f"; worst at {check.worst.where}" if check.worst.where else ""
        if check.worst.q:
            text += f", q = [{', '.join(f'{value:.6g}' for value in check.worst.q)}]"
    return text


def _counts(checks: list[Check] | tuple[Check, ...]) -> dict[str, str]:
    return {
        "tests": str(len(checks)),
        "failures": str(sum(check.ok is False for check in checks)),
        "skipped": str(sum(check.ok is None for check in checks)),
    }


def writable(text: str) -> str:
    """Replace what XML cannot hold: control characters, and bytes of file names that are not text."""
    return _UNWRITABLE.sub("?", text)
