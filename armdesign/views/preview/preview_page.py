"""The preview as one page: MeshCat's viewer, the drawing commands and our controls, without anything from elsewhere."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jinja2
import meshcat
import numpy as np
import umsgpack

from armdesign._types import Array
from armdesign.demonstration.files.readers import legible_text
from armdesign.errors import SettingsError, counted
from armdesign.search.result import Result
from armdesign.views.preview.colours import ARM, AXES, DEMONSTRATOR, TUBE, VIRIDIS
from armdesign.views.preview.preview_scene import AXIS, Scene, Shown, build_scene
from armdesign.views.preview.surroundings import OBSTACLE, REGION

HERE = Path(__file__).resolve().parent
NEGLIGIBLE = 5e-5
"""Interpolation that is off by less is not worth a word [m]."""

SLOWEST = 1e-3
"""Least speed, times true speed."""
SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0)
"""Speeds to choose from on the page, beside the one it begins with."""
MOST_DESIGNS = 12
"""Designs side by side; more would look alike, and would not fit into the page's size."""
THING = "#2b2620"
"""Colour of the names of obstacles."""
NAME_GAP = 0.06
"""Free space below a design's name [m]."""


def preview_html(
    runs: Sequence[Result], speed: float = 1.0, urdfs: Sequence[str] | None = None, title: str | None = None
) -> str:
    """Finished runs performing their tasks, as one HTML page that works offline and loads nothing.

    The arms move at true speed. At most 60 frames per second are kept, fewer where a long recording would make
    the page too large; the browser interpolates and the page says how many they are. The fragment ``#t=1.5`` stops
    the motion at that time.

    Args:
        runs: The designs, shown side by side in this order.
        speed: Times true speed at which the page begins to play.
        urdfs: Their URDFs where these are known, such as a run folder's arm.urdf.
        title: What the page is called; the names of the runs by default.

    Returns:
        The page; below 5 MB.

    Raises:
        SettingsError: There is no run or too many, or the speed is none.
    """
    if not 1 <= len(runs) <= MOST_DESIGNS:
        raise SettingsError(f"a page cannot show {counted(len(runs), 'design')}", allowed=f"1 to {MOST_DESIGNS}")
    check_speed(speed)
    return page(build_scene(runs, urdfs), speed, title)


def check_speed(speed: float) -> None:
    """Refuse speeds that show nothing.

    Raises:
        SettingsError: It is not between a thousandth of true speed and a thousand times.
    """
    if not SLOWEST <= speed <= 1.0 / SLOWEST:
        allowed = f"{SLOWEST:g} to {1.0 / SLOWEST:g}; 1 is true speed"
        raise SettingsError(f"the speed is {speed:g}", value=speed, allowed=allowed)


def page(scene: Scene, speed: float, title: str | None = None) -> str:
    """The page of a scene; every name in it is escaped.

    Args:
        scene: What is drawn.
        speed: Times true speed.
        title: What the page is called; the names of the designs by default.
    """
    scripts = {"meshcat": meshcat_bundle(), "script": (HERE / "page.js").read_text(encoding="utf-8")}
    environment = jinja2.Environment(undefined=jinja2.StrictUndefined, autoescape=True, trim_blocks=True)
    template = environment.from_string((HERE / "page.html.j2").read_text(encoding="utf-8"))
    return template.render(
        **scripts,
        hashes=" ".join(f"'sha256-{digest(text)}'" for text in scripts.values()),
        licences=meshcat_licences(),
        style=(HERE / "page.css").read_text(encoding="utf-8"),
        commands="\n".join(base64.b64encode(umsgpack.packb(each)).decode("ascii") for each in scene.commands),
        data=embedded(page_data(scene, speed)),
        title=legible_text(title or ""),
        names=", ".join(shown.name for shown in scene.designs),
        speed=speed,
        speeds=sorted({*SPEEDS, speed}),
        surroundings=any(shown.surrounded for shown in scene.designs),
        regions=any(shown.regions for shown in scene.designs),
        colours={
            "arm": ARM,
            "tube": TUBE,
            "demonstrator": DEMONSTRATOR,
            "room": OBSTACLE,
            "region": REGION,
            "scale": ", ".join(VIRIDIS),
        },
        ticks=[f"{share * scene.scale.top * 1e3:g}" for share in (0.0, 0.5, 1.0)],
        oriented=any(shown.oriented for shown in scene.designs),
        moved=moved_words([slides for shown in scene.designs for slides in shown.sliding]),
        notes=notes(scene, speed),
    )


