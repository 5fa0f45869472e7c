"""Trains an inversion network: `train.py OUT PREPARED.. --lpips FILE --minutes 8`, on a GPU if there is one.

PREPARED are folders that `prepare.py` wrote. At every validation OUT gets a row of `curve.csv`, `weights.safetensors` (averaged over
steps, for `export.py`) and a sheet of pictures for each validation set. With `--state FILE` the same command resumes. Time is wall
clock on a GPU and CPU time on a CPU. The learning rate follows it.
"""

import argparse
import copy
import csv
import dataclasses
import math
import pathlib
import time

import torch

import evaluate
import metrics
import weights
from batches import Batches, Photos
from model import Network, Shape


def parsed():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("data", type=pathlib.Path, nargs="+")
    parser.add_argument("--lpips", type=pathlib.Path, required=True, help="lpips_squeeze_v0.1.safetensors")
    parser.add_argument("--sets", default="train-1,train-0.7,train-soft", help="folders in PREPARED to train on")
    parser.add_argument("--validate", default="val-1,look-1", help="folders in PREPARED to measure")
    parser.add_argument("--images", type=int, default=48, help="photos of each to measure")
    parser.add_argument("--minutes", type=float, default=8.0, help="time of training, without validation")
    parser.add_argument("--steps", type=int, default=math.inf, help="largest number of steps")
    parser.add_argument("--every", type=float, default=2.0, help="minutes between validations")
    parser.add_argument("--repeat", action="store_true", help="trains on the first batch only: its loss must fall")
    parser.add_argument("--state", type=pathlib.Path, help="file to resume from, written at every validation")
    parser.add_argument("--start", type=pathlib.Path, help="weights.safetensors to start from; its shape replaces the options")
    parser.add_argument("--batch", type=int, default=32, help="crops per step")
    parser.add_argument("--crop", type=int, default=384, help="width and height of a crop in pixels, a multiple of 4")
    # At 1.5e-3 the loss of batches of 32 had spikes in the first two minutes on a GPU.
    parser.add_argument("--rate", type=float, default=8e-4, help="learning rate of AdamW")
    parser.add_argument("--warm-up", type=int, default=200, help="steps over which the learning rate rises")
    parser.add_argument("--losses", default="0.5,0.8,0.3", help="weights of L1, LPIPS and 1 - SSIM")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    for field in dataclasses.fields(Shape):
        parser.add_argument(f"--{field.name}", type=type(field.default), default=field.default)
    return parser.parse_args()


class Run:
    """A network in training, and everything else that a state file holds."""

    def __init__(self, options):
        torch.manual_seed(options.seed)
        self.options, self.gpu = options, options.device == "cuda"
        self.l1, self.lpips, self.ssim = map(float, options.losses.split(","))
        self.distance = metrics.Lpips(options.lpips, options.device)
        if options.start:
            self.network, _ = weights.load(options.start)
        else:
            self.network = Network(Shape(**{field.name: getattr(options, field.name) for field in dataclasses.fields(Shape)}))
        self.network.to(options.device, memory_format=torch.channels_last)
        self.averaged = copy.deepcopy(self.network).requires_grad_(False)
        self.optimizer = torch.optim.AdamW(self.network.parameters(), lr=options.rate, weight_decay=0.01, betas=(0.9, 0.98), fused=self.gpu)
        self.step, self.seconds = 0, 0.0
        if options.state and options.state.exists():
            state = torch.load(options.state, map_location=options.device, weights_only=True)
            for part in ("network", "averaged", "optimizer"):
                getattr(self, part).load_state_dict(state[part])
            self.step, self.seconds = state["at"]

    def save(self):
        about = {"step": str(self.step), "minutes": f"{self.seconds / 60:.1f}"}
        weights.save(self.averaged, self.options.out / "weights.safetensors", about)
        if self.options.state:
            state = {part: getattr(self, part).state_dict() for part in ("network", "averaged", "optimizer")}
            scratch = self.options.state.with_suffix(".part")
            torch.save(state | {"at": (self.step, self.seconds)}, scratch)
            scratch.replace(self.options.state)

    def set_rate(self):
        """Sets the learning rate: a warm-up, then half a cosine over the planned time, down to 1 %."""
        done = min(self.seconds / (60 * self.options.minutes), 1.0)
        share = min(1.0, (self.step + 1) / self.options.warm_up) * (0.01 + 0.99 * (1 + math.cos(math.pi * done)) / 2)
        for group in self.optimizer.param_groups:
            group["lr"] = self.options.rate * share

    def half(self):
        return torch.autocast(self.options.device, torch.bfloat16, enabled=self.gpu)

    def loss(self, made: torch.Tensor, wanted: torch.Tensor) -> torch.Tensor:
        loss = self.l1 * (made - wanted).abs().mean() + self.ssim * (1 - metrics.ssim(made, wanted)).mean()
        # The first layer of LPIPS sees every second pixel, and a network would learn which ones.
        x, y = torch.randint(0, 2, (2,)).tolist()
        a, b = made[..., y:, x:], wanted[..., y:, x:]
        with self.half():
            with torch.no_grad():
                seen = self.distance.features(b)
            return loss + self.lpips * self.distance.between(self.distance.features(a), seen).float().mean()

    def train(self, features: torch.Tensor, wanted: torch.Tensor) -> torch.Tensor:
        """Makes one step and returns the loss before it."""
        features, wanted = (part.contiguous(memory_format=torch.channels_last) for part in (features, wanted))
        self.set_rate()
        with self.half():
            made = self.network(features)
        loss = self.loss(made.float(), wanted)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 1.0)
        self.optimizer.step()
        self.optimizer.zero_grad(set_to_none=True)
        self.step += 1
        decay = min(0.999, (1 + self.step) / (10 + self.step))
        with torch.no_grad():
            torch._foreach_lerp_(list(self.averaged.parameters()), [p.detach() for p in self.network.parameters()], 1 - decay)
        return loss.detach()

    def validate(self, name: str, photos: Photos) -> list[float]:
        """Returns SSIM, PSNR and LPIPS of whole photos with the averaged weights, without and then with colors."""
        torch.backends.cudnn.benchmark = False  # sizes differ
        found = []
        for how in ["true", "colors"][: 1 + self.network.shape.colors]:
            found += evaluate.measure(self.averaged, self.distance, photos, how, self.options.images)
        evaluate.sheet(self.averaged, photos, list(range(min(8, len(photos)))), self.options.out / f"{name}.jpg")
        torch.backends.cudnn.benchmark = True
        return found


