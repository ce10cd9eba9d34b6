"""What README and docs show is so: their code runs, their commands compose, their tables are those of the data."""

import json
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest
import tables
import world
import yaml

from vision_s2r.appearance import PICTURE_EFFECTS
from vision_s2r.contact import CONTACT_EFFECTS
from vision_s2r.joint import JOINT_EFFECTS

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
FENCE = re.compile(r"^( *)```(\w+)([^\n]*)\n(.*?)^\1```$", re.MULTILINE | re.DOTALL)
INCLUDED = re.compile(r'^--8<-- "(.+)"$', re.MULTILINE)
IMAGE = re.compile(r"!\[[^]]*\]\(([^)]+)\)")
ELSEWHERE = {"git", "cd", "pip"}  # commands that are not ours to check


def blocks(page: Path, language: str) -> Iterator[str]:
    """The fenced blocks of a page that are written out in it."""
    for found in FENCE.finditer(page.read_text(encoding="utf-8")):
        if found[2] == language and not INCLUDED.search(found[4]):
            yield re.sub(f"^{found[1]}", "", found[4], flags=re.MULTILINE)


def named(language: str) -> list[object]:
    """Pages that have such blocks, to be tested one by one."""
    return [pytest.param(page, id=str(page.relative_to(ROOT))) for page in PAGES if any(blocks(page, language))]


@pytest.mark.parametrize("page", named("python"))
def test_python_runs_as_it_stands(page, worked, monkeypatch):
    monkeypatch.chdir(worked)
    space: dict[str, object] = {"__name__": "page"}
    for code in blocks(page, "python"):
        exec(compile(code, str(page), "exec"), space)


@pytest.mark.parametrize("page", named("bash"))
def test_commands_are_there_and_their_keys_compose(page):
    for code in blocks(page, "bash"):
        for line in code.replace("\\\n", " ").splitlines():
            words = shlex.split(line, comments=True)
            if words and words[0] not in ELSEWHERE:
                check(words)


def check(words: list[str]) -> None:
    """A command of this project: its verb is there, and its configuration composes."""
    if words[0] == "make":
        assert re.search(rf"^{words[1]}:", (ROOT / "Makefile").read_text(), re.MULTILINE), words
        return
    if words[0] == "python" and words[1].startswith("docs/"):
        assert all((ROOT / each).exists() for each in words[1:])
        return
    if words[0] == "python":  # a script is a door to the command of its name
        assert (ROOT / words[1]).exists(), words
        words = ["vision-s2r", Path(words[1]).stem.replace("_", "-"), *words[2:]]
    if words[0] == "torchrun":
        words = ["vision-s2r", *words[words.index("vision_s2r") + 1 :]]
    assert words[0] == "vision-s2r", words
    if "--multirun" in words:  # the first job of a sweep
        words = [re.sub(r"=(\w+),.*", r"=\1", word) for word in words if word != "--multirun"]
    world.compose(words[1:])


@pytest.mark.parametrize("page", named("yaml"))
def test_yaml_and_its_keys_are_right(page, tmp_path):
    for code in blocks(page, "yaml"):
        world.check_yaml(yaml.safe_load(code), code, tmp_path)


@pytest.mark.parametrize("page", named("json"))
def test_json_parses(page):
    assert all(json.loads(code) for code in blocks(page, "json"))


def test_tables_and_pictures_are_there():
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for asked in tables.ASKED.finditer(text):
            assert tables.table(*asked.groups()).count("\n") > 1, (page, asked[0])
        for picture in IMAGE.findall(text):
            assert (ROOT / "renders" / Path(picture).name).exists(), (page, picture)


def test_tables_are_of_runs():
    for path in sorted(tables.DATA.glob("*.json")):
        data = json.loads(path.read_text(encoding="utf-8"))
        assert data["command"].startswith(("vision-s2r ", "python -m vision_s2r.")), path.name
        assert "transcribed" not in data.get("source", ""), path.name


def test_the_readme_holds_the_tables_of_the_data():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert tables.refilled(readme) == readme, "python docs/hooks/tables.py README.md writes them anew"


def test_every_effect_is_in_the_vocabulary():
    page = (ROOT / "docs" / "formats" / "effects.md").read_text(encoding="utf-8")
    listed = {name for line in page.splitlines() if line.startswith("| ") for name in line.split("|")[2].split(", ")}
    listed = {name.strip() for name in listed}
    there = {effect.name for registry in (PICTURE_EFFECTS, CONTACT_EFFECTS, JOINT_EFFECTS) for effect in registry}
    assert there <= listed, sorted(there - listed)


@pytest.mark.parametrize("page", ["README.md", "docs/concepts/architecture.md"])
def test_every_room_has_a_line(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    rooms = {path.name for path in (ROOT / "vision_s2r").iterdir() if path.is_dir() and any(path.rglob("*.py"))}
    assert not {room for room in rooms if f"`{room}/`" not in text}
