"""The documentation is true where a machine can tell: links, lines, commands, and code."""

import ast
import builtins
import functools
import importlib
import inspect
import re
import shlex
import textwrap
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path

import pytest
import tyro

from imop import cli

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted([*ROOT.glob("*.md"), *DOCS.rglob("*.md")])
LONGEST = 110

# Names that the code of a page takes from its reader, and must use.
GIVEN = {
    "docs/real_robot/calibration.md": "MyArm MyCamera",
    "docs/real_robot/serving.md": "demonstration observation done robot MyPolicy"
    " rgb depth K T T_world_gripper q",
    "docs/real_robot/recording.md": "cameras moving robot",
    "docs/real_robot/setup.md": "robot cameras",
    "docs/real_robot/viewing.md": "setup robot cameras policy",
    "docs/your_own.md": "policy mask p_world",
}
# Pages whose code is run, all blocks of a page one after the other.
RUN = ("docs/five_minutes.md", "docs/concepts.md", "docs/data.md")
# Not ours, and not installed for the tests.
FOREIGN = ("openpi_client",)


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


each_page = pytest.mark.parametrize("page", PAGES, ids=name_of)


def blocks(page: Path) -> Iterator[tuple[str, str]]:
    """Language and text of every fenced or indented block of code."""
    text = page.read_text()
    for found in re.finditer(r"^( *)```[{.]*(\w*)[^\n]*\n(.*?)^ *```$", text, flags=re.DOTALL | re.MULTILINE):
        yield found[2], included(textwrap.dedent(found[3]))
    without = re.sub(r"^ *```.*?^ *```$", "", text, flags=re.DOTALL | re.MULTILINE)
    for found in re.finditer(r"(?<=\n\n)(?: {4}[^\n]*\n)+", without):
        yield "", textwrap.dedent(found[0])


def included(text: str) -> str:
    """The text with the files in it that the site includes."""
    return re.sub(r'^--8<-- "(.+)"$', lambda found: (ROOT / found[1]).read_text(), text, flags=re.MULTILINE)


def prose(page: Path) -> str:
    """The text without blocks of code."""
    return re.sub(r"^ *```.*?^ *```$", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)


@each_page
def test_no_line_is_longer_than_a_screen_is_wide(page):
    long = [f"{number}: {line}" for number, line in enumerate(page.read_text().splitlines(), 1)]
    assert [line for line in long if len(line.split(": ", 1)[1]) > LONGEST] == []


# --- links ------------------------------------------------------------------------------------------------


def slug(heading: str) -> str:
    """The anchor of a heading, as GitHub and mkdocs make it."""
    plain = re.sub(r"[`*]|\[([^\]]*)\]\([^)]*\)", r"\1", heading).strip().lower()
    return re.sub(r"[\s]+", "-", re.sub(r"[^\w\s-]", "", plain))


def anchors(page: Path) -> set[str]:
    return {slug(heading) for heading in re.findall(r"^#+ (.*)$", prose(page), flags=re.MULTILINE)}


