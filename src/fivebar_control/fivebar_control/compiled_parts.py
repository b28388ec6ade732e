# SPDX-License-Identifier: Apache-2.0
"""Functions that only compiled functions call: they get no machine code of their own, which saves a fifth of the time.

numba makes machine code of every function, and of all that it calls, at each level of calls again. A part is linked
into what calls it as it is, and optimised there, once.
"""

from __future__ import annotations

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering


class _Part(JITCodeLibrary):
    """The code of a part with that of its callees, to be linked."""

    @property
    def codegen(self) -> Any:
        return _WithoutEnvironment(self._codegen)

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return that there is no such function for Python, as in other code without a wrapper."""
        self._ensure_finalized()
        return 0


class _WithoutEnvironment:
    """The code generator, which looks for no place of a part's environment: that is in its callers' machine code."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, name: str, environment: Any) -> None:
        """Do nothing: only errors with messages and objects of Python, which no part has, would need it."""


@register_pass(mutates_CFG=True, analysis_only=False)
class _PartLowering(NativeLowering):
    """The last pass, into a library that is not finished."""

    _name = "part_lowering"

    def run_pass(self, state: Any) -> bool:
        state.library = _Part(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return bool(super().run_pass(state))


class PartCompiler(CompilerBase):
    """numba's own passes but for the last one."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.passes = [
            (_PartLowering if compiler_pass is NativeLowering else compiler_pass, text)
            for compiler_pass, text in passes.passes
        ]
        passes.finalize()
        return [passes]
