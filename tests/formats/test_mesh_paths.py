from __future__ import annotations

import os
from pathlib import Path

import pytest

from dh2sim.formats.mesh_paths import FindMesh, MeshOutsideError, mesh_finder


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


def outside(find: FindMesh, uri: str) -> bool:
    """Whether a mesh is there and may not be used."""
    try:
        assert find(uri) is None
    except MeshOutsideError:
        return True
    return False


def test_no_name_leads_out_of_the_files_own_folders(tmp_path: Path) -> None:
    secret = mesh(tmp_path / "home" / "secret.stl")
    package = tmp_path / "home" / "downloads" / "arm"
    own = mesh(package / "meshes" / "a.stl")
    (package / "package.xml").write_text("<package><name>arm</name></package>")
    (package / "urdf" / "deep").mkdir(parents=True)
    for folder in (package / "urdf", package / "urdf" / "deep"):
        find = mesh_finder(folder)
        up = os.path.relpath(secret, folder)
        for uri in (
            f"package://arm/../../{secret.name}",
            f"package://arm/meshes/../../../{secret.name}",
            f"package://arm/%2e%2e/%2e%2e/{secret.name}",
            f"model://arm/../../{secret.name}",
            f"file://{secret}",
            f"file://{up}",
            str(secret),
            up,
        ):
            assert outside(find, uri), uri
            assert mesh_finder(folder, [], tmp_path / "home")(uri) is not None
        assert find(os.path.relpath(own, folder)) is not None
        assert find(f"file://{own}") == own
        assert find("package://arm/urdf/../meshes/a.stl") is not None


@pytest.mark.skipif(os.name == "nt", reason="links need rights there")
def test_no_link_leads_out_of_the_files_own_folders(tmp_path: Path) -> None:
    secret = mesh(tmp_path / "home" / "secret.stl")
    package = tmp_path / "downloads" / "arm"
    (package / "meshes").mkdir(parents=True)
    (package / "urdf").mkdir()
    (package / "package.xml").write_text("<package><name>arm</name></package>")
    (package / "meshes" / "link.stl").symlink_to(secret)
    (package / "folder").symlink_to(secret.parent)
    own = mesh(package / "meshes" / "own.stl")
    (package / "meshes" / "inner.stl").symlink_to(own)
    find = mesh_finder(package / "urdf")
    for uri in ("package://arm/meshes/link.stl", "../meshes/link.stl", "package://arm/folder/secret.stl"):
        assert outside(find, uri)
        assert mesh_finder(package / "urdf", [secret.parent])(uri) is not None
    assert find("package://arm/meshes/inner.stl") == package / "meshes" / "inner.stl"


def test_a_link_to_the_package_itself_is_followed(tmp_path: Path) -> None:
    found = mesh(tmp_path / "source" / "arm" / "a.stl")
    (tmp_path / "share").mkdir()
    (tmp_path / "share" / "arm").symlink_to(tmp_path / "source" / "arm")
    find = mesh_finder(tmp_path / "urdf", [tmp_path / "share"])
    assert find("package://arm/a.stl") == tmp_path / "share" / "arm" / "a.stl"
    assert found.exists()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
def test_a_pipe_in_the_place_of_a_packages_description_is_not_waited_for(tmp_path: Path) -> None:
    found = mesh(tmp_path / "arm" / "meshes" / "a.stl")
    os.mkfifo(tmp_path / "arm" / "package.xml")
    find = mesh_finder(tmp_path / "arm" / "urdf")
    assert find("package://arm/meshes/a.stl") == found
    assert find("package://other/meshes/a.stl") is None
