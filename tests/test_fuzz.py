"""Spoilt files are refused by an error of imop's, or read; nothing else happens, whatever is wrong with them.

`pytest -m slow tests/test_fuzz.py` tries thousands, in processes whose memory and time are limited.
"""

import json
import multiprocessing
import re
import resource
import shutil
from dataclasses import replace
from hashlib import sha256

import numpy as np
import pytest
import torch
from PIL import Image

from imop.demos.check import check
from imop.demos.images import read_depth
from imop.demos.low_dim import read_frames
from imop.demos.rlbench import find_keyframes, path_keyframes
from imop.demos.store import DemonstrationStore
from imop.errors import ImopError
from imop.networks.model import CARD, SMALL, WEIGHTS, Model, load_model, save_model
from imop.networks.routing import RoutingConfig
from imop.tasks.coppelia.reader import read_model
from tests.demos.rlbench_files import dump_demo, frames_of
from tests.demos.scenes import assert_same, lift_a_cube, with_views
from tests.tasks.coppelia.conftest import cupboard

SAMPLE = 40
CASES = 2000
MOST_MEMORY = 2**29
MOST_SECONDS = 1200


def spoilt(data, rng):
    """One of: bits turned, cut, random bytes put in, a piece doubled, a piece left out."""
    raw = bytearray(data)
    kind = rng.integers(5)
    a, b = np.sort(rng.integers(0, len(raw), 2))
    if kind == 0:
        for place in rng.integers(0, len(raw), rng.integers(1, 6)):
            raw[place] ^= 1 << rng.integers(8)
    elif kind == 1:
        del raw[a:]
    elif kind == 2:
        raw[a:a] = rng.bytes(rng.integers(1, 20))
    elif kind == 3:
        raw[a:a] = raw[a : min(b, a + 5000)]
    else:
        del raw[a : min(b, a + 50)]
    return bytes(raw)


def with_another_number(text, rng):
    """JSON after one of its numbers was replaced."""
    numbers = list(re.finditer(rb"-?\d+(\.\d+)?", text))
    chosen = numbers[rng.integers(len(numbers))]
    others = [0, -1, 1, 2, 3, 255, 2**31 - 1, 10**9, 10**15, 10**40, 0.5, 1e300, int(rng.integers(10**6))]
    return text[: chosen.start()] + str(rng.choice(np.array(others, object))).encode() + text[chosen.end() :]


class Files:
    """Good files of one kind in a folder; every case spoils one of them in a copy and reads it."""

    def __init__(self, folder):
        self.good, self.copy = folder / "good", folder / "copy"
        self.good.mkdir()
        self.write()
        self.files = sorted(p.relative_to(self.good) for p in self.good.rglob("*") if p.is_file())

    def case(self, number):
        """True if the spoilt files were read."""
        rng = np.random.default_rng(number)
        shutil.rmtree(self.copy, ignore_errors=True)
        shutil.copytree(self.good, self.copy)
        file = self.copy / self.files[rng.integers(len(self.files))]
        is_json = file.suffix == ".json" and rng.random() < 0.5
        file.write_bytes((with_another_number if is_json else spoilt)(file.read_bytes(), rng))
        self.mend(rng)
        try:
            self.read()
        except ImopError:
            return False
        return True

    def mend(self, rng):
        """What would keep most cases from being read any further is made to fit."""


class Png(Files):
    def write(self):
        pixels = np.random.default_rng(0).integers(0, 256, (12, 16, 3), dtype=np.uint8)
        Image.fromarray(pixels).save(self.good / "0.png")

    def read(self):
        assert read_depth(self.copy / "0.png", 0.01, 4.5).ndim == 2


class Pickle(Files):
    def write(self):
        dump_demo(self.good / "low_dim_obs.pkl", frames_of(lift_a_cube())[::12])

    def read(self):
        frames = read_frames(self.copy / "low_dim_obs.pkl")
        find_keyframes(frames)
        path_keyframes(frames)
        assert all(len(frame.joint_positions) == 7 for frame in frames)


class Store(Files):
    def write(self):
        def small(k, name, view):
            parts = {field: getattr(view, field)[40:80, 50:90] for field in ("rgb", "depth", "instance_ids")}
            return replace(view, **parts) if name == "front" else view

        one = with_views(lift_a_cube(), small)
        steps = tuple(
            replace(k, observation=replace(k.observation, views={"front": k.observation.views["front"]}))
            for k in one.keyframes
        )
        final = replace(one.final, views={"front": one.final.views["front"]})
        self.demonstration = replace(one, keyframes=steps, final=final)
        DemonstrationStore.create(self.good / "store").append(self.demonstration)

    def mend(self, rng):
        """Half of the stores are of version 1, whose attributes no digest protects."""
        self.protected = rng.random() < 0.5
        if not self.protected:
            for file in (self.copy / "store" / "zarr.json", self.copy / "store/episode_000000/zarr.json"):
                text = file.read_bytes().replace(b'"version": 2', b'"version": 1')
                file.write_bytes(re.sub(rb'"digest": "[0-9a-f]*"', b'"other": 0', text))

    def read(self):
        assert isinstance(check(self.copy / "store"), list)
        found = list(DemonstrationStore.open(self.copy / "store"))
        assert len(found) <= 1
        if self.protected:
            for demonstration in found:
                assert_same(demonstration, self.demonstration)


class Weights(Files):
    def write(self):
        torch.manual_seed(0)
        save_model(Model(replace(SMALL, routing=RoutingConfig(width=16))), self.good, {"seed": 0})

    def mend(self, rng):
        """Half of the cards have the hash of the spoilt weights, and none of the configuration."""
        if rng.random() < 0.5:
            digest = sha256((self.copy / WEIGHTS).read_bytes()).hexdigest().encode()
            card = (self.copy / CARD).read_bytes()
            card = re.sub(rb'"sha256": "[0-9a-f]*"', b'"sha256": "' + digest + b'"', card)
            (self.copy / CARD).write_bytes(card.replace(b"config_sha256", b"other"))

    def read(self):
        assert isinstance(load_model(self.copy), Model)


class Ttm(Files):
    def write(self):
        (self.good / "cupboard.ttm").write_bytes(cupboard())

    def read(self):
        assert read_model((self.copy / "cupboard.ttm").read_bytes()).objects is not None


KINDS = [Png, Pickle, Store, Weights, Ttm]


@pytest.mark.parametrize("kind", KINDS)
def test_spoilt_files(kind, tmp_path):
    files = kind(tmp_path)
    results = [files.case(number) for number in range(SAMPLE)]
    assert not all(results)


def many(kind, folder):
    """All cases of a kind; the process dies if they take too much memory or time."""
    files = kind(folder)
    files.case(0)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    with open("/proc/self/statm") as statm:
        mapped = int(statm.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (mapped + 2**32, mapped + 2**32))
    resource.setrlimit(resource.RLIMIT_CPU, (MOST_SECONDS, MOST_SECONDS))
    read = sum(files.case(number) for number in range(CASES))
    taken = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 - before
    assert taken < MOST_MEMORY, f"{taken / 1e6:.0f} MB"
    print(json.dumps({"kind": kind.__name__, "cases": CASES, "read": read, "megabytes": taken // 10**6}))


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_many_spoilt_files(kind, tmp_path):
    process = multiprocessing.get_context("spawn").Process(target=many, args=(kind, tmp_path))
    process.start()
    process.join()
    assert process.exitcode == 0
