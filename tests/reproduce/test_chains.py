from imop.evaluation.report import Count
from imop.reproduce.chains import against_parts
from imop.reproduce.measured import MeasuredRow, MeasuredSection

PARTS = {"chain": ["one", "two"]}


def sections(**counts):
    rows = (MeasuredRow("learned", "learned", counts=counts), MeasuredRow("absent", "m", missing="no"))
    return [MeasuredSection("s", tuple(counts), (), rows, ())]


def test_a_chain_is_compared_with_the_product_of_its_parts():
    (said,) = against_parts(sections(chain=Count(3, 10), one=Count(1, 2), two=Count(4, 5)), PARTS)
    assert said == "learned, chain: 30 % where the product of its parts is 40 %, 75 % of it."


def test_a_part_that_is_missing_or_never_succeeds_gives_no_share():
    assert against_parts(sections(chain=Count(3, 10), one=Count(1, 2)), PARTS) == []
    (said,) = against_parts(sections(chain=Count(0, 10), one=Count(0, 2), two=Count(4, 5)), PARTS)
    assert said.endswith("is 0 %.")
