"""Frames a second on 1, 2 and 4 workers of one thread, the overhead of the farm, and the time of an empty task.

python -m benchmarks.farm [--rounds 3] [--tasks 10000]

The overhead is the share of the workers' time without drawing: 1 - (seconds of all draws) / (workers x seconds of the
run). So it is comparable on a machine with fewer cores than workers, where each draw takes longer.
"""

import argparse
import os
import time
from collections.abc import Iterator
from statistics import median

from dask.system import CPU_COUNT
from distributed import Client, LocalCluster

from raytracer.farm.cluster import Cluster, open_cluster
from raytracer.farm.frame_jobs import FrameJob, draw_frame
from raytracer.farm.tasks import Done
from raytracer.formats.animated_scene import open_animation
from raytracer.formats.scene_file import find_scene, read_document
from raytracer.scene.settings import Settings

# The picture of a frame: about a second on one thread of a core of 2020.
SIZE, SAMPLES = (480, 270), 96
# Frames for each worker in a round. At the end of a run some workers wait for the others: the fewer frames, the larger
# the share of this wait.
FRAMES = 16


def empty(number: int) -> int:
    """Do nothing."""
    return number


def frame_jobs(count: int) -> Iterator[tuple[int, FrameJob]]:
    """Yield frames of the turntable."""
    animation = open_animation(read_document(find_scene("turntable")))
    for number in range(count):
        scene = animation.scene(number % animation.frames)
        yield number, FrameJob(scene=scene, size=SIZE, settings=Settings(samples=SAMPLES), suffix=".png")


def draw_seconds(cluster: Cluster, count: int) -> list[float]:
    """Draw frames, and return the seconds of each draw."""
    outcomes = [*cluster.run(draw_frame, frame_jobs(count))]
    return [outcome.value.seconds for outcome in outcomes if isinstance(outcome, Done)]


def measure_frames(workers: int, rounds: int) -> tuple[float, float, float]:
    """Return the medians of frames a second, of the seconds of a draw, and of the overhead."""
    rates, draws, overheads = [], [], []
    with open_cluster(workers=workers, variables={"LP_NUM_THREADS": "1"}) as cluster:
        draw_seconds(cluster, 2 * workers)  # each worker compiles the shaders
        for _ in range(rounds):
            start = time.perf_counter()
            seconds = draw_seconds(cluster, FRAMES * workers)
            total = time.perf_counter() - start
            rates.append(len(seconds) / total)
            draws.append(median(seconds))
            overheads.append(1 - sum(seconds) / (workers * total))
    return median(rates), median(draws), median(overheads)


def measure_empty(tasks: int) -> tuple[float, float]:
    """Return the seconds of an empty task: by a farm's run(), and by Dask's own map(), which submits all at once."""
    with open_cluster(workers=2) as cluster:
        start = time.perf_counter()
        assert sum(1 for _ in cluster.run(empty, ((number, number) for number in range(tasks)))) == tasks
        by_farm = (time.perf_counter() - start) / tasks
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0") as local,
        Client(local) as client,
    ):
        start = time.perf_counter()
        client.gather(client.map(empty, range(tasks), pure=False))
        return by_farm, (time.perf_counter() - start) / tasks


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3, help="rounds; medians are printed. Default: 3.")
    parser.add_argument("--tasks", type=int, default=10000, help="empty tasks. Default: 10000.")
    options = parser.parse_args()
    size = f"{SIZE[0]}x{SIZE[1]}, {SAMPLES} samples"
    print(f"turntable, {size}, {CPU_COUNT} cores, load before {os.getloadavg()[0]:.1f}")
    print("| workers | frames a second | seconds of a draw | overhead | load |")
    print("|---:|---:|---:|---:|---:|")
    for workers in (1, 2, 4):
        rate, draw, overhead = measure_frames(workers, options.rounds)
        load = os.getloadavg()[0]
        print(f"| {workers} | {rate:.2f} | {draw:.2f} | {100 * overhead:.1f} % | {load:.1f} |", flush=True)
    by_farm, by_map = measure_empty(options.tasks)
    print(f"an empty task: {1e3 * by_farm:.2f} ms by run(), {1e3 * by_map:.2f} ms by Client.map()")


if __name__ == "__main__":
    main()
