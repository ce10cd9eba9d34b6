"""Muon takes the kernels of a network and AdamW the rest; together they resume as one."""

import pytest
import torch

from vision_s2r.networks.unet import NetworkConfig, UNet
from vision_s2r.training import TrainingConfig, muon_and_adamw

CFG = TrainingConfig(max_steps=1, muon=1e-2, learning_rate=1e-3, weight_decay=0.0)


def network() -> UNet:
    torch.manual_seed(0)
    return UNet(NetworkConfig(width=8, levels=2, rectifier=8), {"picture": 3})


def step(net: UNet, optimizer: torch.optim.Optimizer, seed: int) -> None:
    found = net(torch.rand(2, 3, 16, 16, generator=torch.Generator().manual_seed(seed)))
    optimizer.zero_grad()
    (found["picture"].square().mean() + found["displacements"].square().mean()).backward()
    optimizer.step()


def test_kernels_move_in_all_directions_alike() -> None:
    net = network()
    before = {name: value.detach().clone() for name, value in net.named_parameters()}
    step(net, muon_and_adamw(net, CFG), 1)
    moved = {name: value.detach() - before[name] for name, value in net.named_parameters()}
    spectra = [torch.linalg.svdvals(m) for name, m in moved.items() if name.endswith("kernel") and m.any()]
    assert spectra
    for spectrum in spectra:
        assert spectrum.mean() > 0.3 * spectrum[0]  # of a gradient, a few stand out
    assert float(moved["head.weight"].abs().max()) == pytest.approx(1e-3, rel=0.05)  # AdamW's first step


def test_it_goes_on_exactly() -> None:
    nets = network(), network()
    optimizers = [muon_and_adamw(net, CFG) for net in nets]
    for net, optimizer in zip(nets, optimizers, strict=True):
        step(net, optimizer, 1)
    fresh = muon_and_adamw(nets[1], CFG)
    fresh.load_state_dict(optimizers[1].state_dict())
    for group in fresh.param_groups:
        group["lr"] *= 0.5
    for group in optimizers[0].param_groups:
        group["lr"] *= 0.5
    step(nets[0], optimizers[0], 2)
    step(nets[1], fresh, 2)
    for name, value in nets[0].state_dict().items():
        assert torch.equal(value, nets[1].state_dict()[name]), name
