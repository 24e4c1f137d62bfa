"""Optimisation passes: each takes a program and returns one with the same values."""

from mechc_codegen.passes.choose import choose
from mechc_codegen.passes.collect import collect
from mechc_codegen.passes.drop import drop
from mechc_codegen.passes.eliminate import eliminate_common
from mechc_codegen.passes.fold import fold
from mechc_codegen.passes.hoist import hoist
from mechc_codegen.passes.pair import pair

__all__ = ["choose", "collect", "drop", "eliminate_common", "fold", "hoist", "pair"]
