"""Obstacles from files: what they become, and one clear sentence for what cannot stand in a room."""

import numpy as np
import pytest
import trimesh

from armdesign.cell.obstacle_file import read_obstacles
from armdesign.cell.obstacles import Box, Cylinder, Mesh, Plane, Sphere
from armdesign.errors import ObstacleError

CELL = """
[[box]]
name = "table"
center = [0.5, 0.2, 0.4]
size = [1.2, 0.6, 0.05]
rpy = [0, 0, 90]
[[sphere]]
name = "ball"
center = [0, 0, 1]
radius = 0.1
[[cylinder]]
name = "post"
radius = 0.02
length = 1.5
[[plane]]
name = "wall"
point = [0, -1, 0]
normal = [0, 2, 0]
[[mesh]]
name = "part"
file = "part.stl"
units = "mm"
center = [0.2, 0, 0]
"""
URDF = """<robot name="scene"><link name="root"/><link name="shelf"><collision><origin xyz="0 0 0.5"/>
<geometry><box size="0.4 0.3 0.02"/></geometry></collision></link>
<joint name="fix" type="fixed"><parent link="root"/><child link="shelf"/>
<origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/>
</joint></robot>"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "cell.toml").write_text(CELL)
    trimesh.creation.box((100.0, 200.0, 300.0)).export(tmp_path / "part.stl")
    (tmp_path / "scene.urdf").write_text(URDF)
    return tmp_path


def write(folder, text):
    (folder / "bad.toml").write_text(text)
    return folder / "bad.toml"


def test_a_cell_file_gives_shapes_in_the_room(folder):
    found = {one.name: one for one in read_obstacles([folder / "cell.toml"]).each}
    kinds = [type(one.shape) for one in found.values()]
    assert kinds == [Box, Sphere, Cylinder, Plane, Mesh]
    np.testing.assert_allclose(found["table"].pose[:3, 3], [0.5, 0.2, 0.4])
    np.testing.assert_allclose(found["table"].pose[:3, 0], [0.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(np.ptp(found["part"].shape.vertices, axis=0), [0.1, 0.2, 0.3], atol=1e-9)
    # a metre before the wall, a metre behind it
    assert found["wall"].distances(np.array([[3.0, 0.0, 1.0], [0.0, -2.0, 5.0]])) == pytest.approx([1.0, -1.0])


def test_points_have_exact_distances(folder):
    found = {one.name: one for one in read_obstacles([folder / "cell.toml"]).each}
    points = np.array([[0.5, 0.2, 0.6], [0.5, 0.2, 0.4]])
    assert found["table"].distances(points) == pytest.approx([0.175, -0.025])
    assert found["ball"].distances(np.array([[0.0, 0.0, 1.5]])) == pytest.approx([0.4])
    assert found["part"].distances(np.array([[0.2, 0.0, 0.25], [0.2, 0.0, 0.0]])) == pytest.approx([0.1, -0.05])


def test_meshes_and_scenes_by_their_path(folder):
    found = {one.name: one for one in read_obstacles([folder / "part.stl", folder / "scene.urdf"], "mm").each}
    assert set(found) == {"part", "shelf"}
    np.testing.assert_allclose(found["shelf"].pose[:3, 3], [1.0, 0.0, 0.5], atol=1e-12)
    np.testing.assert_allclose(found["shelf"].pose[:3, 0], [0.0, 1.0, 0.0], atol=1e-12)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[[bxo]]\nsize = [1, 1, 1]", ("unknown shape 'bxo'", "allowed: box")),
        ("[[box]]\nsize = [1, 1, 1]\ncentre = [0, 0, 0]", ("unknown key 'centre'", "center")),
        ("[[box]]\nname = 'a'", ("box 'a'", "size is missing")),
        ("[[box]]\nsize = [1, 1]", ("size is [1, 1]",)),
        ("[[box]]\nsize = [1, 1, -1]", ("above 0",)),
        ("[[box]]\nsize = [1, 1, 'x']", ("'x'",)),
        ("[[box]]\nsize = [2000, 1, 1]", ("2000 m", "500 mm is 0.5")),
        ("[[sphere]]\nradius = 0.0001", ("0.1 mm",)),
        ("[[sphere]]\nradius = 0", ("above 0",)),
        ("[[sphere]]\nradius = 1\ncenter = [900, 0, 0]", ("900 m", "origin")),
        ("[[cylinder]]\nradius = true\nlength = 1", ("radius is True",)),
        ("[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 0]", ("normal",)),
        ("[[mesh]]\nfile = 'part.stl'\nunits = 'furlong'", ("furlong", "mm")),
        ("[[mesh]]\nfile = 'part.stl'\nunits = ['mm']", ("['mm']", "allowed: m, cm, mm, in")),
        ("[[mesh]]\nfile = 'bad.toml'", ("mesh 'mesh_1'", ".stl")),
        ("[[sphere]]\nradius = 1" + 400 * "0", ("radius",)),  # more than a float holds
        ('[[box]]\nname = "a\\nb"\nsize = [1, 1, 1]', ("printable",)),
        ("[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\ncarried_by = 'tray'", ("unknown key 'carried_by'",)),
        ("[[mesh]]\nfile = 'no.stl'", ("no.stl",)),
        ("[[mesh]]\nfile = 'part.stl'", ("mesh 'mesh_1'", "measures 300 m", 'units = "mm"')),
            (2 * "[[box]]\nname = 'a'\nsize = [1, 1, 1]\n", ("two obstacles are called 'a'",)),
        ("[box]\nsize = [1, 1, 1]", ("[[box]]",)),
        ("box = 3", ("[[box]]",)),
        ("", ("no obstacle",)),
        ("[[box", ("TOML",)),
    ],
)  # fmt: skip
def test_what_is_no_cell_file_is_named(folder, text, said):
    with pytest.raises(ObstacleError) as error:
        read_obstacles([write(folder, text)])
    assert "bad.toml" in str(error.value) or "part.stl" in str(error.value) or "no.stl" in str(error.value)
    assert all(part in str(error.value) for part in said)
    assert "\n" not in str(error.value)


def test_an_open_mesh_is_refused_with_its_open_edges(folder):
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    box.update_faces(np.arange(len(box.faces)) > 0)
    box.export(folder / "open.ply")
    with pytest.raises(ObstacleError, match=r"open.ply is not closed: 3 edges of"):
        read_obstacles([folder / "open.ply"])


@pytest.mark.parametrize("name", ["garbage.stl", "garbage.obj", "garbage.ply", "garbage.urdf"])
def test_garbage_is_refused(folder, name):
    (folder / name).write_bytes(bytes(range(256)) * 4)
    with pytest.raises(ObstacleError, match=r"garbage\."):
        read_obstacles([folder / name])


def test_files_that_are_none(folder):
    with pytest.raises(ObstacleError, match="there is no file"):
        read_obstacles([folder / "missing.toml"])
    (folder / "table.step").write_text("x")
    with pytest.raises(ObstacleError, match=r"\.stl"):
        read_obstacles([folder / "table.step"])


def test_a_sheet_may_be_thin(folder):
    (sheet,) = read_obstacles([write(folder, "[[box]]\nsize = [1, 1, 0.0005]")]).each
    assert sheet.shape.size[2] == 0.0005


COLLISION = '<robot name="r"><link name="l"><collision><geometry>{}</geometry></collision></link></robot>'


@pytest.mark.parametrize(
    ("geometry", "said"),
    [
        ('<box size="-1 1 1"/>', "above 0"),
        ('<cylinder radius="0" length="1"/>', "above 0"),
        ('<sphere radius="nan"/>', "above 0"),
        ('<sphere radius="2000"/>', "4000 m"),
        ('<mesh filename="no.stl"/>', "no.stl"),
        ('<mesh filename="part.stl"/>', "measures 300 m"),
    ],
)
def test_a_scene_with_what_cannot_stand_in_a_room(folder, geometry, said):
    (folder / "bad.urdf").write_text(COLLISION.format(geometry))
    with pytest.raises(ObstacleError) as error:
        read_obstacles([folder / "bad.urdf"])
    assert said in str(error.value)


def test_meshes_of_a_scene_have_their_scale_and_lie_in_their_package(folder):
    (folder / "parts" / "urdf").mkdir(parents=True)
    mesh = '<mesh filename="package://parts/part.stl" scale="0.001 0.001 0.001"/>'
    (folder / "parts" / "urdf" / "scene.urdf").write_text(COLLISION.format(mesh))
    (part,) = read_obstacles([folder / "parts" / "urdf" / "scene.urdf"]).each
    np.testing.assert_allclose(np.ptp(part.shape.vertices, axis=0), [0.1, 0.2, 0.3], atol=1e-9)
