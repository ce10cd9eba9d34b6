"""Joints that torch can go back through: the compiled simulator, differentiated numerically a sample at a time."""

import math
from typing import Any

import numpy as np
import torch
from torch import Tensor

from vision_s2r.joint.stepping import Joints


class DifferentiableJoints:
    """Of `joints`, which somebody else steps: where each step leads, with the gradient of the steps before.

    `steepest` is what a sample of a joint may count at most in a loss that is a mean over joints: where a loop runs
    away, its gradient does too. Of what a state means for later ones each sample leaves the share `remembered`.
    """

    def __init__(self, joints: Joints, steepest: float = math.inf, remembered: float = 1.0) -> None:
        self._joints, self._steepest, self._remembered = joints, steepest, remembered
        late = torch.from_numpy(joints.delays)
        self._acting = torch.stack([late, late + 1], dim=1)
        self._state = torch.from_numpy(joints.moving)
        self._sent = torch.zeros(len(joints), int(late.max()) + 2, dtype=self._state.dtype)  # the last one first

    def foreseen(self, command: Tensor) -> Tensor:
        """Where `joints.step(command)` will lead under commands [N] (A, or N·m): [N, 4] as `joints.moving`."""
        self._sent = torch.cat([command[:, None], self._sent[:, :-1]], dim=1)
        after, jacobian = self._joints.differentiated(command.detach().numpy().astype(float))
        acting = self._sent.gather(1, self._acting)
        self._state = _Sample.apply(self._state, acting, after, jacobian, self._steepest, self._remembered)
        return self._state

    def detach(self) -> None:
        """From here on no gradient goes further back."""
        self._state, self._sent = self._state.detach(), self._sent.detach()


class _Sample(torch.autograd.Function):
    """What a sample makes of joints' state [N, 4], by the commands [N, 2] that act in it."""

    @staticmethod
    def forward(
        ctx: Any,
        state: Tensor,
        commands: Tensor,
        after: np.ndarray,
        jacobian: np.ndarray,
        steepest: float,
        remembered: float,
    ) -> Tensor:
        ctx.jacobian, ctx.steepest, ctx.remembered = torch.from_numpy(jacobian), steepest, remembered
        return torch.from_numpy(after)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, ...]:
        size = gradient.norm(dim=1, keepdim=True)
        cut = gradient * (ctx.steepest / len(gradient) / size.clamp_min(1e-12)).clamp_max(1.0)
        back = torch.einsum("nij,nj->ni", ctx.jacobian, cut)
        return ctx.remembered * back[:, :4], back[:, 4:], None, None, None, None