def page_data(scene: Scene, speed: float) -> dict[str, Any]:
    """What the page's script needs to know; positions in metres, distances in millimetres."""
    return {
        "duration": scene.duration,
        "speed": speed,
        "designs": [design_data(shown) for shown in scene.designs],
        "labels": [label for shown in scene.designs for label in labels(shown, several=len(scene.designs) > 1)],
        "framed": [point for shown in scene.designs for point in framed(shown).tolist()],
        "feet": [[*shown.pose[:2, 3].tolist(), scene.floor] for shown in scene.designs],
        "scale": {"top": scene.scale.top * 1e3, "colours": VIRIDIS},
        "direction": looked_from(scene).tolist(),
    }


def looked_from(scene: Scene) -> Array:
    """Where the camera stands, seen from the middle: on the free side of every wall, shape (3,)."""
    direction = np.array([1.0, -0.22, 0.4] if len(scene.designs) > 1 else [0.62, -0.8, 0.42])
    for normal in scene.designs[0].walls:
        direction = direction - 2.0 * min(0.0, float(direction @ normal)) * normal
    return direction


def moved_words(sliding: Sequence[bool]) -> str:
    """What the column says of how far joints have moved: angle, travel of sliding ones, or both."""
    return " or ".join(word for word, said in (("angle", not all(sliding)), ("travel", any(sliding))) if said)


def framed(shown: Shown) -> Array:
    """What the camera has to see of a design: its space, base frame and name, shape (12, 3)."""
    corners = np.stack(np.meshgrid(*shown.bounds.T, indexing="ij"), axis=-1).reshape(-1, 3)
    origin = shown.pose[:3, 3]
    axes = origin + 1.2 * AXIS * shown.pose[:3, :3].T
    return np.concatenate([corners, axes, [[*origin[:2], top_of(shown)]]])


def top_of(shown: Shown) -> float:
    """Height of a name above its design [m]."""
    return max(float(shown.bounds[1, 2]), float(shown.pose[2, 3]) + 1.2 * AXIS) + NAME_GAP


def design_data(shown: Shown) -> dict[str, Any]:
    """The distances and the joints of a design over time [mm, deg]."""
    return {
        "name": shown.name,
        "points": shown.points,
        "times": np.round(shown.times, 4).tolist(),
        "distances": np.round(shown.distance * 1e3, 1).tolist(),
        "sliding": list(shown.sliding),
        "joints": np.round(shown.joints * np.where(shown.sliding, 1e3, np.rad2deg(1.0)), 2).tolist(),
    }


def labels(shown: Shown, *, several: bool) -> list[dict[str, Any]]:
    """Texts in the scene: x and y of the base frame, obstacles, and the design's name where there are several.

    That of z would lie on the arm.
    """
    found = [{"text": name, "place": top.tolist(), "kind": "thing", "colour": THING} for name, top in shown.things]
    origin = shown.pose[:3, 3]
    for axis, direction, colour in zip("xy", shown.pose[:3, :2].T, AXES, strict=False):
        place = (origin + 1.15 * AXIS * direction).tolist()
        found.append({"text": axis, "place": place, "kind": "axis", "colour": colour})
    if several:
        above = [*origin[:2].tolist(), top_of(shown)]
        found.append({"text": shown.name, "place": above, "kind": "name", "colour": "#1d242b"})
    return found


def notes(scene: Scene, speed: float) -> list[str]:
    """Sentences on what is shown: the speed, and what was left out."""
    boxes = [name for design in scene.designs for name in design.simplified]
    drawn = [f"Drawn as the box about it: {', '.join(boxes)}."] if boxes else []
    rate = "True speed" if speed == 1.0 else f"{speed:g} times true speed"
    shown = sum(len(design.times) for design in scene.designs)
    frames = sum(design.frames for design in scene.designs)
    if shown == frames:
        return [f"{rate}, all of {counted(frames, 'frame')}.", *drawn]
    off = max(design.deviation for design in scene.designs)
    text = f"{rate}. {shown} of {counted(frames, 'frame')} are shown as they are"
    between = (
        f", the others by straight lines that leave the path by up to {off * 1e3:.1f} mm." if off > NEGLIGIBLE else "."
    )
    return [f"{text}{between}", *drawn]


def embedded(data: dict[str, Any]) -> str:
    """JSON that can stand in a script element: nothing in it ends the element."""
    text = json.dumps(data, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def digest(script: str) -> str:
    """What the page's security policy knows a script by."""
    return base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")


def meshcat_bundle() -> str:
    """The script of MeshCat's viewer, fit to stand in a script element."""
    text = (viewer_folder() / "dist" / "main.min.js").read_text(encoding="utf-8")
    return text.replace("</script", "<\\/script").replace("<!--", "<\\!--")


def meshcat_licences() -> str:
    """The licences under which MeshCat's viewer may be passed on."""
    folder = viewer_folder()
    texts = [path.read_text(encoding="utf-8") for path in (folder / "LICENSE", folder / "dist/main.min.js.LICENSE.txt")]
    return "\n".join(texts).replace("</script", "")


def viewer_folder() -> Path:
    """Where MeshCat keeps its viewer."""
    return Path(meshcat.viewer_assets_path())
