"""How this Python interpreter is started with a module, without modules of the working directory in its way."""

from __future__ import annotations

import sys

RUN_MODULE = "import sys; del sys.path[0]; import runpy; runpy.run_module({!r}, run_name='__main__', alter_sys=True)"
"""What `python -P -m` does, in words that Python 3.10 understands, too."""


def module_command(module: str) -> list[str]:
    """Return the command that runs a module as `python -m` does, but never imports a json.py of the user's."""
    safe = hasattr(sys.flags, "safe_path")
    return [sys.executable, "-P", "-m", module] if safe else [sys.executable, "-c", RUN_MODULE.format(module)]