def main():
    options = parsed()
    if options.device == "cpu":
        # With other work on the machine, threads wait for each other: two are slower than one.
        torch.set_num_threads(1)
    torch.backends.cudnn.benchmark = True
    torch.backends.cuda.matmul.allow_tf32 = torch.backends.cudnn.allow_tf32 = True
    options.out.mkdir(parents=True, exist_ok=True)

    def load(sets: str) -> Photos | None:
        paths = [folder / name for folder in options.data for name in sets.split(",")]
        paths = [path for path in paths if path.exists()]
        return Photos(paths, options.device) if paths else None

    run = Run(options)
    print(sum(p.numel() for p in run.network.parameters()), "weights", flush=True)
    train = load(options.sets)
    if not train:
        raise SystemExit(f"PREPARED: expected a folder of {options.sets}, found none")
    print(len(train), "photos", flush=True)
    batches = Batches(train, options.crop, options.seed + run.step, bool(run.network.shape.colors))
    validated = {name: found for name in options.validate.split(",") if (found := load(name))}
    first = batches.batch(options.batch) if options.repeat else None
    clock = time.time if run.gpu else time.process_time
    with open(options.out / "curve.csv", "a" if run.step else "w", newline="") as file:
        curve = csv.writer(file)
        if not file.tell():
            hows = ["", " colors"][: 1 + run.network.shape.colors]
            figures = [f"{name} {figure}{how}" for name in validated for how in hows for figure in ("ssim", "psnr", "lpips")]
            curve.writerow(["minutes", "step", "loss", *figures])
        start, since, losses, done = clock() - run.seconds, run.seconds, [], False
        while not done:
            losses.append(run.train(*(first or batches.batch(options.batch))))
            # Kernels are queued far ahead of the clock.
            if run.gpu and run.step % 20 == 0:
                torch.cuda.synchronize()
            run.seconds = clock() - start
            if run.step % 100 == 0:
                print(f"{run.seconds:.0f} s, step {run.step}, loss {torch.stack(losses[-100:]).mean().item():.4f}", flush=True)
            done = run.seconds >= 60 * options.minutes or run.step >= options.steps
            if done or run.seconds - since >= 60 * options.every:
                paused = clock()
                run.save()
                row = [f"{run.seconds / 60:.2f}", run.step, f"{torch.stack(losses).mean().item():.4f}"]
                row += [f"{figure:.4f}" for name, photos in validated.items() for figure in run.validate(name, photos)]
                curve.writerow(row)
                file.flush()
                print(*row, flush=True)
                start += clock() - paused
                since, losses = run.seconds, []


if __name__ == "__main__":
    main()
