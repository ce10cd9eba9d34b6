from dataclasses import replace

import pytest
import torch

from vision_s2r.training import precision
from vision_s2r.translate import TranslateConfig


@pytest.mark.parametrize(
    ("capabilities", "expected"),
    [
        ({"architecture": "x86_64", "avx512_f": True, "avx512_bf16": False}, "32-true"),
        ({"architecture": "x86_64", "avx512_f": True, "amx_bf16": True}, "bf16-mixed"),
        ({"architecture": "arm64", "neon": True, "bf16": True}, "bf16-mixed"),
    ],
)
def test_a_translator_trains_in_bfloat16_only_where_the_processor_multiplies_it(
    capabilities: dict[str, object], expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(torch.cpu, "get_capabilities", lambda: capabilities)
    assert precision.resolved(replace(TranslateConfig().training, accelerator="cpu")) == expected
