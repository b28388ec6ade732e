# SPDX-License-Identifier: Apache-2.0
"""A run as a moving picture: the robot on its way, beside torques and weight with a cursor."""

from __future__ import annotations

import io
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.lines import Line2D
from numpy.typing import NDArray
from PIL import Image

from fivebar_bringup.pages.style import BLUE, GREY, INK, VERMILION, house_style
from fivebar_bringup.report import plane
from fivebar_bringup.report.analysis import RunAnalysis
from fivebar_bringup.report.workspace import draw_robot
from fivebar_description.errors import unwrapped
from fivebar_description.strict_yaml import InputError

FRAME_RATE = 15
"""Frames per second of the file."""

SHORTEST, LONGEST = 6.0, 20.0
"""How long (s) the file plays: a shorter run is shown slower, a longer one faster."""

LINGER = 12
"""How often the last frame is repeated."""

DPI = 64

COLOURS = 48
"""Colours of a GIF: few, because they are most of its size, and the picture has few."""

Pixels = NDArray[np.uint8]


def animate(run: RunAnalysis, suffix: str) -> bytes:
    """Return a run with samples as a file of this suffix, `gif` or `mp4`.

    Raises:
        InputError: for `mp4` ffmpeg is needed and cannot be used.
    """
    if suffix == "mp4" and shutil.which("ffmpeg") is None:
        raise InputError("--mp4: ffmpeg was not found: expected it on the PATH (apt install ffmpeg), or use --gif")
    with house_style():
        frames = list(_frames(run))
    return _gif(frames) if suffix == "gif" else _mp4(frames)


def _frames(run: RunAnalysis) -> Iterator[Pixels]:
    """Draw what stands still once, and over it what moves, frame by frame: uint8[height, width, 3]."""
    series = run.series
    end = float(series.time[-1])
    length = min(max(end, SHORTEST), LONGEST)
    rows = np.searchsorted(series.time, np.linspace(0.0, end, round(length * FRAME_RATE) + 1) - 1e-9)
    figure, robot_axes, time_axes = plane.moving(run, plane.survey_run(run))
    figure.set_dpi(DPI)
    pace = end / length
    robot_axes.set_title(f"{pace:.2g} times as fast as it was" if abs(pace - 1.0) > 0.01 else "in real time")
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    still = canvas.copy_from_bbox(figure.bbox)
    x, y = 1e3 * series.platform[:, 0], 1e3 * series.platform[:, 1]
    # in the colours of the assembly modes, as on the page
    trails = [
        (Line2D([], [], color=colour, linewidth=2.4, zorder=2.5), np.where(sign * series.det_a >= 0.0, y, np.nan))
        for sign, colour in ((1.0, BLUE), (-1.0, VERMILION))
    ]
    for trail, _ in trails:
        robot_axes.add_line(trail)
    cursors = [axes.axvline(0.0, color=INK, linewidth=1.4) for axes in time_axes]
    clock = robot_axes.text(0.02, 0.97, "", transform=robot_axes.transAxes, va="top", color=GREY)
    for row in [*rows.tolist(), *[int(rows[-1])] * LINGER]:
        canvas.restore_region(still)
        for trail, within in trails:
            trail.set_data(x[: row + 1], within[: row + 1])
        clock.set_text(f"{series.time[row]:.2f} s")
        for artist in (*(trail for trail, _ in trails), clock):
            robot_axes.draw_artist(artist)
        _draw_posture(robot_axes, run, row)
        for axes, cursor in zip(time_axes, cursors, strict=True):
            cursor.set_xdata([series.time[row]] * 2)
            axes.draw_artist(cursor)
        yield np.asarray(canvas.buffer_rgba())[:, :, :3].copy()


def _draw_posture(axes: Axes, run: RunAnalysis, row: int) -> None:
    """Draw the robot as it was in a row of the series, for this frame only."""
    before = len(axes.lines)
    q11, _, q21, _ = run.series.joint_position[row].tolist()
    x, y, _, _ = run.series.platform[row].tolist()
    draw_robot(axes, run.robot, (q11, q21), (x, y))
    for line in list(axes.lines)[before:]:
        axes.draw_artist(line)
        line.remove()


def _gif(frames: list[Pixels]) -> bytes:
    # one palette for all frames, so that what does not move does not change and is stored once
    sample = Image.fromarray(np.concatenate(frames[:: max(1, len(frames) // 4)]))
    palette = sample.quantize(COLOURS, method=Image.Quantize.MEDIANCUT)
    pictures = [Image.fromarray(pixels).quantize(palette=palette, dither=Image.Dither.NONE) for pixels in frames]
    buffer = io.BytesIO()
    pictures[0].save(
        buffer,
        format="GIF",
        save_all=True,
        append_images=pictures[1:],
        duration=round(1000 / FRAME_RATE),
        loop=0,
        optimize=True,
    )
    return buffer.getvalue()


def _mp4(frames: list[Pixels]) -> bytes:
    height, width, _ = frames[0].shape
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "animation.mp4"
        raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(FRAME_RATE), "-i", "-"]
        # players want even sizes and this format of pixels
        fit = ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", str(path)]
        done = subprocess.run(
            ["ffmpeg", "-y", "-loglevel", "error", *raw, *fit],
            input=b"".join(pixels.tobytes() for pixels in frames),
            capture_output=True,
            check=False,
        )
        if done.returncode:
            reason = unwrapped(done.stderr.decode("utf-8", "replace"))
            raise InputError(f"--mp4: ffmpeg failed: {reason}")
        return path.read_bytes()
