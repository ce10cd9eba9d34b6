"""Train a grasp policy on rendered views, or go on with it; `grasp=randomized` trains the baseline.

Keys: configs/grasp/crop.yaml.
"""

from pathlib import Path

from vision_s2r.cli import main
from vision_s2r.config import Config
from vision_s2r.grasp import train_policy
from vision_s2r.render import Views


def grasp(cfg: Config) -> None:
    """The policy of the first seed, in OUT/policy-SEED; one on randomized pictures in OUT/baseline-SEED."""
    train, validation = (Views.open(data.out) for data in (cfg.data.train, cfg.data.validation))
    role = "policy" if cfg.grasp.picture == "canonical" else "baseline"
    out = Path(cfg.out) / f"{role}-{cfg.seed}"
    print(train_policy(train, validation, cfg.grasp, cfg.camera, out, cfg.seed, cfg.validation_camera))


if __name__ == "__main__":
    main(grasp, Config)
