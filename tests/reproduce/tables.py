"""A small table, and outcomes for it."""

from pathlib import Path

from imop.reproduce.published import Published
from imop.reproduce.table import Row, SuiteSection, Table

LEARNED, REPLAY = Row("learned", "learned"), Row("replay", "replay")
ABSENT = Row("elsewhere", "learned", Path("no/such/folder"), "make it so")
UNKNOWN = Row("unknown", "no_such_method")
PUBLISHED = (
    Published("better", 70.0, 1.0, {"open_drawer": 80, "stack_cubes": 60}),
    Published("worse", 30.0, 2.0, {"open_drawer": 20, "stack_cubes": 40}),
)
SECTION = SuiteSection(
    "Tabletop", (LEARNED, REPLAY, ABSENT, UNKNOWN), PUBLISHED, suite="tabletop", split="base"
)
TABLE = Table("small", "A small table", (SECTION,), ("A note.",), episodes=4)
