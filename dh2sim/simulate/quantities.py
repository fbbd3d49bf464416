"""Quantities that may be random, and the distributions that they are drawn from."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from types import MappingProxyType
from typing import Final, Literal, TypeAlias

from dh2sim.messages import did_you_mean, listed

Kind: TypeAlias = Literal["factor", "offset", "size", "constant"]
Owner: TypeAlias = Literal["link", "joint", "actuator", "row", ""]

NORMAL_ENDS: Final = 4.0
"""Normal draws stay within so many standard deviations."""
MOST: Final = 1e6
"""Greatest number in a distribution, SI units."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """Something of a rollout that may be random."""

    kind: Kind
    """What a number X means: a factor in 1 - X to 1 + X, an offset in -X to X, a size in 0 to X, or X itself."""
    variable: str
    """Of the dataset, that holds what was drawn."""
    words: str
    """What that is."""
    unit: str = "1"
    owner: Owner = ""
    """What has a value of its own each, by name; '' where a rollout has one."""
    axis: str = ""
    """Dimension of its components, one of ``AXES``; '' where it is one number."""


AXES: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {"axis": ("x", "y", "z"), "length": ("a", "d"), "angle": ("alpha", "theta", "beta")}
)
"""Labels of components."""
_COORDINATE: Final = "rad or m, see joint_unit"
QUANTITIES: Final[Mapping[str, Quantity]] = MappingProxyType(
    {
        "mass": Quantity("factor", "mass_scale", "factor of the mass", owner="link"),
        "friction": Quantity("factor", "friction_scale", "factor of the friction", owner="joint"),
        "damping": Quantity("factor", "damping_scale", "factor of the damping", owner="joint"),
        "armature": Quantity("factor", "armature_scale", "factor of the armature", owner="joint"),
        "gain": Quantity("factor", "gain_scale", "factor of the gain", owner="actuator"),
        # each has a stream of random numbers by its place here: new ones come last
        "kp": Quantity("factor", "kp_scale", "factor of the actuator's stiffness", owner="actuator"),
        "kv": Quantity("factor", "kv_scale", "factor of the actuator's damping", owner="actuator"),
        "effort": Quantity("factor", "effort_scale", "factor of the limit of effort", owner="actuator"),
        "com": Quantity(
            "offset",
            "com_offset",
            "offset of the centre of mass, along the axes of the joint's frame",
            "m",
            owner="link",
            axis="axis",
        ),
        "payload": Quantity("size", "payload", "point mass at the tool", "kg"),
        "payload_com": Quantity("offset", "payload_com", "place of the payload in tool0", "m", axis="axis"),
        "gravity": Quantity("size", "gravity", "tilted gravity in the world", "m/s2", axis="axis"),
        "zero": Quantity(
            "offset", "zero_offset", "joint's own coordinate where it reads zero", _COORDINATE, owner="joint"
        ),
        "row_length": Quantity(
            "offset", "row_length_error", "error of a length of the table", "m", owner="row", axis="length"
        ),
        "row_angle": Quantity(
            "offset", "row_angle_error", "error of an angle of the table", "rad", owner="row", axis="angle"
        ),
        "encoder_bias": Quantity(
            "offset", "encoder_bias", "constant error of the encoder", _COORDINATE, owner="joint"
        ),
        "encoder_noise": Quantity(
            "size", "encoder_noise", "standard deviation of the encoder's noise", _COORDINATE, owner="joint"
        ),
        "sensor_delay": Quantity("size", "sensor_delay", "delay of what the controller sees", "s"),
        "control_delay": Quantity("size", "control_delay", "delay of controls", "s"),
        "push": Quantity("size", "push_force", "force of a push at tool0, in the world", "N", axis="axis"),
        "push_interval": Quantity("constant", "push_interval", "time from push to push", "s"),
        "push_duration": Quantity("constant", "push_duration", "duration of a push", "s"),
    }
)
NEEDS: Final[Mapping[str, str]] = MappingProxyType(
    {"payload_com": "payload", "push_interval": "push", "push_duration": "push"}
)
"""What has no meaning without another quantity."""
USUAL: Final[Mapping[str, float]] = MappingProxyType({"push_interval": 0.5, "push_duration": 0.1})
"""s; what pushes have by default."""
_KEY: Final = re.compile(r"([a-z_]+)\[([^\[\]]+)\]")
_SHAPES: Final = "X, uniform:LOW:HIGH, loguniform:LOW:HIGH, normal:SIGMA, normal:MEAN:SIGMA or fixed:X"


@dataclass(frozen=True, slots=True, kw_only=True)
class Distribution:
    """A distribution of one number."""

    shape: Literal["uniform", "loguniform", "normal", "fixed"]
    first: float
    """Least value; of a normal distribution the mean; of a fixed one the value."""
    second: float = 0.0
    """Greatest value; of a normal distribution the standard deviation."""

    @property
    def least(self) -> float:
        """Least value that is drawn."""
        return self.first - NORMAL_ENDS * self.second if self.shape == "normal" else self.first

    def at(self, u: float) -> float:
        """Return the value below which a share ``u`` of all draws is, from 0 to 1."""
        match self.shape:
            case "uniform":
                return self.first + u * (self.second - self.first)
            case "loguniform":
                return self.first * math.exp(u * math.log(self.second / self.first))
            case "normal":
                tail = _STANDARD.cdf(-NORMAL_ENDS)
                return self.first + self.second * _STANDARD.inv_cdf(tail + u * (1.0 - 2.0 * tail))
            case _:
                return self.first


_STANDARD: Final = NormalDist()
Setting: TypeAlias = float | str
"""A number, or a distribution as text."""


def key_parts(key: str) -> tuple[str, str]:
    """Return the quantity of a key, and the name in its brackets or ''; ``friction[joint_3]``."""
    found = _KEY.fullmatch(key)
    return (found[1], found[2]) if found else (key, "")


def distribution_of(quantity: Quantity, setting: Setting) -> Distribution:
    """Return the distribution that a setting of a quantity means.

    Raises:
        ValueError: It means none; the text follows the setting's name.
    """
    neutral = 1.0 if quantity.kind == "factor" else 0.0
    if not isinstance(setting, str):
        return _checked(quantity, _of_number(quantity, float(setting)), f"{setting:g}")
    shape, *words = (part.strip() for part in setting.split(":"))
    shape = shape.lower().replace("-", "").replace("_", "")
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        raise ValueError(f"must be {_SHAPES}, got {setting!r}") from None
    if not words and _is_number(shape):
        return distribution_of(quantity, float(shape))
    match shape, numbers:
        case "uniform" | "loguniform", [low, high]:
            found = Distribution(shape="uniform" if shape == "uniform" else "loguniform", first=low, second=high)
        case "normal", [sigma]:
            found = Distribution(shape="normal", first=neutral, second=sigma)
        case "normal", [mean, sigma]:
            found = Distribution(shape="normal", first=mean, second=sigma)
        case "fixed", [value]:
            found = Distribution(shape="fixed", first=value)
        case _:
            raise ValueError(f"must be {_SHAPES}, got {setting!r}")
    return _checked(quantity, found, setting)


def _of_number(quantity: Quantity, x: float) -> Distribution:
    match quantity.kind:
        case "factor":
            if not 0.0 <= x < 1.0:
                raise ValueError(f"must have shares of at least 0 and below 1, got {x:g}")
            return Distribution(shape="uniform", first=1.0 - x, second=1.0 + x)
        case "offset":
            return Distribution(shape="uniform", first=-x, second=x)
        case "size":
            return Distribution(shape="uniform", first=0.0, second=x)
        case _:
            return Distribution(shape="fixed", first=x)


def _checked(quantity: Quantity, found: Distribution, given: str) -> Distribution:
    if not all(math.isfinite(value) and abs(value) <= MOST for value in (found.first, found.second)):
        raise ValueError(f"must have finite numbers of at most {MOST:g}, got {given}")
    if found.shape == "normal" and found.second < 0.0:
        raise ValueError(f"must have a standard deviation of at least 0, got {given}")
    if found.shape in ("uniform", "loguniform") and found.first > found.second:
        raise ValueError(f"must have the lower end first and at least 0 as X, got {given}")
    if found.shape == "loguniform" and found.first <= 0.0:
        raise ValueError(f"must have ends above 0, got {given}")
    if quantity.kind == "constant" and found.shape != "fixed":
        raise ValueError(f"must be a number, got {given}")
    positive = quantity.kind in ("factor", "constant")
    if positive and not found.least > 0.0:
        raise ValueError(f"must be above 0 in all draws, got {given}{_reaches(found)}")
    if quantity.kind == "size" and found.least < 0.0:
        raise ValueError(f"must be at least 0 in all draws, got {given}{_reaches(found)}")
    return found


def _reaches(found: Distribution) -> str:
    return f", which reaches {found.least:g}" if found.shape == "normal" else ""


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def checked_settings(given: Mapping[str, Setting]) -> tuple[dict[str, Setting], list[str]]:
    """Return settings in the order of quantities, numbers as numbers, and what is wrong with them."""
    problems: list[str] = []
    found: dict[str, Setting] = {}
    for key, setting in given.items():
        name, label = key_parts(key)
        quantity = QUANTITIES.get(name)
        if quantity is None:
            guess = did_you_mean(name, QUANTITIES)
            problems.append(f"must not contain {key!r}.{guess} Allowed: {listed(QUANTITIES)}")
            continue
        if label and not quantity.owner:
            problems.append(f"must not contain {key!r}: a rollout has one {name}")
            continue
        try:
            distribution_of(quantity, setting)
        except ValueError as error:
            problems.append(f"{error}".replace("got ", f"got {key}=", 1))
            continue
        found[key] = setting if isinstance(setting, str) and not _is_number(setting) else float(setting)
    names = {key_parts(key)[0] for key in given}
    problems += [
        f"must not contain '{name}' without '{other}'"
        for name, other in NEEDS.items()
        if name in names - {other} and other not in names
    ]
    order = list(QUANTITIES)
    ordered = sorted(found, key=lambda key: (order.index(key_parts(key)[0]), bool(key_parts(key)[1])))
    return {key: found[key] for key in ordered}, problems


def randomized(settings: Mapping[str, Setting]) -> list[str]:
    """Return the quantities that settings name, in the order of ``QUANTITIES``."""
    given = {key_parts(key)[0] for key in settings}
    return [name for name in QUANTITIES if name in given]


def settings_of(settings: Mapping[str, Setting], name: str, labels: Sequence[str]) -> list[Setting | None]:
    """Return the setting of a quantity for each of its owners; None where it has none."""
    own = {key_parts(key)[1]: setting for key, setting in settings.items() if key_parts(key)[0] == name}
    return [own.get(label, own.get("")) for label in labels]


def unknown_labels(settings: Mapping[str, Setting], labels: Mapping[str, Sequence[str]]) -> Iterable[str]:
    """Yield what is wrong with names in brackets; ``labels`` has those of each kind of owner."""
    for key in settings:
        name, label = key_parts(key)
        known = labels.get(QUANTITIES[name].owner, ())
        if label and label not in known:
            yield f"must not contain {key!r}.{did_you_mean(label, known)} Allowed in brackets: {listed(known)}"
