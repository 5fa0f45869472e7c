"""Trains a network of neighborhoods: `train.py OUT DATA.. --minutes 60 [--validate FOLDER]`.

DATA are folders of crops (`training_crops`), FOLDER one of whole images. OUT gets `curve.csv`, `best.safetensors` (by
inlier ratio at 20 after the walk, on FOLDER) and `checkpoint.pt`, from which the same command goes on. Time is that
of the training alone: CPU time, or with `--device cuda` time of the clock. It sets the schedule, so that a run may be
stopped at any moment but ends as planned.
"""

import argparse
import concurrent.futures
import copy
import csv
import dataclasses
import math
import pathlib
import time

import torch

import data
import evaluate
import ranking
import weights
from model import Network, Shape


def parsed():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("data", type=pathlib.Path, nargs="+")
    parser.add_argument("--minutes", type=float, default=60.0, help="time of the training, validation apart")
    parser.add_argument("--device", choices=["cpu", "cuda"], default="cpu")
    parser.add_argument("--steps", type=int, help="stop after so many steps")
    parser.add_argument("--repeat", action="store_true", help="the first batch only: its loss must fall")
    parser.add_argument("--validate", type=pathlib.Path, help="folder of whole images")
    parser.add_argument("--images", type=int, default=8, help="images of it that are used")
    parser.add_argument("--every", type=float, default=5.0, help="minutes between validations")
    parser.add_argument("--points", type=int, default=2048, help="points per step")
    parser.add_argument("--warm-up", type=int, default=100, help="steps over which rates rise")
    parser.add_argument("--rate", type=float, default=1.2e-3)
    parser.add_argument("--muon", type=float, default=0.0, help="rate of the matrices by Muon; 0: all by AdamW")
    parser.add_argument("--weights", type=pathlib.Path, help="start from these weights")
    parser.add_argument("--thin", type=float, default=0.0, help="share of large crops that lose a random half of their points")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--half", action="store_true", help="bf16 where that is fast")
    for field in dataclasses.fields(Shape):
        parser.add_argument(f"--{field.name}", type=int, default=field.default)
    return parser.parse_args()


def loss_of(scores: torch.Tensor, target: torch.Tensor) -> torch.Tensor:
    """Cross entropy of every row's softmax over the other points."""
    logs = torch.log_softmax(ranking.without_self(scores.float()), -1)
    return -(target * logs).sum(-1).mean()


def optimizers(network: Network, rate: float, muon: float) -> list[torch.optim.Optimizer]:
    """Muon for the matrices within blocks where a rate is given, AdamW for the rest."""
    matrices, rest = [], []
    for name, value in network.named_parameters():
        (matrices if muon and value.ndim == 2 and not name.startswith("pairs") else rest).append(value)
    chosen = [torch.optim.AdamW(rest, lr=rate, weight_decay=0.01, betas=(0.9, 0.98))]
    if matrices:
        chosen.append(torch.optim.Muon(matrices, lr=muon, weight_decay=0.01, adjust_lr_fn="original"))
    return chosen


class Run:
    """All that a checkpoint keeps."""

    def __init__(self, options):
        torch.manual_seed(options.seed)
        shape = Shape(**{field.name: getattr(options, field.name) for field in dataclasses.fields(Shape)})
        self.options = options
        self.network = weights.load(options.weights)[0] if options.weights else Network(shape)
        self.network.to(options.device)
        self.optimizers = optimizers(self.network, options.rate, options.muon)
        self.rates = [group["lr"] for optimizer in self.optimizers for group in optimizer.param_groups]
        self.step, self.seconds, self.best = 0, 0.0, 0.0
        self.path = options.out / "checkpoint.pt"
        if self.path.exists():
            state = torch.load(self.path, map_location=options.device, weights_only=True)
            self.network.load_state_dict(state["network"])
            for optimizer, kept in zip(self.optimizers, state["optimizers"]):
                optimizer.load_state_dict(kept)
            self.step, self.seconds, self.best = state["step"], state["seconds"], state["best"]

    def save(self):
        state = {"network": self.network.state_dict(), "step": self.step, "seconds": self.seconds, "best": self.best}
        state["optimizers"] = [optimizer.state_dict() for optimizer in self.optimizers]
        scratch = self.path.with_suffix(".part")
        torch.save(state, scratch)
        scratch.replace(self.path)

    def set_rates(self):
        """Warm-up, then half a cosine over the planned time, down to 2 %."""
        done = min(self.seconds / (60 * self.options.minutes), 1.0)
        share = min(1.0, (self.step + 1) / self.options.warm_up) * (0.02 + 0.98 * (1 + math.cos(math.pi * done)) / 2)
        groups = [group for optimizer in self.optimizers for group in optimizer.param_groups]
        for group, rate in zip(groups, self.rates):
            group["lr"] = rate * share

    def train(self, batch) -> float:
        """One step; the loss before it."""
        descriptors, pairs, target = (part.to(self.options.device, non_blocking=True) for part in batch)
        self.set_rates()
        if self.options.half:
            pairs = pairs.bfloat16()
        with torch.autocast(self.options.device, torch.bfloat16, enabled=self.options.half):
            scores = self.network(descriptors, pairs)
        loss = loss_of(scores, target)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 1.0)
        for optimizer in self.optimizers:
            optimizer.step()
            optimizer.zero_grad(set_to_none=True)
        self.step += 1
        return loss.item()

    def validate(self) -> list[float]:
        """Inlier ratios at 20, plain and after the walk; keeps the weights if they are the best."""
        options = self.options
        if options.validate is None:
            return []
        network = copy.deepcopy(self.network).cpu()
        found = evaluate.measure(network, options.validate, options.images, False)
        at = evaluate.AT.index(20)
        plain, walked = found["network"][at], found["network+walk"][at]
        if walked >= self.best:
            self.best = walked
            about = {"step": str(self.step), "minutes": f"{self.seconds / 60:.1f}", "validated": f"{walked:.4f}"}
            weights.save(network, options.out / "best.safetensors", about)
        return [100 * plain, 100 * walked]


def main():
    options = parsed()
    # With other work on the machine, threads wait for each other: two are slower than one.
    torch.set_num_threads(1)
    options.out.mkdir(parents=True, exist_ok=True)
    batches = data.Batches(data.shards(options.data), options.points, options.seed, options.thin)
    run = Run(options)
    fresh = run.step == 0
    clock = time.time if options.device == "cuda" else time.process_time
    # A thread makes the next batch while a step runs. Its CPU time counts, too.
    pool = concurrent.futures.ThreadPoolExecutor(1)
    ahead = pool.submit(batches.batch, 0 if options.repeat else run.step)
    with open(options.out / "curve.csv", "a" if not fresh else "w", newline="") as file:
        curve = csv.writer(file)
        if fresh:
            curve.writerow(["minutes", "step", "points", "loss", "plain at 20", "walk at 20"])
        losses, since = [], run.seconds
        done = False
        while not done:
            start = clock()
            batch = ahead.result()
            ahead = pool.submit(batches.batch, 0 if options.repeat else run.step + 1)
            losses.append(run.train(batch))
            run.seconds += clock() - start
            done = run.seconds >= 60 * options.minutes or run.step == options.steps
            if done or run.seconds - since >= 60 * options.every:
                since = run.seconds
                run.save()
                row = [f"{run.seconds / 60:.2f}", run.step, run.step * options.points]
                row += [f"{sum(losses) / len(losses):.4f}", *(f"{ratio:.2f}" for ratio in run.validate())]
                curve.writerow(row)
                file.flush()
                print(*row, flush=True)
                losses = []


if __name__ == "__main__":
    main()
