"""What the dataset of a run is made of."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from dh2sim.simulate.dataset_layout import STATUS, Layout
from dh2sim.simulate.options import RECORDABLE, RolloutOptions
from dh2sim.simulate.prepare import prepare
from tests.sample_robots import model
from tests.simulate import robots

EVERYTHING = {"record": RECORDABLE, "controller": "pd", "integrator": "Euler"}


def layout(**how: Any) -> Layout:
    return prepare(
        model("odd"), RolloutOptions(**{"rollouts": 7, "steps": 12, "every": 3, "timestep": 0.01, **how})
    ).layout


def dimensions(of: Layout) -> dict[str, tuple[str, ...]]:
    return {variable.name: variable.dimensions for variable in of.variables}


def test_every_variable_has_its_dimensions() -> None:
    assert dimensions(layout(**EVERYTHING, floating_base=True, randomize={"mass": 0.1})) == {
        "qpos": ("rollout", "step", "joint"),
        "base_pose": ("rollout", "step", "pose"),
        "qvel": ("rollout", "step", "joint"),
        "base_twist": ("rollout", "step", "twist"),
        "ctrl": ("rollout", "interval", "actuator"),
        "tool_pose": ("rollout", "step", "pose"),
        "qpos_ref": ("rollout", "step", "joint"),
        "qvel_ref": ("rollout", "step", "joint"),
        "qacc": ("rollout", "interval", "joint"),
        "torque": ("rollout", "interval", "joint"),
        "energy": ("rollout", "step", "energy_kind"),
        "contacts": ("rollout", "interval"),
        "status": ("rollout",),
        "stop_step": ("rollout",),
        "saturation": ("rollout", "actuator"),
        "contact_step": ("rollout",),
        "contact_link_a": ("rollout",),
        "contact_link_b": ("rollout",),
        "mass_scale": ("rollout", "link"),
    }


def test_sizes_are_those_of_the_run() -> None:
    made = layout(**EVERYTHING)
    assert dict(made.sizes) == {
        "rollout": 7,
        "step": 5,
        "interval": 4,
        "joint": 5,
        "actuator": 5,
        "pose": 7,
        "energy_kind": 2,
    }
    assert set(layout(record=("qpos",)).sizes) == {"rollout", "step", "interval", "joint", "actuator"}


@pytest.mark.parametrize(
    ("how", "missing"),
    [
        ({"controller": "hold"}, {"qpos_ref", "qvel_ref"}),
        ({"record": ("reference",)}, {"qpos", "qvel", "ctrl", "tool_pose", "qacc", "torque", "energy", "contacts"}),
        ({"record": ("qpos",), "floating_base": True}, {"base_twist", "tool_pose"}),
    ],
)
def test_what_is_not_recorded_is_not_there(how: dict[str, Any], missing: set[str]) -> None:
    assert not missing & dimensions(layout(**{**EVERYTHING, **how})).keys()


def test_every_variable_says_its_unit_and_what_it_is() -> None:
    for variable in layout(**EVERYTHING, floating_base=True, randomize={"mass": 0.1}).variables:
        assert variable.attributes["units"]
        assert variable.attributes["long_name"]
        if variable.dtype.kind == "f":
            assert math.isnan(variable.fill)
        else:
            assert variable.fill == (0 if variable.name == "saturation" else -1)


def test_the_status_explains_its_values() -> None:
    status = next(variable for variable in layout().variables if variable.name == "status")
    assert (
        dict(zip(status.attributes["flag_meanings"].split(), status.attributes["flag_values"], strict=True)) == STATUS
    )


def test_the_links_of_a_contact_explain_their_values() -> None:
    for name in ("contact_link_a", "contact_link_b"):
        flags = next(variable for variable in layout().variables if variable.name == name).attributes
        names = dict(zip(flags["flag_values"], flags["flag_meanings"].split(), strict=True))
        assert names.pop(-1) == "none"
        assert set(names.values()) <= {"base_link", *(f"link_{i}" for i in range(1, 7))}
        assert "link_2" in names.values()


def test_coordinates_say_what_belongs_to_what() -> None:
    items = {item.name: item for item in layout(**EVERYTHING, floating_base=True).coordinates}
    values = {name: list(item.values) for name, item in items.items()}
    assert values["rollout"] == list(range(7))
    assert values["time"] == [0.0, 0.03, 0.06, 0.09, 0.12]
    assert values["interval_time"] == values["time"][:-1]
    assert values["joint"] == ["one", "two", "four", "five", "six"]
    assert values["joint_unit"] == ["rad", "m", "rad", "m", "rad"]
    assert values["actuator"] == [f"{name}_motor" for name in values["joint"]]
    assert values["actuator_unit"] == ["N*m", "N", "N*m", "N", "N*m"]
    assert values["pose"] == ["x", "y", "z", "qw", "qx", "qy", "qz"]
    assert values["twist"] == ["vx", "vy", "vz", "wx", "wy", "wz"]
    assert values["energy_kind"] == ["potential", "kinetic"]
    assert values["joint_lower"][:3] == [-2.0, -0.1, -math.inf]
    assert values["joint_upper"][:3] == [1.5, 0.4, math.inf]
    assert values["joint_velocity_limit"][0] == 3.1
    assert {name: item.dimension for name, item in items.items() if item.dimension != name} == {
        "time": "step",
        "interval_time": "interval",
        "joint_unit": "joint",
        "joint_lower": "joint",
        "joint_upper": "joint",
        "joint_velocity_limit": "joint",
        "actuator_unit": "actuator",
    }


def test_time_k_is_k_times_the_timestep_and_the_records_apart() -> None:
    made = layout(steps=3000, every=3, timestep=0.001)
    time = next(item.values for item in made.coordinates if item.name == "time")
    assert np.array_equal(time, np.arange(1001) * 0.003)


def test_blocks_bound_what_is_in_memory_and_how_long_one_takes() -> None:
    made = layout(rollouts=100_000, steps=1000, every=1)
    bytes_each = sum(math.prod(made.shape(variable)[1:]) * variable.dtype.itemsize for variable in made.variables)
    assert made.block * bytes_each <= 2**26
    assert made.block * 1000 <= 2**21
    assert made.block > 100
    assert layout(rollouts=3).block == 3
    assert layout(rollouts=3, steps=10**9, every=10**8).block == 1


def test_rollouts_of_blocks_are_all_rollouts_in_order() -> None:
    made = layout(rollouts=100_000, steps=1000, every=1)
    parts = [made.rollouts(block) for block in range(made.blocks)]
    assert parts[0].start == 0
    assert parts[-1].stop == 100_000
    assert all(one.stop == other.start for one, other in itertools.pairwise(parts))
    assert {len(part) for part in parts[:-1]} == {made.block}


def test_a_worm_has_links_of_its_own() -> None:
    made = prepare(robots.worm(), RolloutOptions(rollouts=1, steps=1, randomize={"mass": 0.1})).layout
    assert made.sizes["link"] == 5
