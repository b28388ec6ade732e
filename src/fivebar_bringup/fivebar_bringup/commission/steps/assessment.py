"""How likely the first crossing is to succeed, on robots drawn within what is known."""

from __future__ import annotations

from fivebar_bringup.commission.crossings import USED, TriedCrossing, as_found, likely_crossings
from fivebar_bringup.commission.session import Session
from fivebar_bringup.commission.step import Findings, GateClosed, GatedStep
from fivebar_description.text_file import write_file

ROBOTS = 24


def run(session: Session) -> Findings:
    """Try crossings there and back in several durations, and keep those that are likely enough, from slow to fast."""
    enough, unlikely = likely_crossings(session, ROBOTS)
    figures = {_name(one): str(one.odds) for one in (*enough, *unlikely)}
    if not enough:
        raise GateClosed("unlikely", _advice(unlikely, session), figures)
    # the slowest, the fastest, and the one between them
    chosen = [enough[0], enough[len(enough) // 2], enough[-1]][:USED]
    different = [one for number, one in enumerate(chosen) if one not in chosen[:number]]
    for number, one in enumerate(different, start=1):
        write_file(session.folder / f"crossing_{number}.yaml", one.scenario.to_yaml())
    for left in range(len(different) + 1, USED + 1):
        (session.folder / f"crossing_{left}.yaml").unlink(missing_ok=True)
    words = ", ".join(f"{_name(one)}: {one.odds.successes} of {one.odds.robots}" for one in different)
    return Findings(f"likely enough, slow to fast: {words} drawn robots succeed", figures)


def _name(one: TriedCrossing) -> str:
    return f"there and back in {sum(one.scenario.durations()):.2f} s"


def _advice(unlikely: list[TriedCrossing], session: Session) -> str:
    """Return why the gate is closed, and what would raise the odds most."""
    from fivebar_bringup.odds.declared import SEED
    from fivebar_bringup.odds.drawn_robots import declared_errors
    from fivebar_bringup.odds.relief import most_relieved

    if not unlikely:
        return "no duration is feasible"
    best = max(unlikely, key=lambda one: one.odds.successes)
    scenario = as_found(session, best.scenario)
    relief = most_relieved(scenario, declared_errors(scenario), SEED, best.odds)
    needed = f"expected are at least {best.scenario.risk.success:.0%}"
    return f"at best, {_name(best)}, {best.odds}; {needed}{f'; {relief}' if relief else ''}"


ASSESSMENT = GatedStep(
    name="assessment",
    title="Odds of the first crossing",
    does="simulates crossings there and back, in durations from slow to fast, on robots drawn within what is known",
    cost="a minute of computing",
    risk="none: nothing moves",
    gate="at least nine of ten drawn robots succeed in one duration",
    run=run,
)
