"""Trains an inversion network: `train.py OUT PREPARED.. --lpips FILE --minutes 100 [--validate PREPARED]`.

PREPARED are folders of photos with their features beside (`data.py prepare`, then `unlift features`). OUT gets
`curve.csv`, `best.safetensors` (averaged weights, by LPIPS on the first photos of the validation folder) and
`checkpoint.pt`, from which the same command goes on. Time is CPU time of the training alone; it sets the schedule.
"""

import argparse
import copy
import csv
import dataclasses
import math
import pathlib
import time

import torch

import data
import evaluate
import metrics
import weights
from model import Network, Shape


def parsed():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("data", type=pathlib.Path, nargs="+")
    parser.add_argument("--lpips", type=pathlib.Path, required=True, help="lpips_squeeze_v0.1.safetensors")
    parser.add_argument("--minutes", type=float, default=100.0, help="CPU time of the training, validation apart")
    parser.add_argument("--steps", type=int, help="stop after so many steps")
    parser.add_argument("--repeat", action="store_true", help="the first batch only: its loss must fall")
    parser.add_argument("--validate", type=pathlib.Path, help="a prepared folder")
    parser.add_argument("--images", type=int, default=16, help="photos of it that are used")
    parser.add_argument("--every", type=float, default=10.0, help="minutes between validations")
    parser.add_argument("--batch", type=int, default=2, help="crops per step")
    parser.add_argument("--crop", type=int, default=256, help="its sides in pixels of the photo, a multiple of 4")
    parser.add_argument("--warm-up", type=int, default=100, help="steps over which rates rise")
    parser.add_argument("--rate", type=float, default=1e-3, help="of AdamW")
    parser.add_argument("--losses", default="0.5,0.8,0.3", help="weights of L1, LPIPS and 1 - SSIM")
    parser.add_argument("--half", action="store_true", help="16-bit products where the processor has them")
    parser.add_argument("--plain", action="store_true", help="never show what recovery leaves")
    parser.add_argument("--start", type=pathlib.Path, help="weights to start from")
    parser.add_argument("--seed", type=int, default=1)
    for field in dataclasses.fields(Shape):
        parser.add_argument(f"--{field.name}", type=type(field.default), default=field.default)
    return parser.parse_args()


class Run:
    """All that a checkpoint keeps."""

    def __init__(self, options):
        torch.manual_seed(options.seed)
        self.options = options
        self.l1, self.lpips, self.ssim = map(float, options.losses.split(","))
        self.distance = metrics.Lpips(options.lpips)
        if options.start:
            self.network, _ = weights.load(options.start)
        else:
            fields = {field.name: getattr(options, field.name) for field in dataclasses.fields(Shape)}
            self.network = Network(Shape(**fields))
        self.network.to(memory_format=torch.channels_last)
        self.averaged = copy.deepcopy(self.network).requires_grad_(False)
        self.optimizer = torch.optim.AdamW(self.network.parameters(), lr=options.rate, weight_decay=0.01, betas=(0.9, 0.98))
        self.step, self.seconds, self.best = 0, 0.0, math.inf
        self.path = options.out / "checkpoint.pt"
        if self.path.exists():
            state = torch.load(self.path, weights_only=True)
            self.network.load_state_dict(state["network"])
            self.averaged.load_state_dict(state["averaged"])
            self.optimizer.load_state_dict(state["optimizer"])
            self.step, self.seconds, self.best = state["step"], state["seconds"], state["best"]

    def save(self):
        state = {"step": self.step, "seconds": self.seconds, "best": self.best}
        state |= {"network": self.network.state_dict(), "averaged": self.averaged.state_dict()}
        state["optimizer"] = self.optimizer.state_dict()
        scratch = self.path.with_suffix(".part")
        torch.save(state, scratch)
        scratch.replace(self.path)

    def set_rate(self):
        """Warm-up, then half a cosine over the planned time, down to 2 %."""
        done = min(self.seconds / (60 * self.options.minutes), 1.0)
        share = min(1.0, (self.step + 1) / self.options.warm_up) * (0.02 + 0.98 * (1 + math.cos(math.pi * done)) / 2)
        for group in self.optimizer.param_groups:
            group["lr"] = self.options.rate * share

    def loss_of(self, made: torch.Tensor, wanted: torch.Tensor) -> torch.Tensor:
        with torch.no_grad():
            seen = self.distance.features(wanted)
        loss = self.l1 * (made - wanted).abs().mean()
        loss = loss + self.lpips * self.distance.between(self.distance.features(made), seen).mean()
        return loss + self.ssim * (1 - metrics.ssim(made, wanted)).mean()

    def train(self, batch) -> float:
        """One step; the loss before it."""
        features, wanted = (part.contiguous(memory_format=torch.channels_last) for part in batch)
        self.set_rate()
        with torch.autocast("cpu", torch.bfloat16, enabled=self.options.half):
            made = self.network(features)
        loss = self.loss_of(made.float(), wanted)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 1.0)
        self.optimizer.step()
        self.optimizer.zero_grad(set_to_none=True)
        self.step += 1
        decay = min(0.999, (1 + self.step) / (10 + self.step))
        with torch.no_grad():
            pairs = list(zip(self.averaged.parameters(), self.network.parameters()))
            torch._foreach_lerp_([a for a, _ in pairs], [b for _, b in pairs], 1 - decay)
        return loss.item()

    def validate(self, photos: list[data.Photo]) -> list[float]:
        """SSIM, PSNR and LPIPS of whole photos; keeps the averaged weights if they are the best."""
        if not photos:
            return []
        found = evaluate.measure(self.averaged, self.distance, photos, "true")
        if found[-1] <= self.best:
            self.best = found[-1]
            about = {"step": str(self.step), "minutes": f"{self.seconds / 60:.1f}", "validated": f"{self.best:.4f}"}
            weights.save(self.averaged, self.options.out / "best.safetensors", about)
        return found


def main():
    options = parsed()
    # With other work on the machine, threads wait for each other: two are slower than one.
    torch.set_num_threads(1)
    options.out.mkdir(parents=True, exist_ok=True)
    run = Run(options)
    batches = data.Batches([photo for folder in options.data for photo in data.photos(folder)], options.batch, options.crop, options.seed, options.plain)
    judged = data.photos(options.validate, options.images) if options.validate else []
    fresh = run.step == 0
    with open(options.out / "curve.csv", "a" if not fresh else "w", newline="") as file:
        curve = csv.writer(file)
        if fresh:
            curve.writerow(["minutes", "step", "loss", "ssim", "psnr", "lpips"])
        losses, since = [], run.seconds
        done = False
        while not done:
            start = time.process_time()
            losses.append(run.train(batches.batch(0 if options.repeat else run.step)))
            run.seconds += time.process_time() - start
            done = run.seconds >= 60 * options.minutes or run.step == options.steps
            if done or run.seconds - since >= 60 * options.every:
                since = run.seconds
                run.save()
                row = [f"{run.seconds / 60:.2f}", run.step, f"{sum(losses) / len(losses):.4f}"]
                row += [f"{figure:.4f}" for figure in run.validate(judged)]
                curve.writerow(row)
                file.flush()
                print(*row, flush=True)
                losses = []


if __name__ == "__main__":
    main()
