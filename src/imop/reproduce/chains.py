"""Tasks made of others, against the product of their parts."""

from collections.abc import Sequence
from math import prod

from imop.reproduce.measured import MeasuredRow, MeasuredSection


def against_parts(sections: Sequence[MeasuredSection], parts: dict[str, list[str]]) -> list[str]:
    """For every chain and row whose parts were measured: success, and what its parts let one expect.

    Args:
        sections: in one of which stand the chains, in others their parts.
        parts: chain -> its parts, names without the suite.
    """
    sentences = []
    for label in dict.fromkeys(row.label for section in sections for row in section.rows):
        rates = _rates([row for section in sections for row in section.rows if row.label == label])
        for chain, of_chain in parts.items():
            if chain in rates and all(part in rates for part in of_chain):
                expected = prod(rates[part] for part in of_chain)
                share = f", {100 * rates[chain] / expected:.0f} % of it" if expected else ""
                found = f"{100 * rates[chain]:.0f} % where the product of its parts is {100 * expected:.0f} %"
                sentences.append(f"{label}, {chain}: {found}{share}.")
    return sentences


def _rates(rows: Sequence[MeasuredRow]) -> dict[str, float]:
    return {task: count.rate for row in rows for task, count in (row.counts or {}).items() if count.trials}
