"""The page: one file, nothing from elsewhere, names only as text; and what a real browser makes of it."""

import base64
import dataclasses
import html
import io
import json
import re
from itertools import pairwise

import matplotlib.image
import numpy as np
import pinocchio as pin
import pytest

from armdesign.cell.obstacles import Box, Obstacle
from armdesign.errors import SettingsError
from armdesign.kinematics.models import arm_model
from armdesign.views.preview import preview_html
from armdesign.views.preview.preview_page import digest, labels, looked_from, moved_words
from armdesign.views.preview.preview_scene import build_scene
from armdesign.views.preview.surroundings import named_tops

FRAMES = (0, 37, 99)
LARGEST = 5_000_000
EVIL = "</script><script>alert(1)</script><b onload='x'>&amp; \"é\""
CONSOLE = re.compile(r"CONSOLE.*|Uncaught.*|Refused to.*")
PROBE = """
setTimeout(() => {
  const { viewer, go } = window.preview, seen = {}, pictures = [], played = viewer.animator.time;
  const inverse = new MeshCat.THREE.Matrix4();
  for (const time of TIMES) {
    viewer.animator.pause();
    go(time);
    viewer.scene.updateMatrixWorld(true);
    inverse.copy(viewer.scene.matrixWorld).invert();
    const all = seen[time] = {};
    const visit = (node, path) => {
      const pose = inverse.clone().multiply(node.object.matrixWorld);
      all[path] = pose.elements;
      for (const name of Object.keys(node.children)) visit(node.children[name], path ? `${path}/${name}` : name);
    };
    visit(viewer.scene_tree.find(["meshcat"]), "");
    pictures.push(viewer.capture_image());
  }
  const output = document.createElement("pre");
  output.id = "probe";
  output.textContent = JSON.stringify({
    played, seen, pictures, speed: viewer.animator.mixer.timeScale,
    loaded: performance.getEntriesByType("resource").map((entry) => entry.name),
    distances: document.getElementById("distances").textContent,
    joints: [...document.querySelectorAll("#joints td")].map((cell) => cell.textContent),
    bar: getComputedStyle(document.querySelector(".dg.main") || document.createElement("p")).display,
  });
  document.body.appendChild(output);
}, 500);
"""


def probed(page, times):
    """The page with a script that reports where everything stands at some times."""
    script = PROBE.replace("TIMES", json.dumps(times))
    page = page.replace("script-src ", f"script-src 'sha256-{digest(script)}' ", 1)
    return page.replace("</body>", f"<script>{script}</script></body>")


def report(dom):
    """What that script found."""
    return json.loads(html.unescape(re.search(r'<pre id="probe">(.*?)</pre>', dom, re.DOTALL).group(1)))


@pytest.fixture(scope="session")
def pages(example_runs, tmp_path_factory):
    """The page of an example as a file, and of both with a name that would do harm."""
    folder = tmp_path_factory.mktemp("pages")
    evil = dataclasses.replace(example_runs["welding"], name=EVIL)
    shown = {"one": [example_runs["packaging"]], "two": [example_runs["packaging"], evil]}
    for name, runs in shown.items():
        (folder / f"{name}.html").write_text(preview_html(runs), encoding="utf-8")
    return folder


def test_the_page_is_one_file_that_names_nothing_elsewhere(pages):
    page = (pages / "two.html").read_text(encoding="utf-8")
    assert len(page.encode()) < LARGEST
    ours = re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)
    assert not re.search(r"https?:|//[a-z]|@import|url\(|\bsrc=", ours)
    assert re.findall(r'href="([^"]*)"', ours) == ["data:,"]
    assert "default-src 'none'" in page


def test_names_are_text_wherever_they_stand(pages):
    page = (pages / "two.html").read_text(encoding="utf-8")
    assert EVIL not in page
    assert "alert(1)</script>" not in page
    assert html.escape(EVIL, quote=False).split("onload")[0] in page
    data = json.loads(re.search(r'id="data">(.*?)</script>', page, re.DOTALL).group(1))
    assert data["designs"][1]["name"] == EVIL


def test_the_same_run_gives_the_same_picture_again(example_runs):
    def told(page):
        commands = re.search(r'id="commands">(.*?)</script>', page, re.DOTALL).group(1).split()
        return [re.sub(rb"[0-9a-f-]{36}", b"", base64.b64decode(command)) for command in commands]

    runs = [example_runs["welding"]]
    assert told(preview_html(runs)) == told(preview_html(runs))


@pytest.mark.parametrize(("dof", "points", "frames", "duration"), [(3, 3, 2_500, 50.0), (10, 12, 1_500, 15.0)])
def test_long_recordings_stay_below_the_size_and_say_what_was_left_out(any_run, dof, points, frames, duration):
    page = preview_html([any_run(0, dof, points=points, frames=frames, duration=duration, oriented=True)])
    assert len(page.encode()) < LARGEST
    shown = int(re.search(r"(\d+) of \d+ frames", page).group(1))
    assert 500 < shown < frames
    assert re.search(rf"of {frames} frames are shown as they are, the others by straight lines .* [\d.]+ mm", page)


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan"), float("inf"), 1e9])
def test_speeds_that_show_nothing_are_refused(example_runs, speed):
    with pytest.raises(SettingsError, match=r"allowed: 0\.001 to 1000"):
        preview_html([example_runs["packaging"]], speed=speed)


def test_no_design_and_too_many_are_refused(example_runs):
    for runs in ([], [example_runs["packaging"]] * 13):
        with pytest.raises(SettingsError, match="1 to 12"):
            preview_html(runs)


