from __future__ import annotations

import math

import numpy as np
import pytest

from dh2sim.draw.camera import MARGIN, CameraChoice, fit, follows_base, make_camera, parse_camera
from dh2sim.draw.motion import Motion
from dh2sim.errors import PictureError
from dh2sim.formats.mjcf.scene import FIELD_OF_VIEW
from tests.draw.drawing import moving


def seen(points: np.ndarray, azimuth: float, elevation: float, lookat: np.ndarray, distance: float) -> np.ndarray:
    """Tangents of the angles at which points are seen, to the right and up; from the definition of a free camera."""
    a, e = math.radians(azimuth), math.radians(elevation)
    forward = np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
    right = np.array([math.sin(a), -math.cos(a), 0.0])
    up = np.array([-math.sin(e) * math.cos(a), -math.sin(e) * math.sin(a), math.cos(e)])
    rays = points - (lookat - distance * forward)
    assert (rays @ forward > 0).all(), "everything is before the camera"
    return np.asarray(np.stack([rays @ right, rays @ up], axis=1) / (rays @ forward)[:, None])


@pytest.mark.parametrize("azimuth", [-170.0, 37.3, 130.0])
@pytest.mark.parametrize("elevation", [-89.0, -20.0, 0.0, 35.0])
@pytest.mark.parametrize("aspect", [0.5, 16 / 9])
def test_all_points_are_in_the_picture_and_two_edges_are_touched(
    azimuth: float, elevation: float, aspect: float
) -> None:
    points = np.random.default_rng(5).normal(size=(50, 3)) * [1.0, 0.3, 2.0] + [3.0, -2.0, 1.0]
    lookat, distance = fit(points, azimuth, elevation, aspect)
    tangents = seen(points, azimuth, elevation, lookat, distance)
    most = math.tan(math.radians(FIELD_OF_VIEW / 2)) * (1 - 2 * MARGIN) * np.array([aspect, 1.0])
    fill = np.abs(tangents).max(axis=0) / most
    assert fill.max() == pytest.approx(1.0, abs=1e-9), "as near as possible"
    tight = int(fill.argmax())
    assert tangents[:, tight].max() == pytest.approx(-tangents[:, tight].min(), abs=1e-9), "and in the middle"


def test_a_view_is_a_name_or_a_direction() -> None:
    assert parse_camera(None) == CameraChoice()
    assert parse_camera("overview") == CameraChoice(name="overview")
    assert parse_camera("-60,-15") == CameraChoice(azimuth=-60.0, elevation=-15.0)
    assert parse_camera("120, 10 ,2.5") == CameraChoice(azimuth=120.0, elevation=10.0, distance=2.5)


ALLOWED = "allowed: a camera's name, or azimuth,elevation[,distance] in degrees and m, such as 120,-20"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a,b", f"camera 'a,b': not all of these are numbers; {ALLOWED}"),
        ("1,2,3,4", f"camera '1,2,3,4': two or three finite numbers are needed; {ALLOWED}"),
        ("nan,2", f"camera 'nan,2': two or three finite numbers are needed; {ALLOWED}"),
        ("1,91", "camera '1,91': the elevation must be from -90 to 90 degrees"),
        ("1,9,0", "camera '1,9,0': the distance must be above 0, and at most a million metres"),
    ],
)
def test_a_direction_out_of_range_is_refused(text: str, message: str) -> None:
    with pytest.raises(PictureError) as caught:
        parse_camera(text)
    assert str(caught.value) == message


def test_an_unknown_camera_is_refused_with_the_names_of_those_there_are() -> None:
    with pytest.raises(PictureError) as caught:
        make_camera(CameraChoice(name="overveiw"), moving().model, np.zeros((1, 3)), 1.0)
    assert str(caught.value) == (
        "unknown camera 'overveiw'. Did you mean 'overview'? Cameras: overview; or azimuth,elevation[,distance] "
        "in degrees and m, such as 120,-20"
    )


def test_a_distance_is_taken_as_it_is() -> None:
    camera = make_camera(CameraChoice(azimuth=10.0, elevation=-5.0, distance=7.5), moving().model, np.eye(3), 1.0)
    assert (camera.azimuth, camera.elevation, camera.distance) == (10.0, -5.0, 7.5)


def test_the_camera_stays_where_the_base_stays() -> None:
    motion: Motion = moving()
    assert not motion.floats
    assert not follows_base(CameraChoice(), motion)
    assert (motion.travel == 0.0).all()
