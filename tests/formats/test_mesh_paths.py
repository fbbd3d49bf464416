from __future__ import annotations

import os
from pathlib import Path

import pytest

from dh2sim.formats.mesh_paths import mesh_finder


@pytest.fixture(autouse=True)
def _no_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)


def mesh(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("solid")
    return path


def test_a_relative_path_starts_at_the_files_folder(tmp_path: Path) -> None:
    found = mesh(tmp_path / "urdf" / "meshes" / "a.stl")
    find = mesh_finder(tmp_path / "urdf")
    assert find("meshes/a.stl") == found
    assert find("./meshes/a.stl") == found
    assert find("meshes/b.stl") is None
    assert find("meshes") is None


def test_an_absolute_path_and_a_file_uri_are_taken_as_they_are(tmp_path: Path) -> None:
    found = mesh(tmp_path / "my meshes" / "a.stl")
    find = mesh_finder(tmp_path / "urdf")
    assert find(str(found)) == found
    assert find(f"file://{found}") == found
    assert find(f"file://{found}".replace(" ", "%20")) == found
    assert find(f"file://{tmp_path}/b.stl") is None


@pytest.mark.parametrize("scheme", ["package", "model"])
def test_a_package_is_found_in_a_given_folder_or_one_level_below_it_or_is_that_folder(
    tmp_path: Path, scheme: str
) -> None:
    found = mesh(tmp_path / "src" / "robots" / "arm" / "meshes" / "a.stl")
    elsewhere = tmp_path / "elsewhere"
    for given in (tmp_path / "src", tmp_path / "src" / "robots", tmp_path / "src" / "robots" / "arm"):
        assert mesh_finder(elsewhere, [tmp_path / "not there", given])(f"{scheme}://arm/meshes/a.stl") == found
    assert mesh_finder(elsewhere, [tmp_path])(f"{scheme}://arm/meshes/a.stl") is None
    assert mesh_finder(elsewhere, [tmp_path / "src"])(f"{scheme}://arm/meshes/b.stl") is None


def test_a_package_is_found_above_the_file(tmp_path: Path) -> None:
    own = mesh(tmp_path / "arm" / "meshes" / "a.stl")
    other = mesh(tmp_path / "tools" / "meshes" / "b.stl")
    find = mesh_finder(tmp_path / "arm" / "urdf" / "deep")
    assert find("package://arm/meshes/a.stl") == own
    assert find("package://tools/meshes/b.stl") == other


def test_packages_are_found_where_ros_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one = mesh(tmp_path / "ws" / "one" / "a.stl")
    two = mesh(tmp_path / "install" / "share" / "two" / "a.stl")
    monkeypatch.setenv("ROS_PACKAGE_PATH", os.pathsep.join([str(tmp_path / "none"), "", str(tmp_path / "ws")]))
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "install"))
    find = mesh_finder(tmp_path / "urdf")
    assert find("package://one/a.stl") == one
    assert find("package://two/a.stl") == two


def test_given_folders_win_over_those_of_ros_and_these_over_folders_above_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given, ros, above = (mesh(tmp_path / where / "arm" / "a.stl") for where in ("given", "ros", "home"))
    home = tmp_path / "home" / "urdf"
    assert mesh_finder(home)("package://arm/a.stl") == above
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "ros"))
    assert mesh_finder(home)("package://arm/a.stl") == ros
    assert mesh_finder(home, [tmp_path / "given"])("package://arm/a.stl") == given


def test_a_package_in_two_places_is_searched_in_both(tmp_path: Path) -> None:
    mesh(tmp_path / "given" / "arm" / "a.stl")
    found = mesh(tmp_path / "home" / "arm" / "b.stl")
    assert mesh_finder(tmp_path / "home", [tmp_path / "given"])("package://arm/b.stl") == found


def test_relative_folders_give_absolute_paths(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = mesh(tmp_path / "pkgs" / "arm" / "a.stl")
    monkeypatch.chdir(tmp_path)
    assert mesh_finder(Path(), [Path("pkgs")])("package://arm/a.stl") == found
    assert mesh_finder(Path("pkgs"))("arm/a.stl") == found


@pytest.mark.parametrize(
    "uri",
    [
        "",
        "/",
        ".",
        "package://",
        "package://arm",
        "package:///a.stl",
        "package://../a.stl",
        "package://./a.stl",
        "file://",
        "http://example.org/a.stl",
        "a\0.stl",
        "package://arm/\0.stl",
        "file:///%00",
        "x" * 5000,
        "package://" + "x" * 5000 + "/a.stl",
        "\ud800.stl",
        "package://\ud800/a.stl",
        "meshes/a.stl/b.stl",
    ],
)
def test_a_name_that_no_mesh_can_have_is_not_found_and_raises_nothing(tmp_path: Path, uri: str) -> None:
    mesh(tmp_path / "a.stl")
    mesh(tmp_path / "meshes" / "a.stl")
    assert mesh_finder(tmp_path, [tmp_path])(uri) is None


def test_a_package_may_be_in_a_folder_of_another_name(tmp_path: Path) -> None:
    folder = tmp_path / "a_clone" / "urdf"
    (tmp_path / "a_clone" / "meshes").mkdir(parents=True)
    folder.mkdir()
    (tmp_path / "a_clone" / "package.xml").write_text("<package><name> my_arm </name></package>", encoding="utf-8")
    (tmp_path / "a_clone" / "meshes" / "a.stl").write_bytes(b"")
    assert mesh_finder(folder)("package://my_arm/meshes/a.stl") == tmp_path / "a_clone" / "meshes" / "a.stl"
    assert mesh_finder(folder)("package://other/meshes/a.stl") is None
    assert mesh_finder(tmp_path, [tmp_path / "a_clone"])("package://my_arm/meshes/a.stl") is not None
