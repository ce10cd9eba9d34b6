"""Released networks as ONNX files, checked against torch before they are written."""

import io
import json
import logging
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import torch

from vision_s2r import files
from vision_s2r.errors import UserError
from vision_s2r.export import graphs
from vision_s2r.export.card import card
from vision_s2r.export.config import ExportConfig
from vision_s2r.export.graphs import Graph

log = logging.getLogger(__name__)

PACKAGES = ("onnx", "onnxscript", "onnxruntime")
PARITY = 1e-4  # largest difference from torch's outputs, at other batch sizes than the graph was traced with
TRACED, CHECKED = {"batch": 2, "grasps": 3}, ({"batch": 1, "grasps": 64}, {"batch": 5, "grasps": 2})


def export_translator(cfg: ExportConfig) -> Path:
    """Write translator.onnx, .json and .md; returns the first. Raises UserError where the checkpoint is none."""
    return _export(graphs.translator, cfg, "translator")


def export_policy(cfg: ExportConfig) -> Path:
    """Write policy.onnx, .json and .md; returns the first. Raises UserError where the checkpoint is none."""
    return _export(graphs.policy, cfg, "policy")


def session(path: Path) -> Any:
    """An onnxruntime session of a file, on as many threads as torch has."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = torch.get_num_threads()
    return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])


def _export(load: Callable[[str], Graph], cfg: ExportConfig, name: str) -> Path:
    missing = [package for package in PACKAGES if find_spec(package) is None]
    if missing:
        raise UserError(f"export needs {', '.join(missing)}: pip install 'vision-s2r[export]'")
    graph = load(cfg.checkpoint)
    path = Path(cfg.out) / f"{name}.onnx"
    with files.whole(path) as temporary:
        _write(graph, temporary)
        difference = _difference(graph, temporary)
        if not difference <= PARITY:
            raise UserError(
                f"{path}: differs from torch by {difference:.1e}, expected at most {PARITY:.0e}: not written"
            )
    described = {
        "inputs": [vars(port) for port in graph.inputs],
        "outputs": [vars(port) for port in graph.outputs],
        "largest_difference_from_torch": difference,
        "normalization": graph.checkpoint.normalization,
        "configuration": graph.checkpoint.configuration,
        "training": graph.checkpoint.training,
    }
    files.write(path.with_suffix(".json"), json.dumps(described, indent=1))
    files.write(path.with_suffix(".md"), card(path.name, graph, difference))
    log.info("%s: at most %.1e from torch", path, difference)
    return path


def _write(graph: Graph, path: Path) -> None:
    """The graph in one file, for any number of whatever its ports name."""
    names = sorted({side for port in graph.inputs for side in port.shape if isinstance(side, str)})
    sides = {name: torch.export.Dim(name) for name in names}
    shapes = {p.name: {k: sides[side] for k, side in enumerate(p.shape) if isinstance(side, str)} for p in graph.inputs}
    with _quiet():
        program = torch.onnx.export(
            graph.module,
            graph.example(0, **TRACED),
            dynamo=True,
            dynamic_shapes=shapes,
            input_names=[port.name for port in graph.inputs],
            output_names=[port.name for port in graph.outputs],
        )
    assert program is not None
    program.save(path, external_data=False)


@contextmanager
def _quiet() -> Iterator[None]:
    """Without what the exporter says of its own insides, in three ways."""
    disabled = logging.root.manager.disable
    with warnings.catch_warnings(), redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")
        logging.disable(logging.INFO)
        try:
            yield
        finally:
            logging.disable(disabled)


def _difference(graph: Graph, path: Path) -> float:
    """Largest absolute difference of the file's outputs from torch's, at sizes that it was not traced with."""
    run, worst = session(path), 0.0
    for seed, sides in enumerate(CHECKED):
        inputs = graph.example(seed + 1, **sides)
        with torch.no_grad():
            expected = graph.module(*inputs)
        expected = expected if isinstance(expected, tuple) else (expected,)
        found = run.run(None, {port.name: x.numpy() for port, x in zip(graph.inputs, inputs, strict=True)})
        for one, other in zip(expected, found, strict=True):
            worst = max(worst, float(np.abs(one.numpy() - other).max()))
    return worst