@each_page
def test_links_lead_somewhere(page):
    for link in re.findall(r"\]\(([^)\s]+)\)", prose(page)):
        if re.match(r"\w+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), f"{name_of(page)}: {link}"
        if anchor:
            assert anchor in anchors(target), f"{name_of(page)}: {link} has no such heading"
        if DOCS in page.parents:
            assert DOCS in target.parents, f"{name_of(page)}: {link} is not part of the site"


# --- commands ---------------------------------------------------------------------------------------------


# Also after variables of the environment, or behind torchrun.
CALL = re.compile(r"^(?:\w+=(?:\$\(.*?\)|\S+) )*(?:(?:\S*/)?imop|.* -m imop\.cli) (.*)$")


def commands(page: Path) -> Iterator[list[str]]:
    """Words of the calls of imop in the blocks of a page, without comments."""
    for language, text in blocks(page):
        if language in ("", "sh"):
            for line in text.replace("\\\n", " ").splitlines():
                if called := CALL.match(line):
                    yield shlex.split(called[1], comments=True)


def registered(app) -> dict[str, Callable]:
    """The functions behind the commands of an app, by name; newer tyro keeps each in a record."""
    return {name: getattr(kept, "target", kept) for name, kept in app._subcommands.items()}


def every_command() -> dict[str, Callable]:
    """Command, or group and command -> its function."""
    found = {name: function for name, function in registered(cli.app).items() if name not in cli.GROUPS}
    for group in cli.GROUPS:
        for name, function in registered(import_module(f"imop.cli_{group}").app).items():
            found[f"{group} {name}"] = function
    return found


def parse(words: list[str]) -> None:
    """Read a command line as imop does, and do nothing; SystemExit if it does not fit."""
    length = 2 if words[0] in cli.GROUPS else 1
    function = every_command().get(" ".join(words[:length]))
    if function is None:
        raise SystemExit(f"there is no imop {' '.join(words[:length])}")

    @functools.wraps(function)
    def nothing(*_, **__):
        return None

    assert tyro.cli(nothing, args=words[length:], prog="imop", console_outputs=False) is None


@each_page
def test_commands_exist_and_take_these_options(page):
    for words in commands(page):
        try:
            parse(words)
        except SystemExit as error:
            pytest.fail(f"imop {shlex.join(words)}: {error}")


def test_commands_are_found():
    assert sum(1 for page in PAGES for _ in commands(page)) > 80


@pytest.mark.parametrize(
    "wrong", ["run --task a --colour red", "runs", "training genrate", "run --task a --seed one", "collect"]
)
def test_a_command_that_does_not_exist_or_fit_is_noticed(wrong):
    with pytest.raises(SystemExit):
        parse(wrong.split())


@each_page
def test_commands_in_sentences_exist(page):
    known = {*every_command(), "--help", *cli.GROUPS}
    for call in re.findall(r"`imop ([^`]+)`", prose(page)):
        words = call.split()
        named = words[0] if words[0] not in cli.GROUPS else " ".join(words[:2])
        assert named in known, f"{name_of(page)}: imop {call}"


@each_page
def test_scripts_and_files_that_are_named_exist(page):
    for script in re.findall(r"\b(?:benchmarks|examples|tests|\.ci)/[\w/]+\.\w+", page.read_text()):
        assert (ROOT / script).exists(), f"{name_of(page)}: {script}"


def test_the_list_of_folders_is_the_folders():
    text = (DOCS / "architecture.md").read_text()
    listed = set(re.findall(r"^\| `([\w/]+)/` \|", text, flags=re.MULTILINE))
    packages = {
        path.parent.relative_to(ROOT / "src/imop").as_posix()
        for path in ROOT.rglob("__init__.py")
        if ROOT / "src/imop" in path.parent.parents
    }
    assert listed == packages


def test_every_example_is_on_its_page():
    text = (DOCS / "examples.md").read_text()
    assert all(path.name in text for path in (ROOT / "examples").glob("*.py"))


# --- code -------------------------------------------------------------------------------------------------


def code(page: Path) -> list[str]:
    return [text for language, text in blocks(page) if language == "python"]


def with_code(names=None):
    pages = [page for page in PAGES if code(page) and (names is None or name_of(page) in names)]
    return pytest.mark.parametrize("page", pages, ids=name_of)


def test_no_code_hides_in_a_block_without_a_language():
    for page in PAGES:
        for language, text in blocks(page):
            assert language or not re.search(r"^(from|import) \w", text, flags=re.MULTILINE), (page, text)


def imported(tree: ast.AST) -> dict[str, object]:
    """What the import statements of a block bring, by name."""
    found: dict[str, object] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.split(".")[0] not in FOREIGN:
                    module = importlib.import_module(alias.name)
                    found[alias.asname or alias.name] = module
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] not in FOREIGN:
            module = importlib.import_module(node.module or "")
            for alias in node.names:
                found[alias.asname or alias.name] = getattr(module, alias.name)
    return found


def resolved(node: ast.AST, names: dict[str, object]) -> object | None:
    """The object that an expression such as `Class.method` names, if its root was imported."""
    if isinstance(node, ast.Name):
        return names.get(node.id)
    if isinstance(node, ast.Attribute):
        owner = resolved(node.value, names)
        return None if owner is None else getattr(owner, node.attr)
    return None


def bound(tree: ast.AST) -> set[str]:
    """Every name that a block makes."""
    made = {n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    made |= {n.name for n in ast.walk(tree) if isinstance(n, (ast.FunctionDef, ast.ClassDef))}
    made |= {n.arg for n in ast.walk(tree) if isinstance(n, ast.arg)}
    for node in ast.walk(tree):
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            made |= {(alias.asname or alias.name).split(".")[0] for alias in node.names}
    return made


@with_code()
def test_code_is_whole_and_what_it_calls_takes_these_arguments(page, monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "examples")
    names: dict[str, object] = {}
    made, used = set(dir(builtins)) | {"__name__"}, set()
    for text in code(page):
        tree = ast.parse(text)
        names |= imported(tree)
        made |= bound(tree)
        used |= {n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute):
                resolved(node, names)
            if isinstance(node, ast.Call):
                called = resolved(node.func, names)
                if getattr(called, "__module__", "").startswith("imop"):
                    inspect.signature(called).bind(*node.args, **{str(k.arg): None for k in node.keywords})
    given = set(GIVEN.get(name_of(page), "").split())
    assert used - made == given, f"{name_of(page)}: the reader does not have {sorted(used - made - given)}"


@with_code(RUN)
def test_the_code_runs(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    space = {"__name__": "__main__"}
    for text in code(page):
        exec(compile(text, name_of(page), "exec"), space)


def test_pictures_are_small():
    for picture in (p for p in DOCS.rglob("*") if p.suffix in (".png", ".webp", ".gif", ".jpg")):
        assert picture.stat().st_size < 150_000, name_of(picture)
