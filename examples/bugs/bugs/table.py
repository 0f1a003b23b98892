"""What records say about strategies: the table, as text, CSV and JSON.

A number is a mean over seeds; where a row is about several cases, it is the sum of their means (causes) or the mean of
their means (everything else). Intervals are 95 % percentile bootstrap intervals over seeds.
"""

import csv
import io
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from random import Random
from statistics import fmean, median

from bugs.campaign import Record
from bugs.case import MOST_OPERATIONS, Case, Cause

RESAMPLES = 2000

Interval = tuple[float, float]


@dataclass(frozen=True)
class Row:
    """A strategy on a case, or on all cases."""

    strategy: str
    case: str  # "all" for all of them
    seeds: int  # the fewest of any case
    true_causes: int
    early: int  # tests of the early budget
    tests: int
    causes_early: float
    causes_early_interval: Interval
    causes: float
    causes_interval: Interval
    named_early: float  # true causes that the tests bear out
    named_early_interval: Interval
    named: float
    named_interval: Interval
    any_early: float  # share of searches with a violation
    any: float
    first: float  # first violating test; `tests + 1` for a search without any
    first_interval: Interval
    first_median: float  # of all searches
    without_effect: float  # share of tests
    precision: float | None  # share of the causes that tests bear out; `None` if they bear out none
    precision_interval: Interval | None
    unlisted: float  # causes of few operations by the judge that contain no true one
    differing: int  # tests whose recorded values differ from the judge's
    named_otherwise: int  # causes that only the real program names, or does not name


def rows(records: Sequence[Record], cases: Sequence[Case], early: int) -> list[Row]:
    """Per strategy, in the order of the records: a row for all cases, then one for each. Strategies that lack a case
    have no row for all of them."""
    result = []
    for strategy in dict.fromkeys(record.strategy for record in records):
        of_case = [
            (case, [each for each in records if each.strategy == strategy and each.case == case.name]) for case in cases
        ]
        present = [(case, some) for case, some in of_case if some]
        if len(present) == len(cases) > 1:
            result.append(_row(strategy, "all", present, early))
        result += [_row(strategy, case.name, [(case, some)], early) for case, some in present]
    return result


def _row(strategy: str, name: str, groups: list[tuple[Case, list[Record]]], early: int) -> Row:
    tests = groups[0][1][0].tests
    known = {case.name: case.true_causes for case, _ in groups}

    def causes_by(budget: int) -> Callable[[Record], float]:
        return lambda record: len(record.found_by(budget) & known[record.case])

    def named_by(budget: int) -> Callable[[Record], float]:
        return lambda record: len(record.named_by(budget) & known[record.case])

    def any_by(budget: int) -> Callable[[Record], float]:
        return lambda record: bool(record.violating and record.violating[0] <= budget)

    def first(record: Record) -> float:
        return record.violating[0] if record.violating else tests + 1

    def precision(record: Record) -> float | None:
        named = record.named_by(tests)
        return fmean(_is_right(each, known[record.case]) for each in named) if named else None

    def unlisted(record: Record) -> float:
        listed = known[record.case]
        found = [each for each in record.found_by(tests) if len(each.operations) <= MOST_OPERATIONS]
        return sum(not any(each.contains(one) for one in listed) for each in found)

    samples = [some for _, some in groups]
    precise = [[record for record in some if precision(record) is not None] for some in samples]
    precise = [some for some in precise if some]
    return Row(
        strategy=strategy,
        case=name,
        seeds=min(map(len, samples)),
        true_causes=sum(map(len, known.values())),
        early=early,
        tests=tests,
        causes_early=sum(_means(samples, causes_by(early))),
        causes_early_interval=bootstrap(samples, causes_by(early), sum),
        causes=sum(_means(samples, causes_by(tests))),
        causes_interval=bootstrap(samples, causes_by(tests), sum),
        named_early=sum(_means(samples, named_by(early))),
        named_early_interval=bootstrap(samples, named_by(early), sum),
        named=sum(_means(samples, named_by(tests))),
        named_interval=bootstrap(samples, named_by(tests), sum),
        any_early=fmean(_means(samples, any_by(early))),
        any=fmean(_means(samples, any_by(tests))),
        first=fmean(_means(samples, first)),
        first_interval=bootstrap(samples, first, fmean),
        first_median=median(first(record) for some in samples for record in some),
        without_effect=fmean(_means(samples, lambda record: len(record.without_effect) / tests)),
        precision=fmean(_means(precise, precision)) if precise else None,
        precision_interval=bootstrap(precise, precision, fmean) if precise else None,
        unlisted=sum(_means(samples, unlisted)),
        differing=sum(len(record.differing) for some in samples for record in some),
        named_otherwise=sum(len(record.named_otherwise) for some in samples for record in some),
    )


