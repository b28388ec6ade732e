# SPDX-License-Identifier: Apache-2.0
"""`emulated_board`: a motor board in a process of its own; faults are injected by lines on standard input."""

from __future__ import annotations

from fivebar_sim.emulators.serving import serve


def main() -> None:
    """Run the program."""
    serve("emulated_board", "motkin", "motkin_emulated")


if __name__ == "__main__":
    main()
