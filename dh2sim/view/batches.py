"""Frames that stand side by side as one item: sent in one message, and drawn in one go."""

from __future__ import annotations

from collections import defaultdict

from dh2sim.view.items import Item, Scene, Triad, Triads


def batched(scene: Scene) -> Scene:
    """Return a scene that looks the same, with all triads of a parent and a length as one item.

    Triads that carry something stay as they are.

    Args:
        scene: Items by name.

    Returns:
        Items by name; triads that were below ``/frames`` are ``/frames/axes_0``, with other lengths ``axes_1`` ...
    """
    carriers = {_parent(name) for name in scene}
    rest: dict[str, Item] = {}
    groups: dict[str, dict[float, list[Triad]]] = defaultdict(lambda: defaultdict(list))
    for name, item in scene.items():
        if isinstance(item, Triad) and name not in carriers:
            groups[_parent(name)][item.length].append(item)
        else:
            rest[name] = item
    for parent, lengths in groups.items():
        for number, (length, triads) in enumerate(lengths.items()):
            rest[f"{parent}/axes_{number}"] = Triads(
                positions=tuple(triad.position for triad in triads),
                orientations=tuple(triad.orientation for triad in triads),
                length=length,
            )
    return rest


def _parent(name: str) -> str:
    return name.rpartition("/")[0]