def _is_right(named: Cause, known: set[Cause]) -> bool:
    """Whether a cause that tests bear out is true. Of many operations none is listed, but it must not hold a true one:
    that some of its operations were needed in one test does not make it smallest."""
    if len(named.operations) <= MOST_OPERATIONS:
        return named in known
    return not any(named.contains(one) for one in known)


def _means(samples: list[list[Record]], value: Callable[[Record], float]) -> list[float]:
    return [fmean(value(record) for record in some) for some in samples]


def bootstrap(
    samples: list[list[Record]], value: Callable[[Record], float], join: Callable[[list[float]], float]
) -> Interval:
    """The 95 % percentile interval of the joined means, with the seeds of each case drawn again independently."""
    luck = Random(1)
    values = [[value(record) for record in some] for some in samples]
    means = sorted(join([fmean(luck.choices(some, k=len(some))) for some in values]) for _ in range(RESAMPLES))
    return means[round(0.025 * (RESAMPLES - 1))], means[round(0.975 * (RESAMPLES - 1))]


def as_text(table: list[Row], cases: Sequence[Case]) -> str:
    """A table of strategies over all cases, and one of cases with a column per strategy."""
    if not table:
        return "There are no results."
    overall = [row for row in table if row.case == "all"] or table
    early, tests = table[0].early, table[0].tests
    head = [
        "strategy", f"causes by {early}", f"causes by {tests}", f"named by {early}", f"named by {tests}",
        f"any by {early}", f"any by {tests}", "first violation", "no effect", "precision",
    ]  # fmt: skip
    lines = [[_subject(row), *_cells(row)] for row in overall]
    parts = [_heading(overall, cases), _aligned([head, *lines])]
    by_case = [row for row in table if row.case != "all"]
    if len(cases) > 1:
        parts.append(f"Causes found by test {early} / by test {tests}, and the mean first violation:")
        parts.append(_aligned(_per_case(by_case, cases)))
    notes = [note for row in overall for note in _notes(row)]
    return "\n\n".join([*parts, *(["\n".join(notes)] if notes else [])])


def as_text_of_problems(table: list[Row], problems: Sequence[Case]) -> str:
    """A table of problems with a row per strategy; their causes are not counted."""
    if not table:
        return "There are no results."
    early, tests = table[0].early, table[0].tests
    lines = [["problem", "strategy", f"any by {early}", f"any by {tests}", "first violation", "no effect"]]
    for problem in problems:
        for row in (row for row in table if row.case == problem.name):
            any_ = f"{row.any_early:.0%}", f"{row.any:.0%}"
            lines.append([problem.name, row.strategy, *any_, _median(row), f"{row.without_effect:.0%}"])
    seeds = _seeds([row for row in table if row.case != "all"])
    notes = [note for row in table if row.case != "all" for note in _notes(replace(row, unlisted=0.0))]
    parts = [f"{len(problems)} {'problem' if len(problems) == 1 else 'problems'}, {seeds} seeds", _aligned(lines)]
    return "\n\n".join([*parts, *(["\n".join(notes)] if notes else [])])


def _median(row: Row) -> str:
    return f"{row.first_median:g}" if row.first_median <= row.tests else "none"


