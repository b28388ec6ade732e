# SPDX-License-Identifier: Apache-2.0
"""The commands of this package; each module adds its own when it is imported."""

from importlib import import_module

for module in ("assess", "estimate", "reproduce", "compare", "sweep", "robustness", "benchmark"):
    import_module(f"{__name__}.{module}")
