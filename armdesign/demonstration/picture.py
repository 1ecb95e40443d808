"""A recording as a picture: the paths of its points from three sides, and when which of them was not seen."""

from __future__ import annotations

import io
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.cleaning.gaps import find_gaps
from armdesign.demonstration.points.selection import arm_paths, guess_of
from armdesign.demonstration.recording import Recording
from armdesign.errors import SettingsError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMATS = ("png", "svg", "pdf")
_COLOURS = ("#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#F0E442")  # Okabe and Ito
_DASHES = ("-", "--", "-.", ":")  # so that the lines differ without colour too
_GREY = "#8C8C8C"
_SHADES = ("#B4C8D8", "#8AAAC3", "#5F8CAD", "#356C94", "#00395C")  # of the arm, the first frame to the last
_WIDTH = 4.8  # [inch]
_FEW = 8  # points that get a colour each where no arm is known
_ROWS = 40  # points with gaps that are shown
_DRAWN = 2000  # frames of a path; more cannot be told apart
_BARS = 400  # gaps side by side; more cannot be told apart
_VIEWS = (("x and z, seen along y", 0, 2), ("y and z", 1, 2), ("x and y, from above", 0, 1))
_FLATTEST = 0.35  # a side of the box around everything, as part of the longest


@dataclass(frozen=True)
class _Row:
    """A point that was not seen in some frames."""

    name: str
    spans: Sequence[tuple[float, float]]  # begin and length [s]
    missing: float  # share of the frames


def draw_recording(recording: Recording, kind: str = "png") -> bytes:
    """The picture as the content of a file.

    Args:
        recording: In metres with z up.
        kind: ``png``, ``svg`` or ``pdf``.

    Raises:
        SettingsError: Another kind was asked for.
    """
    check_kind(kind)
    import matplotlib as mpl  # noqa: PLC0415  (slow to import)

    metadata = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}[kind]
    style = mpl.rc_context(  # 6 pt and more where it is printed 80 mm wide
        {
            "svg.hashsalt": "armdesign",
            "font.size": 9.5,
            "axes.titlesize": 9.5,
            "legend.fontsize": 9.5,
            "figure.titlesize": 10,
        }
    )
    with style, warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")  # a letter that the font lacks is drawn as a box
        content = io.BytesIO()
        figure = _figure(recording)
        # The solver of the layout goes through its unknowns in the order of their addresses, so that its last bits
        # differ from run to run. Rounded places make the same picture the same file.
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
        for axis in figure.axes:
            axis.set_position(np.round(axis.get_position(original=True).bounds, 6).tolist())
        figure.savefig(content, format=kind, dpi=180, metadata=metadata)
    return content.getvalue()


def check_kind(kind: str) -> str:
    """A kind of picture that can be drawn."""
    if kind not in FORMATS:
        allowed = ", ".join(f".{each}" for each in FORMATS)
        raise SettingsError(f"a picture cannot be written as '.{kind}'", value=kind, allowed=allowed)
    return kind


def _figure(recording: Recording) -> Figure:
    """Three views and the gaps below one another."""
    from matplotlib.figure import Figure  # noqa: PLC0415
    from matplotlib.layout_engine import ConstrainedLayoutEngine  # noqa: PLC0415

    rows = _rows(recording)
    low, high = _box(recording)
    size = high - low
    below = 0.9 + 0.18 * max(2, min(len(rows), _ROWS))  # [inch]
    above = 2.6 + 3.1 * np.clip((size[2] + size[1]) / (size[0] + size[1]), 0.4, 1.3)
    figure = Figure(figsize=(_WIDTH, above + below + 0.4), layout=ConstrainedLayoutEngine(w_pad=0.1))
    figure.suptitle(_plain(_title(recording)))
    parts: Any = figure.subfigures(2, 1, height_ratios=[above, below])
    upper, lower = parts
    axes = upper.subplots(2, 2, width_ratios=[size[0], size[1]], height_ratios=[size[2], size[1]])
    arm = guess_of(recording).arm
    shown: Mapping[str, Array] = recording.points if _by_colour(recording) else {}  # drawn in colour
    shown = shown if arm is None else arm_paths(arm, recording)
    for axis, (title, across, up) in zip((axes[0, 0], axes[0, 1], axes[1, 0]), _VIEWS, strict=True):
        _view(axis, recording, shown, (across, up))
        axis.set(title=title, xlabel=f"{'xyz'[across]} [m]", ylabel=f"{'xyz'[up]} [m]", aspect="equal")
        axis.set(xlim=(low[across], high[across]), ylim=(low[up], high[up]))
    axes[1, 1].axis("off")
    _legend(upper, axes[0, 0], len(recording.points) - len(shown))
    _gaps(lower.subplots(), rows, recording)
    return figure


def _title(recording: Recording) -> str:
    """The file's name, and below it how much there is."""
    name = recording.source.replace("\\", "/").rpartition("/")[2]
    form = recording.about.format or "recording"
    count = f"{len(recording.points)} points, {recording.frames} frames"
    return f"{_short(name, 80)}\n{_short(form, 40)}, {count}, {recording.rate:.4g} frames/s"


def _by_colour(recording: Recording) -> bool:
    """Whether the points are few enough for a colour each."""
    return len(recording.points) <= _FEW


