"""Another recording through the simulator before and after a diagnosis: `recording=DIR report=FILE out=DIR`."""

from vision_s2r.cli import main
from vision_s2r.diagnose.replay import ReplayConfig, replay_all

if __name__ == "__main__":
    main(lambda cfg: [print(f"replay: {path}") for path in replay_all(cfg)], ReplayConfig, "replay")
