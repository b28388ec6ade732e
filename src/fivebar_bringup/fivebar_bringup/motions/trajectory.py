# SPDX-License-Identifier: Apache-2.0
"""Requests to follow the path of a file at another pace."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from fivebar_bringup.motions.request import Request, refuse_malformed, task_of_request
from fivebar_control.planning.retiming import as_csv, retimed_points
from fivebar_control.planning.trajectory_file import TrajectoryFile, points_in
from fivebar_description.files import write_file


@contextmanager
def at_another_pace(request: Request) -> Iterator[Request]:
    """Return the request to follow a file at a pace that is chosen; its file is there within the context only.

    Raises:
        InputError: the file is no trajectory, or its path is feasible at no pace.
    """
    refuse_malformed(request)
    # where the file does not begin where the robot rests, its times say so as they do without another pace
    points, start = points_in(TrajectoryFile.at(request.trajectory)), request.start
    timed = retimed_points(task_of_request(request), points, (start.x, start.y))
    with TemporaryDirectory(prefix="fivebar-") as folder:
        path = Path(folder, "trajectory.csv")
        write_file(path, as_csv(timed))
        yield request._replace(trajectory=str(path))
