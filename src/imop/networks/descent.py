"""How the rate falls, how weights are averaged, and in which numbers products are made, in every training."""

import math

import torch


def schedule(step: int, warm_up: int, steps: int) -> float:
    """Share of the peak learning rate: linear warm-up, then a cosine down to 1 %."""
    if step < warm_up:
        return (step + 1) / warm_up
    progress = min((step - warm_up) / max(steps - warm_up, 1), 1.0)
    return 0.01 + 0.99 * 0.5 * (1 + math.cos(math.pi * progress))


def kept(decay: float, count: float) -> float:
    """What an average of weights keeps of itself after so many updates."""
    # The first steps would otherwise weigh as much as the last.
    return min(decay, (1 + count) / (10 + count))


def has_fast_bfloat16() -> bool:
    """Whether this processor is fast in bfloat16; without AVX-512 it takes three times as long."""
    return "AVX512" in torch.backends.cpu.get_cpu_capability()
