"""States of pages that tests begin with, and what becomes of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dh2sim.robot.read import load_robot
from dh2sim.typing import read_only
from dh2sim.view.events import Event
from dh2sim.view.initial_state import open_state
from dh2sim.view.reduce import reduce
from dh2sim.view.state import ViewState
from dh2sim.workspace.region import Curve
from dh2sim.workspace.section import SINGULAR, Section
from dh2sim.workspace.workspace import compute_workspace

STANFORD = open_state(load_robot("stanford"))
_SQUARE = Curve(points=read_only([[0.1, 0.0], [0.9, 0.0], [0.9, 0.8], [0.1, 0.8]]), q=np.zeros((4, 2)))
_SECTION = Section(
    labels=("r", "z"),
    turns_about="joint_1",
    axis_point=read_only(np.zeros(3)),
    directions=read_only([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    curves=(_SQUARE,),
    held_by=(np.array([1, 2, SINGULAR, 2]),),
    line=np.empty((0, 2)),
    nodes=np.empty((0, 2)),
    size=0.05,
    singular=read_only([[0.5, 0.4]]),
    singular_q=np.zeros((1, 6)),
    area=0.64,
    full_turn_volume=None,
    volume=None,
)
WORKSPACE = replace(compute_workspace(STANFORD.model, samples=500, size=0.5, threads=1), section=_SECTION)
"""Of the Stanford arm, with a section that is a square."""


def after(state: ViewState, *events: Event) -> ViewState:
    """Return the state after events."""
    for event in events:
        state = reduce(state, event)
    return state