def _heading(overall: list[Row], cases: Sequence[Case]) -> str:
    causes = sum(len(case.true_causes) for case in cases)
    return f"{len(cases)} {'case' if len(cases) == 1 else 'cases'} with {causes} true causes, {_seeds(overall)} seeds"


def _seeds(table: list[Row]) -> str:
    seeds = sorted({row.seeds for row in table})
    return str(seeds[0]) if len(seeds) == 1 else f"{seeds[0]} to {seeds[-1]}"


def _subject(row: Row) -> str:
    return row.strategy if row.case == "all" else f"{row.strategy} on {row.case}"


def _cells(row: Row) -> list[str]:
    precision = "–" if row.precision is None else f"{row.precision:.0%} {_percent(row.precision_interval)}"
    return [
        f"{row.causes_early:.1f} {_numbers(row.causes_early_interval)}",
        f"{row.causes:.1f} {_numbers(row.causes_interval)}",
        f"{row.named_early:.1f} {_numbers(row.named_early_interval)}",
        f"{row.named:.1f} {_numbers(row.named_interval)}",
        f"{row.any_early:.0%}",
        f"{row.any:.0%}",
        f"{row.first:.1f} {_numbers(row.first_interval)}",
        f"{row.without_effect:.0%}",
        precision,
    ]


def _numbers(interval: Interval) -> str:
    return f"[{interval[0]:.1f}, {interval[1]:.1f}]"


def _percent(interval: Interval) -> str:
    return f"[{interval[0]:.0%}, {interval[1]:.0%}]"


def _per_case(table: list[Row], cases: Sequence[Case]) -> list[list[str]]:
    strategies = list(dict.fromkeys(row.strategy for row in table))
    lines = [["case", "true", *strategies]]
    for case in cases:
        of_strategy = {row.strategy: row for row in table if row.case == case.name}
        cells = [_short(of_strategy[each]) if each in of_strategy else "" for each in strategies]
        lines.append([case.name, str(len(case.true_causes)), *cells])
    return lines


def _short(row: Row) -> str:
    return f"{row.causes_early:.1f} / {row.causes:.1f}, {row.first:.0f}"


def _notes(row: Row) -> list[str]:
    notes = []
    if row.unlisted:
        notes.append(
            f"{_subject(row)}: {row.unlisted:.2f} causes per search that no case.toml lists; `explore.py` shows them."
        )
    if row.differing:
        notes.append(f"{_subject(row)}: in {row.differing} tests, recorded values differ from those of the judge.")
    if row.named_otherwise:
        otherwise = f"{row.named_otherwise} causes are named by the program or by its tests, not by both"
        notes.append(f"{_subject(row)}: {otherwise}.")
    return notes


def _aligned(lines: list[list[str]]) -> str:
    widths = [max(len(line[column]) for line in lines) for column in range(len(lines[0]))]
    padded = ([cell.ljust(width) for cell, width in zip(line, widths)] for line in lines)
    return "\n".join("  ".join(line).rstrip() for line in padded)


def as_json(table: list[Row]) -> str:
    """A list with an object per row; fields are those of `Row`."""
    return json.dumps([asdict(row) for row in table], indent=2) + "\n"


def as_csv(table: list[Row]) -> str:
    """A line per row; an interval is two columns, `…_low` and `…_high`."""
    text = io.StringIO()
    lines = [_flat(row) for row in table]
    writer = csv.DictWriter(text, fieldnames=list(lines[0]) if lines else [], lineterminator="\n")
    writer.writeheader()
    writer.writerows(lines)
    return text.getvalue()


def _flat(row: Row) -> dict[str, object]:
    flat: dict[str, object] = {}
    for name, value in asdict(row).items():
        if name.endswith("_interval"):
            low, high = value or (None, None)
            flat |= {name.replace("_interval", "_low"): low, name.replace("_interval", "_high"): high}
        else:
            flat[name] = value
    return flat
