"""Reports for tests, as the contract has them."""

from vision_s2r.report.reading import library


def a_report(kind, **effects):
    """A report that names these effects, each parameter with an interval of ±1 %."""
    effects_of = library(kind)
    named = [
        {
            "name": name,
            "source": effects_of[name].source,
            "share": 0.9 / len(effects),
            "ci": [0.8 / len(effects), 1.0 / len(effects)],
            "evidence": 120.0,
            "parameters": {
                key: {
                    "value": value,
                    "unit": effects_of[name].parameter(key).unit,
                    "ci": sorted([0.99 * value, 1.01 * value]),
                }
                for key, value in given.items()
            },
        }
        for name, given in effects.items()
    ]
    return {
        "format": "vision-s2r/report/1",
        "kind": kind,
        "verdict": "explained" if effects else "no_gap",
        "gap": {
            "metric": "velocity_rmse",
            "unit": "rad/s",
            "before": 0.61,
            "after": 0.0052,
            "floor": 0.005,
            "shrink": 0.998,
            "shrink_ci": [0.997, 0.999],
        },
        "sources": [{"source": each["source"], "share": each["share"], "ci": each["ci"]} for each in named],
        "where": [{"axis": "speed", "at": "|θ̇| < 0.4 rad/s", "share": 0.71, "ci": [0.6, 0.8]}],
        "effects": named,
        "candidates": [
            {
                "name": effect.name,
                "status": "present" if effect.name in effects else "absent",
                "evidence": 120.0 if effect.name in effects else -1.2,
                "confusable_with": [],
            }
            for effect in effects_of
        ],
        "alternatives": [],
        "unexplained": {"share": 0.01, "ci": [0.0, 0.02], "where": []},
        "next_experiment": "",
    }
