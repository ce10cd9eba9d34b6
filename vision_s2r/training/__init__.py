"""The one training loop and its checkpoints.

In: a `Method` (networks, optimizers, a step, a validation), views to train and validate on, a
`TrainingConfig`. Out: a folder with `best.safetensors` (released checkpoint), `last.pt` (what the run resumes
from), `pictures/*.png` and TensorBoard logs.

    result = train(partial(MyMethod, cfg), train_views, validation_views, cfg.training, out, seed)
    checkpoint = checkpoint.load(result.best, "my_kind");  checkpoint.restore("network", network)
"""

from vision_s2r.training.config import TrainingConfig
from vision_s2r.training.data import Draw, ViewSource
from vision_s2r.training.inputs import Inputs
from vision_s2r.training.loop import TrainingResult, train
from vision_s2r.training.method import Batch, Method, Step, frozen
from vision_s2r.training.optimizers import adamw, muon_and_adamw

__all__ = [
    "Batch",
    "Draw",
    "Inputs",
    "Method",
    "Step",
    "TrainingConfig",
    "TrainingResult",
    "ViewSource",
    "adamw",
    "frozen",
    "muon_and_adamw",
    "train",
]
