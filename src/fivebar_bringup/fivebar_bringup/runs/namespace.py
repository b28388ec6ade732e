# SPDX-License-Identifier: Apache-2.0
"""The namespace of a run, by which several robots share a DDS domain."""

from __future__ import annotations

import re

from fivebar_description.errors import InputError

_NAMESPACE = re.compile(r"(/?[A-Za-z_][A-Za-z0-9_]*)(/[A-Za-z_][A-Za-z0-9_]*)*/?")


def read_namespace(text: str) -> str:
    """Return a namespace as ROS names it, "/robot1" for "robot1"; empty for none.

    Raises:
        InputError: ROS does not accept it.
    """
    if not text.strip("/"):
        return ""
    if _NAMESPACE.fullmatch(text) is None or "__" in text:
        raise InputError(f"--namespace: {text!r}: expected letters, digits and underscores, such as robot1")
    return "/" + text.strip("/")


def remapping(namespace: str) -> tuple[str, ...]:
    """Return the ROS arguments that put a node into a namespace."""
    return ("-r", f"__ns:={namespace}") if namespace else ()
