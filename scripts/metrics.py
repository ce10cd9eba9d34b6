"""What translations do to content, and which metric foretells success: `tables='[DIR, …]' out=DIR`."""

from vision_s2r.cli import main
from vision_s2r.metrics import MetricsConfig, metrics

if __name__ == "__main__":
    main(metrics, MetricsConfig, "metrics")