def _view(axis: Axes, recording: Recording, shown: Mapping[str, Array], plane: tuple[int, int]) -> None:
    """All paths from one side, and the arm in some frames."""
    across, up = plane
    every = _every(recording)
    for name, values in recording.points.items():
        if name not in shown or shown[name] is not values:
            axis.plot(values[::every, across], values[::every, up], color=_GREY, linewidth=0.7, zorder=1)
    for i, (name, values) in enumerate(shown.items()):
        style: dict[str, Any] = {"color": _COLOURS[i % len(_COLOURS)], "zorder": 3}
        style |= {"linestyle": _DASHES[i % len(_DASHES)], "linewidth": 1.1}
        axis.plot(values[::every, across], values[::every, up], label=_plain(_short(name)), **style)
        seen = np.flatnonzero(~np.isnan(values[:, 0]))
        if len(seen):
            axis.plot(*values[seen[0], [across, up]], marker="o", markersize=5, **style)
    if len(shown) > 2 and not (_by_colour(recording) and len(shown) > 5):  # more are hardly one arm
        joints = np.stack(list(shown.values()), axis=1)
        whole = np.flatnonzero(~np.isnan(joints).any(axis=(1, 2)))
        frames = whole[np.linspace(0, len(whole) - 1, len(_SHADES)).astype(int)] if len(whole) else ()
        for shade, frame in zip(_SHADES, frames, strict=False):
            axis.plot(*joints[frame][:, plane].T, color=shade, linewidth=2.6, solid_capstyle="round", zorder=2)
    axis.grid(linewidth=0.3)


def _every(recording: Recording) -> int:
    """Every how many frames one is drawn."""
    return max(1, recording.frames // _DRAWN)


def _legend(part: Any, source: Axes, others: int) -> None:  # noqa: ANN401 (a subfigure)
    """What the colours mean, below the views."""
    handles, labels = source.get_legend_handles_labels()
    if not handles:
        part.supxlabel(f"{others} points, none known by its name as part of an arm", fontsize=9.5)
        return
    title = "Dots: first frame. Thick: arm in 5 frames, light to dark."
    title += "\nGrey: other points." if others > 0 else ""
    part.legend(handles, labels, loc="outside lower center", ncols=4 if len(labels) <= 4 else 2, frameon=False,
                title=title, handlelength=2.2, columnspacing=1.0)  # fmt: skip


def _gaps(axis: Axes, rows: Sequence[_Row], recording: Recording) -> None:
    """When which point was not seen, a line per point."""
    first, last = float(recording.time[0]), float(recording.time[-1])
    axis.set(xlim=(first, last), xlabel="time [s]")
    whole = len(recording.points) - len(rows)
    if not rows:
        axis.set(yticks=[], title="All points are seen in every frame")
        axis.text(0.5, 0.5, "no gaps", transform=axis.transAxes, ha="center", va="center")
        return
    shown = sorted(rows, key=lambda row: row.missing, reverse=True)[:_ROWS]
    shown = [row for row in rows if row in shown]
    for place, row in enumerate(shown):
        axis.broken_barh(row.spans, (place - 0.4, 0.8), facecolor="#0072B2", edgecolor="#0072B2", linewidth=0.6)
    labels = [_plain(f"{_short(row.name, 18)}  {100 * row.missing:.1f} %") for row in shown]
    axis.set_yticks(range(len(shown)), labels, fontsize=9.5)
    axis.set(ylim=(len(shown) - 0.5, -0.5))
    axis.grid(axis="x", linewidth=0.3)
    left_out = f";\n{len(rows) - len(shown)} more with fewer gaps are not shown" if len(rows) > len(shown) else ""
    axis.set(title=f"Not seen (share of frames); {whole} of {len(recording.points)} have no gap{left_out}")


def _rows(recording: Recording) -> list[_Row]:
    """The points with gaps."""
    rows = []
    for name, values in recording.points.items():
        gaps = find_gaps(name, values, recording.time)
        if gaps:
            missing = sum(gap.stop - gap.first for gap in gaps) / recording.frames
            edges = np.array([(gap.begins, gap.ends) for gap in gaps])
            rows.append(_Row(name, _spans(edges, (recording.time[-1] - recording.time[0]) / _BARS), missing))
    return rows


def _spans(edges: Array, least: float) -> list[tuple[float, float]]:
    """Begin and length of gaps, given by edges of shape (n, 2); those too close to be told apart become one."""
    far = np.flatnonzero(edges[1:, 0] - edges[:-1, 1] > least)
    begins, ends = edges[np.r_[0, far + 1], 0], edges[np.r_[far, len(edges) - 1], 1]
    return [(float(begin), float(end - begin)) for begin, end in zip(begins, ends, strict=True)]


def _box(recording: Recording) -> tuple[Array, Array]:
    """Lowest and highest corner of a box around everything that is not too flat."""
    every = np.concatenate([values[:: _every(recording)] for values in recording.points.values()] or [np.zeros((1, 3))])
    every = every[~np.isnan(every).any(axis=1)]
    every = every if len(every) else np.zeros((1, 3))
    low, high = every.min(axis=0), every.max(axis=0)
    longest = max(float((high - low).max()), 1e-3)
    half = np.maximum(high - low, _FLATTEST * longest) / 2 + 0.03 * longest
    middle = (low + high) / 2
    return middle - half, middle + half


def _short(name: str, length: int = 28) -> str:
    """A name that leaves room for the rest."""
    half = length // 2 - 2
    return name if len(name) <= length else f"{name[:half]}...{name[-half:]}"


def _plain(text: str) -> str:
    """Text in which nothing is taken for a formula or, at its start, for something to be left out of the legend."""
    return (" " if text.startswith("_") else "") + text.replace("$", r"\$")