def test_the_speed_is_said(example_runs):
    run = [example_runs["packaging"]]
    assert "True speed, all of 100 frames." in preview_html(run)
    assert "0.5 times true speed, all of 100 frames." in preview_html(run, speed=0.5)


@pytest.fixture(scope="session")
def probe(pages, example_runs, browser):
    """What a browser makes of the page with two designs, at some frames."""
    times = example_runs["packaging"].problem.task.time
    page = probed((pages / "two.html").read_text(encoding="utf-8"), [float(times[k] - times[0]) for k in FRAMES])
    (pages / "probe.html").write_text(page, encoding="utf-8")
    dom, log = browser((pages / "probe.html").as_uri(), "--dump-dom")
    assert not CONSOLE.findall(log)
    return report(dom)


def test_the_page_plays_by_itself_and_loads_nothing(probe):
    assert probe["loaded"] == []
    assert probe["played"] > 0.0
    assert probe["speed"] == 1.0
    assert EVIL in probe["distances"]
    assert probe["bar"] in ("none", "")  # MeshCat's own controls


def test_the_page_says_where_every_joint_is_and_how_fast(probe, example_runs):
    cells = iter(zip(probe["joints"][::2], probe["joints"][1::2], strict=True))
    for run in example_runs.values():
        q = np.rad2deg(run.evaluation.path.q)
        for i in range(run.table.dof):
            place, speed = next(cells)
            assert q[:, i].min() - 0.06 <= float(place.removesuffix(" °")) <= q[:, i].max() + 0.06
            assert speed.endswith("°/s")
    assert next(cells, None) is None


def test_a_title_takes_the_place_of_the_names_and_is_text(example_runs):
    page = preview_html([example_runs["packaging"]], title=EVIL)
    assert f"<title>{html.escape(EVIL, quote=False)[:8]}" in page
    assert "<script>alert(1)" not in page
    assert "<title>packaging: preview</title>" in preview_html([example_runs["packaging"]])


def test_the_camera_stands_on_the_free_side_of_walls(any_run):
    walls = np.array([[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    scene = build_scene([any_run(0, 3)])
    seen = dataclasses.replace(scene, designs=(dataclasses.replace(scene.designs[0], walls=walls),))
    assert (walls @ looked_from(seen) > 0.0).all()
    assert np.linalg.norm(looked_from(seen)) == pytest.approx(np.linalg.norm(looked_from(scene)))


def test_what_stands_in_the_room_has_its_name_in_the_picture_and_joints_slide_or_turn(any_run):
    shown = build_scene([any_run(0, 3)]).designs[0]
    box = Obstacle("table", Box(np.array([0.4, 0.6, 0.2])), np.eye(4)[None])
    assert [[name, *top] for name, top in named_tops([box])] == [["table", 0.0, 0.0, 0.1]]
    texts = labels(dataclasses.replace(shown, things=tuple(named_tops([box]))), several=False)
    assert [each["text"] for each in texts] == ["table", "x", "y"]  # that of z would lie on the arm
    words = [moved_words(each) for each in ([False], [True], [True, False])]
    assert words == ["angle", "travel", "angle or travel"]


def test_the_browser_has_the_arms_where_pinocchio_has_them(probe, example_runs):
    for k, seen in zip(FRAMES, probe["seen"].values(), strict=True):
        for number, run in enumerate(example_runs.values(), start=1):
            model, base = arm_model(run.table), pose(seen[f"design_{number}"])
            data = model.createData()
            pin.forwardKinematics(model, data, run.evaluation.path.q[k])
            for i in range(1, run.table.dof + 1):
                exact = base @ data.oMi[i].homogeneous  # the housing of joint i stands at its frame
                np.testing.assert_allclose(pose(seen[f"design_{number}/arm/visuals/link_{i}_0"]), exact, atol=2e-6)
            hand = pose(seen[f"design_{number}/demonstrator/point_3"])[:3, 3]
            np.testing.assert_allclose(hand, (base[:3, 3] + run.problem.task.P[k, -1]), atol=2e-6)


def pose(elements):
    """A matrix of three.js, column by column."""
    return np.array(elements).reshape(4, 4).T


def test_the_picture_is_not_blank_and_changes_with_time(probe, pages, browser, tmp_path):
    pictures = [picture(base64.b64decode(text.split(",")[1])) for text in probe["pictures"]]
    _, log = browser(f"{(pages / 'one.html').as_uri()}#t=1.5", f"--screenshot={tmp_path / 'shot.png'}")
    assert not CONSOLE.findall(log)
    for shown in (*pictures, picture((tmp_path / "shot.png").read_bytes())[40:-80]):
        assert len(np.unique((shown * 31).round().reshape(-1, 3), axis=0)) > 100
        assert (shown[..., 2] > shown[..., 0] + 0.3).mean() > 0.002  # the blue arm
        assert (shown[..., 0] > shown[..., 2] + 0.4).mean() > 0.002  # the vermillion demonstrator
    for first, second in pairwise(pictures):
        assert (np.abs(first - second).max(axis=-1) > 0.1).mean() > 0.01


def picture(content):
    """Red, green and blue of a PNG, shape (height, width, 3)."""
    return matplotlib.image.imread(io.BytesIO(content))[..., :3]


def test_names_that_are_no_text_do_not_break_the_page(example_runs):
    odd = dataclasses.replace(example_runs["packaging"], name="run\udcff\x00\n")
    assert "run?? " in preview_html([odd]).encode().decode()
