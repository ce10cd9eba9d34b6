"""Score a benchmark: diagnose, open the answers, score."""

import sys
from collections import Counter
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from vision_s2r.errors import UserError
from vision_s2r.files import write
from vision_s2r.gapbench.config import COUNTS, GapbenchConfig
from vision_s2r.gapbench.files import commitment, read_json, write_json
from vision_s2r.gapbench.generate.generate import cases_of
from vision_s2r.gapbench.score import pictures
from vision_s2r.gapbench.score.diagnoses import run
from vision_s2r.gapbench.score.robot import score_robot, totals_of_robots
from vision_s2r.gapbench.score.score import Score, score
from vision_s2r.gapbench.score.table import markdown, published, totals


def score_all(cfg: GapbenchConfig) -> Path:
    """Diagnose every recording, then score: OUT/results.json, table.md and .json, confusion.png and estimates.png.

    Raises UserError where there is no benchmark, or an answer is not the one that was committed to.
    """
    out = Path(cfg.out)
    names = run(cfg)
    committed = read_json(out / "commitments.json")
    answers = opened(out, committed["commitments"])
    scores = [scored(out / "reports" / name, name, committed["kind"], answers[name]) for name in names]
    robots = committed["kind"] == "robot"
    rows = totals_of_robots(scores) if robots else totals(committed["kind"], scores)
    about = {key: value for key, value in committed.items() if key not in ("commitments", "withheld")}
    results = {
        **about,
        "totals": [asdict(row) for row in rows],
        "recordings": [asdict(each) for each in scores],
    }
    write_json(out / "results.json", results)
    title = f"gapbench, {committed['kind']}, {committed['set']} set, seed {committed['seed']}: {len(scores)} recordings"
    text = f"{title}\n\n{markdown(rows)}{_mistakes(scores)}"
    write(out / "table.md", text)
    write_json(out / "table.json", {"command": command(committed, cfg.limit), **published(rows)})
    pictures.save(pictures.confusion(scores), out / "confusion.png")
    pictures.save(pictures.estimates(scores), out / "estimates.png")
    print(text, file=sys.stderr)
    return out


def command(committed: dict[str, Any], limit: int) -> str:
    """The command line that draws and scores this benchmark."""
    drawn = {case: committed["counts"].get(case, 0) for case in cases_of(committed["kind"])}
    counts = " ".join(f"counts.{case}={count}" for case, count in drawn.items() if count != COUNTS[case])
    asked = ("kind", "set", "seed", "arms", "rate")
    about = " ".join(f"{key}={committed[key]}" for key in asked if key in committed)
    return f"vision-s2r gapbench {about} {counts}" + (f" limit={limit}" if limit else "")


def opened(out: Path, commitments: dict[str, str]) -> dict[str, Any]:
    """The withheld answers. Raises UserError unless each is what was committed to."""
    answers = read_json(out / "answers.json")
    for name, promised in commitments.items():
        entry = answers.get(name)
        if entry is None or commitment(entry["salt"], entry["answer"]) != promised:
            raise UserError(f"{out / 'answers.json'}: the answer to {name} is not the one that was committed to")
    return {name: entry["answer"] for name, entry in answers.items()}


def scored(folder: Path, name: str, kind: str, answer: dict[str, Any]) -> Score:
    """The score of the report in a folder."""
    ran = read_json(folder / "run.json")
    report = read_json(folder / "report.json") if ran["exit"] == 0 else None
    if kind == "robot":
        return score_robot(name, answer, report, ran["seconds"])
    return replace(score(name, kind, answer, report, ran["seconds"]), processor=ran.get("processor"))


def _mistakes(scores: list[Score]) -> str:
    """What was not exact, by case, for people."""
    lines = []
    for each in scores:
        wrong = each.failed or bool(each.false) or not each.verdict_right or not (each.exact or each.recognized)
        if wrong and not each.recognized:
            truth = " + ".join(each.expected) or each.unknown or "nothing"
            lines.append(f"- {each.id} {each.case}: {truth} → {each.verdict}, {' + '.join(each.named) or 'no name'}")
    if not lines:
        return ""
    cases = ", ".join(f"{case} {count}" for case, count in sorted(Counter(s.case for s in scores).items()))
    return f"\nMistakes among {cases}:\n\n" + "\n".join(sorted(lines, key=lambda line: line.split()[2])) + "\n"
