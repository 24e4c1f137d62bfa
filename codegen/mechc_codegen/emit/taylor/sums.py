"""The sums over lower orders that Taylor coefficients are made of, in C over ``real``.

Input: pairs of places in a row, with the number of the sum of their products.  Output: the
functions of ``scene_series.h`` that add them up.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping

from mechc_codegen.emit.definition import definition

Pair = tuple[int, int]
_BLOCK = 16  # sums that run side by side
_FEW = 4  # sums that are added up one by one: see runtime/series/few_sums.h
_CORE_TERMS = (
    "for (int j = 3; j < order - 2; j++) {",
    "    const real *one = rows + j * MECHC_SERIES;",
    "    const real *other = rows + (order - j) * MECHC_SERIES;",
)
_TERMS = (
    "for (int n = 2; n <= order; n++) {",
    "    const int j = n < order - 1 ? n : n < order ? 1 : order - 1;",
    "    const real *one = rows + j * MECHC_SERIES;",
    "    const real *other = rows + (order - j) * MECHC_SERIES;",
)


def are_few(sums: Mapping[Pair, int]) -> bool:
    """Whether there are so few sums that two orders are added up together."""
    return len(sums) <= _FEW


def sums_text(sums: Mapping[Pair, int], last: Collection[int] | None) -> list[str]:
    """The functions that compute sums; ``last``: sums that the last order needs, None for all."""
    if are_few(sums):
        return [_cores(sums), _ending(sums)]
    texts = [_sum_function("series_sums", "Sums over lower orders.", [*sums.items()])]
    if last is not None:
        few = [each for each in sums.items() if each[1] in last]
        texts.append(_sum_function("series_last_sums", "Those that give M u.", few))
    return [*texts, _packing(sums), _ending(sums)]


def arrange(sums: Mapping[Pair, int]) -> dict[Pair, int]:
    """Sort the pairs so that those with a common series are adjacent, with it on the left."""
    left = set(sums)
    ordered = list[Pair]()
    while left:
        shared = Counter(place for pair in left for place in set(pair))
        most = max(shared, key=lambda place: (shared[place], -place))
        found = sorted(pair for pair in left if most in pair)
        ordered += [(most, b if a == most else a) for a, b in found]
        left.difference_update(found)
    numbers = {tuple(sorted(pair)): n for pair, n in sums.items()}
    return {pair: numbers[tuple(sorted(pair))] for pair in ordered}


def _sum_function(name: str, comment: str, ordered: list[tuple[Pair, int]]) -> str:
    """The C function that computes all sums of one order, block by block."""
    lines = list[str]()
    for first in range(0, len(ordered), _BLOCK):
        lines += _block(ordered[first : first + _BLOCK])
    return _function(name, "int order, const real *rows, real *sums", comment, lines)


def _block(block: list[tuple[Pair, int]]) -> list[str]:
    """C lines for several sums at once; a right factor used more than once is loaded once."""
    uses = Counter(b for (_, b), _ in block)
    held = [b for b, count in uses.items() if count > 1]
    names = {b: f"b{b}" if b in held else f"other[{b}]" for b in uses}
    lines = [f"    real s{place} = R(0.0);" for _, place in block]
    lines += [f"    {line}" for line in _TERMS]
    for b in held:
        lines += [f"        real b{b} = other[{b}];", f"        MECHC_HOLD(b{b});"]
    lines += [f"        s{n} = R_FMA(one[{a}], {names[b]}, s{n});" for (a, b), n in block]
    lines.append("    }")
    lines += [f"    sums[{place}] = s{place};" for _, place in block]
    return ["{", *lines, "}"]


def _cores(sums: Mapping[Pair, int]) -> str:
    """The C function for two consecutive orders, which share all factors but those of one row."""
    return _function(
        "series_cores", "int order, const real *rows, real *cores, real *next",
        "Sums over lower orders without the first two and the last two.",
        list(_core_lines(sums)) if sums else [],
    )  # fmt: skip


def _core_lines(sums: Mapping[Pair, int]) -> Iterator[str]:
    """Lines of that function; each right factor is used for two orders while it is loaded."""
    right = sorted({b for _, b in sums})
    yield "const real *last = rows + (order - 2) * MECHC_SERIES;"
    yield from (f"real s{n} = R(0.0), t{n} = R(0.0);" for n in sums.values())
    yield from (f"real b{b} = last[{b}];" for b in right)
    yield from _CORE_TERMS
    yield from (f"    t{n} = R_FMA(one[{a}], b{b}, t{n});" for (a, b), n in sums.items())
    yield from (f"    b{b} = other[{b}];" for b in right)
    yield from (f"    s{n} = R_FMA(one[{a}], b{b}, s{n});" for (a, b), n in sums.items())
    yield "}"
    yield from (f"cores[{n}] = s{n};" for n in sums.values())
    yield from (f"next[{n}] = R_FMA(last[{a}], b{b}, t{n});" for (a, b), n in sums.items())


def _ending(sums: Mapping[Pair, int]) -> str:
    lines = []
    for (a, b), n in sums.items():
        inner = f"R_FMA(early[{a}], last[{b}], middle[{n}])"
        lines.append(f"sums[{n}] = R_FMA(last[{a}], first[{b}], {inner});")
    return _function(
        "series_ends", "const real *middle, const real *early, const real *first, "
        "const real *last, real *sums", "Products of two rows added to the sums.", lines,
    )  # fmt: skip


def _packing(sums: Mapping[Pair, int]) -> str:
    pairs = sorted(sums, key=sums.__getitem__)
    lines = list[str]()
    for side, name in enumerate(("left", "right")):
        for first in range(0, len(pairs), 8):
            places = [pair[side] for pair in pairs[first : first + 8]]
            values = ", ".join(f"row[{n}]" for n in places + places[-1:] * (8 - len(places)))
            lines.append(f"MECHC_SPREAD({values}, {name} + {first});")
    text = _function(
        "series_spread", "const real *row, real *left, real *right",
        "What each sum multiplies, side by side.", lines,
    )  # fmt: skip
    return f"#if !R_VECTOR\n{text}#endif\n"


def _function(name: str, signature: str, comment: str, body: list[str]) -> str:
    return definition(comment, name, signature, body, "MECHC_INLINE")
