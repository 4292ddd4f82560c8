import re
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_the_twenty_lines_run_and_succeed(capsys):
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), flags=re.DOTALL)
    assert len(code.strip().splitlines()) <= 22
    exec(compile(code, "README.md", "exec"), {})
    assert capsys.readouterr().out.endswith("success\n")
