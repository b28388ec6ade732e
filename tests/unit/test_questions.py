"""Where new users find answers: every question leads to a heading at most three clicks from the home page."""

from __future__ import annotations

import re
from pathlib import Path

from fivebar_control.planning import figures

DOCS = Path(__file__).parents[2] / "docs"
CLICKS = 3
QUESTIONS = {
    "What is singular about it, and why can it be crossed?": "why.md",
    "How do I see a crossing in a minute?": "tutorials/first_crossing.md#through-the-locus-and-back",
    "How do I install it beside ROS 2 Jazzy?": "get_started.md#with-ros-2-jazzy",
    "Has it run on a real robot?": "faq.md#has-it-run-on-a-robot",
    "How do I describe my own five-bar?": "tutorials/own_robot.md#the-robots-file",
    "How do I use my own drives?": "tutorials/own_drives.md#the-parts",
    "Which controller should I use?": "choose.md#which-law",
    "Which sensors do I need?": "choose.md#which-sensors",
    "Which gyroscope do I buy, and how do I declare it?": "imu.md#choose-the-part",
    "How accurate will it be?": "faq.md#how-accurate-will-it-be",
    "How good does my robot have to be?": "robustness.md#where-the-first-run-fails",
    "My motion is refused. What now?": "refused.md#refused-with-exit-status-2",
    "What does `estimate_inconsistent` mean?": "faq.md#what-does-estimate_inconsistent-mean",
    "What does a fault mean, and how do I go on?": "reference/graph.md#faults",
    "How do I go to a point in the other assembly mode?": "motions.md",
    "How do I repeat moves and switch a gripper?": "programs.md#on-the-topic",
    "How do I get a run into pandas or MATLAB?": "reference/run_table.md",
    "What must I do before the first power-on?": "robot.md#first-power-on",
    "How do I write a controller of my own?": "tutorials/control_law.md",
    "How do I calibrate a robot that cannot cross yet?": "calibration.md#by-hand-without-power",
    "How do I cite it?": "faq.md#how-do-i-cite-it",
    "What will still work with the next version?": "reference/stability.md",
}


def linked(page: str) -> set[str]:
    """Return the pages that a page links to, by their paths in docs."""
    folder = (DOCS / page).parent
    targets = re.findall(r"\]\(([\w./]+\.md)(?:#[^)]*)?\)", (DOCS / page).read_text(encoding="utf-8"))
    paths = [(folder / target).resolve() for target in targets]
    return {path.relative_to(DOCS).as_posix() for path in paths if path.is_file() and path.is_relative_to(DOCS)}


def anchors(page: str) -> set[str]:
    """Return the anchors of a page's headings."""
    headings = re.findall(r"^#+ (.*)$", (DOCS / page).read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


def test_answers_are_three_clicks_from_the_home_page() -> None:
    clicks = {"index.md": 0}
    for distance in range(1, CLICKS + 1):
        for page in [page for page, reached in clicks.items() if reached == distance - 1]:
            for target in linked(page):
                clicks.setdefault(target, distance)
    wrong = []
    for question, place in QUESTIONS.items():
        page, _, anchor = place.partition("#")
        if page not in clicks:
            wrong.append(f"{question} {page} is more than {CLICKS} clicks away")
        elif anchor and anchor not in anchors(page):
            wrong.append(f"{question} {page} has no heading {anchor}")
    assert not wrong, "\n".join(wrong)


def test_every_figure_that_refuses_a_motion_has_its_advice() -> None:
    page = (DOCS / "refused.md").read_text(encoding="utf-8").replace("\\|", "|")
    names = {value for name, value in vars(figures).items() if name.isupper() and isinstance(value, str)}
    assert len(names) > 10
    assert not [name for name in names if name.removesuffix(" without the reserve of torque") not in page]
