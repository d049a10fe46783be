"""Looks at random views of an explorer, as its page asks for them, and watches how much memory the explorer uses:

    python3 benches/views.py target/release/terrane archipelago --views 2000 --threads 1 [MORE OF terrane explore]

A view is four tiles somewhere at some zoom level: glances, drafts and full pictures, and heights under the pointer meanwhile. Most are
left after a moment and some are waited for, as people do; what is not there yet is given up then. A moment is one of the explorer's
own processor time, so that other work on the machine changes nothing of what is looked at. Prints a line every so often, and at the
end the most memory, the memory of the last tenth, and how long heights took, in seconds and in the explorer's processor time.
"""

import argparse
import asyncio
import json
import os
import random
import statistics
import subprocess
import tempfile
import time

REACH_KM = 2000  # from the origin within which views lie
MOST_ZOOM = 9
TILE_PX = 256
MOMENT_S, WAIT_S, WAITED_FOR = 0.3, 5.0, 0.1  # how long views are looked at, and which share of them longer
LOOK_S = 0.02
STAGES = "glance", "draft"  # of the land whose heights are told


def processor_s(process):
    with open(f"/proc/{process.pid}/stat") as stat:
        fields = stat.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory_mb(process):
    with open(f"/proc/{process.pid}/status") as status:
        fields = dict(line.split(":", 1) for line in status)
    return [int(fields[name].split()[0]) / 1024 for name in ("VmRSS", "VmHWM")]


class Explorer:
    def __init__(self, process, host):
        self.process, self.host = process, host
        name, port = host.rsplit(":", 1)
        self.address = name, int(port)

    async def get(self, path):
        reader, writer = await asyncio.open_connection(*self.address)
        try:
            writer.write(f"GET {path} HTTP/1.1\r\nHost: {self.host}\r\nConnection: close\r\n\r\n".encode())
            head, _, body = (await reader.read(-1)).partition(b"\r\n\r\n")
            return int(head.split()[1]), body
        finally:
            # This is what tells the explorer that nobody waits any more.
            writer.close()

    async def spent(self, seconds):
        """Waits until the explorer has worked so long."""
        until = processor_s(self.process) + seconds
        while processor_s(self.process) < until:
            await asyncio.sleep(LOOK_S)


async def view(explorer, world, chance, took):
    zoom = chance.randint(0, MOST_ZOOM)
    tile_m = world["ground"]["finest_m"] * 2 ** (MOST_ZOOM - zoom) * TILE_PX
    x, y = (round(chance.uniform(-1, 1) * REACH_KM * 1000 / tile_m) for _ in "xy")
    style = chance.choice(world["layers"])["name"]
    tiles = [(x + right, y + down) for right in (0, 1) for down in (0, 1)]
    looked_s = WAIT_S if chance.random() < WAITED_FOR else MOMENT_S

    async def look():
        for stage in "glance", "draft", "full":
            asked = (explorer.get(f"/w/{world['id']}/{style}/{stage}/{zoom}/{x}/{y}.webp") for x, y in tiles)
            await asyncio.gather(*asked)

    async def point():
        # What is new on the screen is asked for first.
        await asyncio.sleep(LOOK_S)
        for x, y in tiles:
            for stage in STAGES:
                wall, busy = time.monotonic(), processor_s(explorer.process)
                status, _ = await explorer.get(f"/w/{world['id']}/heights/{stage}/{zoom}/{x}/{y}.js")
                assert status == 200, status
                took[stage].append([time.monotonic() - wall, processor_s(explorer.process) - busy])

    looking = asyncio.create_task(look())
    leaving = asyncio.create_task(explorer.spent(looked_s))
    pointing = asyncio.create_task(point())
    await asyncio.wait([looking, leaving], return_when=asyncio.FIRST_COMPLETED)
    await pointing
    looking.cancel()
    leaving.cancel()
    await asyncio.gather(looking, leaving, return_exceptions=True)


def tell(process, used, took):
    last = used[-max(1, len(used) // 10) :]
    print(f"memory: {memory_mb(process)[1]:.0f} MB at most, {statistics.mean(last):.0f} MB in the last tenth of views")
    for stage in STAGES:
        for name, seconds in zip(("s", "s of the processor"), map(sorted, zip(*took[stage]))):
            middle, most = (seconds[int(len(seconds) * share)] for share in (0.5, 0.95))
            print(
                f"heights of a {stage}: {statistics.mean(seconds):.2f} {name} on the mean, {middle:.2f} in the middle, "
                f"{most:.2f} of 95 %, {seconds[-1]:.2f} at most"
            )


async def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("preset")
    parser.add_argument("--views", type=int, default=2000)
    parser.add_argument("--threads", default="1")
    parser.add_argument("--seed", type=int, default=1, help="of the views")
    given, more = parser.parse_known_args()
    chance = random.Random(given.seed)
    with tempfile.TemporaryDirectory() as cache:
        command = [given.program, "explore", given.preset, "--json", "--cache", cache, "--cache-limit", "50MB"]
        process = subprocess.Popen([*command, "--threads", given.threads, *more], stdout=subprocess.PIPE)
        try:
            host = json.loads(process.stdout.readline())["url"].removeprefix("http://").rstrip("/")
            explorer = Explorer(process, host)
            world = json.loads((await explorer.get("/api/start"))[1])["world"]
            used, took = [], {stage: [] for stage in STAGES}
            since = time.monotonic()
            for number in range(given.views):
                await view(explorer, world, chance, took)
                now, most = memory_mb(process)
                used.append(now)
                if (number + 1) % 50 == 0:
                    seconds = time.monotonic() - since
                    print(f"{number + 1} views, {seconds:.0f} s: {now:.0f} MB, {most:.0f} MB at most", flush=True)
            tell(process, used, took)
        finally:
            process.terminate()
            process.wait()


asyncio.run(main())
