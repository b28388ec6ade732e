"""From a bag to an identified robot: parameter file, figures, page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple

from fivebar_bringup.pages.picture import write_pictures
from fivebar_bringup.runs.bag.tail import replace_file
from fivebar_bringup.runs.run_directory import new_directory
from fivebar_bringup.studies.identify.findings import Findings
from fivebar_bringup.studies.identify.reading import find_bag, read_record, read_start
from fivebar_control.identification.identification import NotIdentifiable, identify
from fivebar_description.strict_yaml import InputError


class IdentificationDirectory(NamedTuple):
    """The directory of one identification; every file in it has its place here."""

    path: Path

    @property
    def robot(self) -> Path:
        """The parameter file that `robot:` in a scenario takes."""
        return self.path / "identified.yaml"

    @property
    def content(self) -> Path:
        """All figures."""
        return self.path / "identification.json"

    @property
    def page(self) -> Path:
        """The page to look at."""
        return self.path / "identification.html"

    @property
    def figures(self) -> Path:
        """The folder of the PNG figures."""
        return self.path / "figures"


def identify_bag(path: Path, robot: str | None = None) -> Findings:
    """Identify the robot of a bag or of a run's directory, starting from the run's parameter file or a given one.

    Raises:
        InputError: the bag, the robot or the motion cannot serve.
        BagError: the bag cannot be read or lacks what is needed.
    """
    source = find_bag(path)
    start = read_start(source, robot)
    record = read_record(source, start)
    try:
        found = identify(start.five_bar(), record)
    except NotIdentifiable as error:
        raise InputError(f"{source.bag}: {error}") from error
    return Findings(start, source.bag, record.rate_hz, len(record.angles), found)


def write_identification(findings: Findings, out: Path | None) -> IdentificationDirectory:
    """Write parameter file, figures, page and JSON into a new directory.

    Raises:
        InputError: the directory cannot be used.
    """
    # here, because matplotlib takes as long to load as all the rest of the command
    from fivebar_bringup.studies.identify.figures import draw_pictures
    from fivebar_bringup.studies.identify.page import html_page

    directory = IdentificationDirectory(new_directory(out, f"identify-{findings.start.name}"))
    pictures = draw_pictures(findings)
    text = json.dumps(findings.as_json(), indent=2, allow_nan=False) + "\n"
    try:
        write_pictures(directory.figures, pictures)
        replace_file(directory.page, html_page(findings, pictures).encode("utf-8"))
        replace_file(directory.content, text.encode("utf-8"))
        replace_file(directory.robot, findings.parameter_file().encode("utf-8"))
    except OSError as error:
        raise InputError(f"{directory.path}: cannot be used for the results: {error.strerror}") from error
    return directory
