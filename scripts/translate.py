"""Train a translator on rendered views, or go on with it. Keys: configs/translate/rcan.yaml."""

from pathlib import Path

from vision_s2r.cli import main
from vision_s2r.config import Config
from vision_s2r.render import Views
from vision_s2r.translate import train_translator


def translate(cfg: Config) -> None:
    """The translator of the first seed, in OUT/translator-SEED."""
    train, validation = (Views.open(data.out) for data in (cfg.data.train, cfg.data.validation))
    out = Path(cfg.out) / f"translator-{cfg.seed}"
    best = train_translator(train, validation, cfg.translate, cfg.camera, cfg.validation_camera, out, cfg.seed)
    print(best)


if __name__ == "__main__":
    main(translate, Config)
