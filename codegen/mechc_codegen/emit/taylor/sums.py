"""The sums over lower orders that Taylor coefficients are made of, in C over ``real``.

Input: pairs of places in a row, with the number of the sum of their products.  Output: the
functions of ``scene_series.h`` that add them up.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping

from mechc_codegen.emit.definition import definition
from mechc_codegen.emit.expressions import Line, Value, block, call, do, fma, let, named, put, real

Pair = tuple[int, int]
_BLOCK = 16  # sums that run side by side
_FEW = 4  # sums that are added up one by one: see runtime/series/few_sums.h
_CORE_TERMS = "for (int j = 3; j < order - 2; j++)"
_TERMS = "for (int n = 2; n <= order; n++)"
_PLACE = "const int j = n < order - 1 ? n : n < order ? 1 : order - 1;"
_ROWS = (
    "const real *one = rows + j * MECHC_SERIES;",
    "const real *other = rows + (order - j) * MECHC_SERIES;",
)
_ONE, _OTHER, _LAST, _SUMS = map(named, ("one", "other", "last", "sums"))


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
    firsts = range(0, len(ordered), _BLOCK)
    lines = [block("", _block(ordered[first : first + _BLOCK])) for first in firsts]
    return definition(comment, name, "int order, const real *rows, real *sums", lines)


def _block(sums: list[tuple[Pair, int]]) -> Iterator[Line]:
    """Several sums at once; a right factor used more than once is loaded once."""
    uses = Counter(b for (_, b), _ in sums)
    held = [b for b, count in uses.items() if count > 1]
    right = {b: named(f"b{b}") if b in held else _OTHER[b] for b in uses}
    terms = [Line((_PLACE, *_ROWS))]
    for b in held:
        terms += [let(f"b{b}", _OTHER[b], "real"), do(call("MECHC_HOLD", right[b]))]
    yield from (let(f"s{n}", real(0.0), "real") for _, n in sums)
    yield block(_TERMS, [*terms, *(_add(f"s{n}", _ONE[a], right[b]) for (a, b), n in sums)])
    yield from (put(_SUMS[n], named(f"s{n}")) for _, n in sums)


def _add(target: str, one: Value, other: Value) -> Line:
    return put(named(target), fma(one, other, named(target)))


def _cores(sums: Mapping[Pair, int]) -> str:
    """The C function for two consecutive orders, which share all factors but those of one row."""
    return definition(
        "Sums over lower orders without the first two and the last two.", "series_cores",
        "int order, const real *rows, real *cores, real *next", _core_lines(sums) if sums else (),
    )  # fmt: skip


def _core_lines(sums: Mapping[Pair, int]) -> Iterator[Line]:
    """Lines of that function; each right factor is used for two orders while it is loaded."""
    right = {b: named(f"b{b}") for b in sorted({b for _, b in sums})}
    yield Line(("const real *last = rows + (order - 2) * MECHC_SERIES;",))
    yield from (let(f"{each}{n}", real(0.0), "real") for n in sums.values() for each in "st")
    yield from (let(f"b{b}", _LAST[b], "real") for b in right)
    terms = [Line(_ROWS), *(_add(f"t{n}", _ONE[a], right[b]) for (a, b), n in sums.items())]
    terms += [put(value, _OTHER[b]) for b, value in right.items()]
    terms += [_add(f"s{n}", _ONE[a], right[b]) for (a, b), n in sums.items()]
    yield block(_CORE_TERMS, terms)
    yield from (put(named("cores")[n], named(f"s{n}")) for n in sums.values())
    for (a, b), n in sums.items():
        yield put(named("next")[n], fma(_LAST[a], right[b], named(f"t{n}")))


def _ending(sums: Mapping[Pair, int]) -> str:
    first, early, middle = map(named, ("first", "early", "middle"))
    lines = list[Line]()
    for (a, b), n in sums.items():
        lines.append(put(_SUMS[n], fma(_LAST[a], first[b], fma(early[a], _LAST[b], middle[n]))))
    return definition(
        "Products of two rows added to the sums.", "series_ends",
        "const real *middle, const real *early, const real *first, const real *last, real *sums",
        lines,
    )  # fmt: skip


def _packing(sums: Mapping[Pair, int]) -> str:
    pairs, row = sorted(sums, key=sums.__getitem__), named("row")
    lines = list[Line]()
    for side, name in enumerate(("left", "right")):
        for first in range(0, len(pairs), 8):
            places = [pair[side] for pair in pairs[first : first + 8]]
            values = [row[n] for n in places + places[-1:] * (8 - len(places))]
            lines.append(do(call("MECHC_SPREAD", *values, named(name) + first)))
    text = definition(
        "What each sum multiplies, side by side.", "series_spread",
        "const real *row, real *left, real *right", lines,
    )  # fmt: skip
    return f"#if !R_VECTOR\n{text}#endif\n"
