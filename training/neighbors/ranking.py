"""From scores to ranked neighbors: the walk, and how many of the first are right."""

import torch

EDGES, SHARPNESS, DECAY, STEPS = 6, 2.0, 0.8, 5


def without_self(scores: torch.Tensor) -> torch.Tensor:
    """`scores` (n, n) with the diagonal last in every row."""
    return scores.masked_fill(torch.eye(scores.shape[-1], dtype=torch.bool), -1e9)


def walk(scores: torch.Tensor) -> torch.Tensor:
    """Scores after a short walk over each row's best edges: neighbors of neighbors are neighbors."""
    likely = torch.log_softmax(without_self(scores), -1)
    likely = (likely + likely.T) / 2
    best = likely.topk(EDGES, -1)
    n = len(scores)
    weight = torch.zeros(n, n).scatter_(1, best.indices, torch.exp(SHARPNESS * best.values))
    weight = torch.maximum(weight, weight.T)
    step = (weight / weight.sum(-1, keepdim=True)).to_sparse()
    here = step.to_dense()
    reached = here.clone()
    for at in range(1, STEPS):
        # Powers of a matrix commute: the sparse factor stands on the left.
        here = torch.sparse.mm(step, here)
        reached += DECAY**at * here
    # What is not reached comes after, in the order of its scores.
    return torch.where(reached > 1e-30, reached.clamp(min=1e-30).log(), likely - 1e3)


def inlier_ratios(scores: torch.Tensor, places: torch.Tensor, at: tuple[int, ...]) -> list[float]:
    """Share of the first `k` of each row that are among its `k` nearest, for every `k`."""
    squares = without_self(-torch.cdist(places.double(), places.double()))
    near, found = squares.topk(max(at), -1).indices, without_self(scores).topk(max(at), -1).indices
    ratios = []
    for k in at:
        true = torch.zeros(len(places), len(places), dtype=torch.bool).scatter_(1, near[:, :k], True)
        ratios.append(true.gather(1, found[:, :k]).float().mean().item())
    return ratios
