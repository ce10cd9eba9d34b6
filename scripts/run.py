"""The whole way: render, train, evaluate; goes on where it was interrupted. `experiment=demo|cpu|full|debug`."""

from vision_s2r.cli import main
from vision_s2r.config import Config
from vision_s2r.pipeline import run

if __name__ == "__main__":
    main(lambda cfg: print(f"transfer table: {run(cfg)}"), Config)
