"""Optimisation passes: each takes a program and returns one with the same values."""

from mechc_codegen.ir.passes.choose import choose
from mechc_codegen.ir.passes.collect import collect
from mechc_codegen.ir.passes.drop import drop
from mechc_codegen.ir.passes.eliminate import eliminate_common
from mechc_codegen.ir.passes.hoist import hoist
from mechc_codegen.ir.passes.pair import pair

__all__ = ["choose", "collect", "drop", "eliminate_common", "hoist", "pair"]
