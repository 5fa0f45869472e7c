"""Inlier ratios of whole images: `evaluate.py FOLDER [--weights FILE] [--images N] [--out CSV]`.

FOLDER as `training_crops --whole` writes it. Rows: raw similarity, the pair scores as they are, the network's, each
plain and after the walk. Of learned descriptors also what `learned` ranks by: the mean of both ends of a pair with some
deviations of the cosine beside the scores.
"""

import argparse
import csv
import pathlib
import sys

import torch

import data
import ranking
from model import Network
from weights import load

AT = (1, 5, 10, 20, 50, 100)
LIKENESS = (0.0, 0.15, 0.2, 0.3)


def ranked(network: Network | None, shard: data.Shard) -> dict[str, torch.Tensor]:
    """Scores of one image by what made them."""
    descriptors, pairs, _ = (part[0] for part in shard.read([0]))
    best = pairs.amax(0)
    scores = {"similarity": descriptors @ descriptors.T, "pairs": best}
    # Pair scores are deviations, not logs: the walk weighs its edges by exp(2 z).
    if network is not None:
        with torch.inference_mode():
            scores["network"] = network(descriptors, pairs)
        if network.shape.reaches == 1:
            for weight in LIKENESS:
                scores[f"both ends + {weight}"] = both_ends(scores["network"] + weight * best)
    return scores


def both_ends(scores: torch.Tensor) -> torch.Tensor:
    """The mean of a pair's log probabilities in its two rows."""
    logs = torch.log_softmax(ranking.without_self(scores), -1)
    return (logs + logs.T) / 2


def measure(network: Network | None, folder: pathlib.Path, images: int | None, null: bool) -> dict[str, list[float]]:
    """Inlier ratios at AT, averaged over points of all images."""
    sums, points = {}, 0
    for shard in data.shards([folder])[:images]:
        scores = ranked(network, shard)
        if not null:
            scores = {"network": scores["network"]}
        places = torch.from_numpy(shard.places[0])
        points += shard.n
        for name, score in scores.items():
            for label, of in ((name, score), (name + "+walk", ranking.walk(score))):
                ratios = ranking.inlier_ratios(of, places, AT)
                old = sums.get(label, [0.0] * len(AT))
                sums[label] = [total + ratio * shard.n for total, ratio in zip(old, ratios)]
    return {label: [total / points for total in totals] for label, totals in sums.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--weights", type=pathlib.Path)
    parser.add_argument("--images", type=int)
    parser.add_argument("--out", type=pathlib.Path)
    options = parser.parse_args()
    torch.set_num_threads(1)
    network = load(options.weights)[0].eval() if options.weights else None
    rows = measure(network, options.folder, options.images, True)
    lines = [["ranking", *(f"at {k}" for k in AT)]]
    lines += [[label, *(f"{100 * ratio:.1f}" for ratio in ratios)] for label, ratios in rows.items()]
    csv.writer(sys.stdout).writerows(lines)
    if options.out:
        with open(options.out, "w", newline="") as file:
            csv.writer(file).writerows(lines)


if __name__ == "__main__":
    main()
