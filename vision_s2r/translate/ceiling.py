"""How fast this machine convolves at best, and how much of that a network's training reaches."""

import time
from collections.abc import Callable

import torch
from torch import Tensor
from torch.nn import functional as F
from torch.utils.flop_counter import FlopCounterMode

SHAPES = ((32, 32), (64, 16), (128, 8))  # channels and side (px) of 3 x 3 convolutions, as a U-Net at 64 px has them
ROUNDS = 5


def measure(mixed: bool, batch: int, device: torch.device, seconds: float) -> float:
    """The fastest rate of a 3 x 3 convolution, forward and backward, channels_last: operations a second.

    In bfloat16 where the arithmetic of training is `mixed`, else in float32; a multiplication and an addition are two
    operations. `seconds` in all.
    """
    kind = torch.bfloat16 if mixed else torch.float32
    rates = []
    for channels, side in SHAPES:
        call = _convolution(channels, side, batch, kind, device)
        call()
        rates += [operations(call) * per_second(call, seconds / ROUNDS / len(SHAPES)) for _ in range(ROUNDS)]
    return max(rates)


def operations(call: Callable[[], None]) -> int:
    """Those of the convolutions and matrix products in what `call` does, backward too."""
    with FlopCounterMode(display=False) as counter:
        call()
    return counter.get_total_flops()


def _convolution(channels: int, side: int, batch: int, kind: torch.dtype, device: torch.device) -> Callable[[], None]:
    def drawn(*shape: int) -> Tensor:
        return torch.randn(*shape, device=device).to(kind).to(memory_format=torch.channels_last)

    x, weight = drawn(batch, channels, side, side).requires_grad_(), drawn(channels, channels, 3, 3).requires_grad_()
    upstream = drawn(batch, channels, side, side)

    def call() -> None:
        x.grad = weight.grad = None
        F.conv2d(x, weight, padding=1).backward(upstream)
        if device.type == "cuda":
            torch.cuda.synchronize(device)

    return call


def per_second(call: Callable[[], object], seconds: float) -> float:
    """Calls a second, over at least one call and `seconds`."""
    start, count = time.perf_counter(), 0
    while count == 0 or time.perf_counter() - start < seconds:
        call()
        count += 1
    return count / (time.perf_counter() - start)
