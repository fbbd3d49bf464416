"""Frames side by side as one item."""

from __future__ import annotations

from dh2sim.view.scene.items import Label, Placed, Triad, Triads, batched

UP = (0.0, 0.0, 1.0)
TURNED = (0.0, 1.0, 0.0, 0.0)


def test_triads_of_one_parent_and_length_become_one_item_in_their_order() -> None:
    scene = {
        "/frames": Placed(position=UP),
        "/frames/a": Triad(length=0.2),
        "/other/c": Triad(length=0.2),
        "/frames/b": Triad(length=0.2, position=UP, orientation=TURNED),
    }
    still = (1.0, 0.0, 0.0, 0.0)
    assert batched(scene) == {
        "/frames": Placed(position=UP),
        "/frames/axes_0": Triads(length=0.2, positions=((0.0, 0.0, 0.0), UP), orientations=(still, TURNED)),
        "/other/axes_0": Triads(length=0.2, positions=((0.0, 0.0, 0.0),), orientations=(still,)),
    }


def test_triads_of_other_lengths_are_other_items() -> None:
    found = batched({"/f/a": Triad(length=0.1), "/f/b": Triad(length=0.3), "/f/c": Triad(length=0.1)})
    assert {name: (item.length, len(item.positions)) for name, item in found.items() if isinstance(item, Triads)} == {
        "/f/axes_0": (0.1, 2),
        "/f/axes_1": (0.3, 1),
    }


def test_a_triad_that_carries_something_stays_as_it_is() -> None:
    scene = {"/a": Triad(length=0.1), "/a/name": Label(text="a")}
    assert batched(scene) == scene
