"""The ablation: what all jobs need, a Hydra multirun over variants and seeds, and what comes of it."""

import json
import logging
from dataclasses import replace
from pathlib import Path

from vision_s2r import parallel, pipeline
from vision_s2r.ablation import job, picture
from vision_s2r.ablation.config import AblationStudyConfig, check
from vision_s2r.ablation.families import needed
from vision_s2r.ablation.summary import AblationSummary
from vision_s2r.cli import compose, log_to_terminal, run
from vision_s2r.files import write
from vision_s2r.progress import tracked

log = logging.getLogger(__name__)
NAME = "ablation"  # of the configuration, and of what is written


def ablate(arguments: list[str]) -> Path | None:
    """Run the ablation that these arguments describe, or go on with it; returns the picture.

    Hydra's own flags (--cfg job, --multirun with a sweep of one's own) go to Hydra as they are.
    """
    if any(argument.startswith("-") for argument in arguments):
        run(job.run, AblationStudyConfig, NAME, arguments)
        return None
    cfg = prepared(compose(AblationStudyConfig, NAME, arguments))
    if cfg.backend == "ray":
        every = [(each,) for seeds in job.jobs(cfg).values() for each in seeds]
        for _ in tracked(parallel.run(job.run, every, cfg.jobs, cfg.backend, ordered=False), len(every), "jobs"):
            pass
    else:
        run(job.run, AblationStudyConfig, NAME, ["--multirun", *arguments, *sweep(cfg)])
    return finish(cfg, " ".join(["vision-s2r ablate", *arguments]))


def prepared(cfg: AblationStudyConfig) -> AblationStudyConfig:
    """Render and train what all jobs share; cfg with a policy for each seed. Raises UserError as they do."""
    log_to_terminal()
    check(cfg.ablation, cfg.seeds)
    for first, *_ in job.jobs(cfg).values():
        job.changed(first)  # a mistake is said before hours of training
    pipeline.render_sets(cfg, *needed(cfg.ablation))
    return replace(cfg, ablation=replace(cfg.ablation, policy=cfg.ablation.policy or pipeline.canonical_policies(cfg)))


def sweep(cfg: AblationStudyConfig) -> list[str]:
    """Hydra's overrides: every selected variant with every seed."""
    jobs = job.jobs(cfg)
    log.info("%s: %d variants × %d seeds", cfg.out, len(jobs), cfg.seeds)
    seeds = range(cfg.seed, cfg.seed + cfg.seeds)
    return [
        f"ablation.policy={json.dumps(cfg.ablation.policy)}",
        f"ablation.variant={','.join(jobs)}",
        f"ablation.seed={','.join(map(str, seeds))}",
    ]


def finish(cfg: AblationStudyConfig, command: str) -> Path:
    """Write the tables (CSV, JSON) and the pictures of finished jobs; returns the path of the first of these.

    `command` is what a page of results says made them.
    """
    jobs, out = job.jobs(cfg), Path(cfg.out)
    summary = AblationSummary(cfg, {variant: [job.read(each) for each in seeds] for variant, seeds in jobs.items()})
    summary.write(out)
    write(out / "table.json", json.dumps(summary.published() | {"command": command}, indent=1) + "\n")
    if cfg.evaluate.strip:
        picture.side_by_side({variant: job.sheet(seeds[0]) for variant, seeds in jobs.items()}, out / "strip.png")
    return picture.draw(summary, out / f"{NAME}.png")
