# SPDX-License-Identifier: Apache-2.0
"""`emulated_drives`: two drives in a process of their own; faults are injected by lines on standard input."""

from __future__ import annotations

from fivebar_description.known_drives import CANOPEN
from fivebar_sim.emulators.serving import serve


def main() -> None:
    """Run the program."""
    serve("emulated_drives", CANOPEN, "dextar_emulated")


if __name__ == "__main__":
    main()
