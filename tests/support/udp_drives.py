# SPDX-License-Identifier: Apache-2.0
"""The interface of drives that its tutorial shows, as the tutorial shows it."""

from doc_blocks import DOCS, blocks

exec(next(block.text for block in blocks(DOCS / "tutorials/own_drives.md") if block.file == "udp_drives.py"))
