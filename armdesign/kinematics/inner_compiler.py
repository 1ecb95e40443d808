"""Numba's compiler for kernels that only other kernels call: no machine code, which their entries make for them.

This relies on Numba's private interface, known to be the same from 0.61.2 to 0.68.1; see compilation for what happens
without it.
"""

from __future__ import annotations

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import NativeLowering


class InnerLibrary(JITCodeLibrary):
    """Code of an inner kernel, neither optimised across functions nor turned into machine code."""

    def _optimize_final_module(self) -> None:
        """Leave it to the entry."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class InnerLowering(NativeLowering):
    """Lowers an inner kernel and makes it known to its callers, without machine code."""

    _name = "inner_lowering"

    def run_pass(self, state: Any) -> bool:  # noqa: ANN401 (Numba's compiler state)
        """Lower; in place of machine code goes a built-in method, as Numba asks for, that says what is wrong."""
        state.flags.no_compile = True
        super().run_pass(state)
        entry_point = f"{{{state.func_id.func_name} can be called by other kernels only}}".format
        state.targetctx.insert_user_function(entry_point, state.cr.fndesc, [state["library"]])
        state.cr = state.cr._replace(cfunc=entry_point)
        return True


class InnerCompiler(CompilerBase):
    """Numba's compiler with InnerLowering in place of its lowering."""

    def define_pipelines(self) -> list[PassManager]:
        """Passes of an inner kernel."""
        state = self.state
        state["library"] = InnerLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        pipeline = PassManager("inner kernel")
        for kind, text in DefaultPassBuilder.define_nopython_pipeline(state).passes:
            pipeline.add_pass(InnerLowering if kind is NativeLowering else kind, text)
        pipeline.finalize()
        return [pipeline]


UNCOUNTED: dict[str, Any] = {"_nrt": False}
"""Kernels that allocate nothing do without reference counts, which are atomic operations."""
INNER_OPTIONS: dict[str, Any] = {"no_cpython_wrapper": True, "pipeline_class": InnerCompiler, **UNCOUNTED}
