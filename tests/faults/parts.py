"""Part files that are damaged, or belong to another build."""

import random
import shutil

from world import OLD, PARTS, part_name


def refused(world, number, content, story, tally, build_again=True):
    """Part `number` has this content: --merge names it and leaves the old model, --shard builds the part anew."""
    world.fresh()
    world.prepare("merge")
    part = world.out / part_name(number)
    part.write_bytes(content)
    code, said = world.run(world.large_build("--merge", PARTS))
    tally.cases += 1
    tally.detected += code != 0
    tally.require(code == 3 and said.count("\n") == 1 and str(part) in said, f"{story}: exit code {code}, said {said!r}")
    tally.require((world.out / "model.pbvg").read_bytes() == OLD, f"{story}: the old model is gone")
    tally.require(part.read_bytes() == content, f"{story}: the part has changed")
    if build_again:
        code, said = world.run(world.large_build("--shard", f"{number}/{PARTS}"))
        tally.require(code == 0 and part.read_bytes() == world.parts[part.name], f"{story}: not built anew: {code} {said!r}")
        tally.count("built anew")
    tally.require(len(list(world.out.iterdir())) == PARTS + 1, f"{story}: left {list(world.out.iterdir())}")


def damaged_parts(world, tally):
    """A part is cut, or a bit of it is flipped."""
    places = random.Random(1)
    for i in range(400 if world.complete else 24):
        number = places.randrange(PARTS)
        content = bytearray(world.parts[part_name(number)])
        # The ends are where the format has its magic number and its hash.
        at = places.choice([places.randrange(len(content)), places.randrange(64), len(content) - 1 - places.randrange(32)])
        if i % 2 == 0:
            refused(world, number, bytes(content[:at]), f"part {number} cut at {at}", tally, i % 4 == 0)
        else:
            bit = places.randrange(8)
            content[at] ^= 1 << bit
            refused(world, number, bytes(content), f"bit {bit} of byte {at} of part {number} flipped", tally, i % 4 == 1)


def foreign_parts(world, tally):
    """A part of other options, of another input, of another number of parts; another part."""
    others = {"other options": ({"depth": 6}, PARTS), "another input": ({"scan": world.scan}, PARTS),
              "another number of parts": ({}, PARTS + 1)}  # fmt: skip
    folder = world.work / "others"
    for story, (changes, count) in others.items():
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        for number in range(PARTS):
            world.must(*world.large_build("--shard", f"{number}/{count}", folder=folder, **changes))
            content = (folder / f"model.pbvg.part-{number}-of-{count}").read_bytes()
            refused(world, number, content, f"part {number} of {story}", tally)
    for number in range(PARTS):
        other = world.parts[part_name((number + 1) % PARTS)]
        refused(world, number, other, f"another part in the place of part {number}", tally)
    for story, changes in {"other options": {"depth": 6}, "other inputs": {"scan": world.scan}}.items():
        world.fresh()
        world.prepare("merge")
        code, said = world.run(world.large_build("--merge", PARTS, **changes))
        tally.cases += 1
        tally.require(code == 3 and part_name(0) in said, f"merge with {story}: {code} {said!r}")
    for number in range(PARTS):
        world.fresh()
        world.prepare("merge")
        (world.out / part_name(number)).unlink()
        code, said = world.run(world.large_build("--merge", PARTS))
        tally.cases += 1
        tally.require(code == 2 and part_name(number) in said, f"part {number} is missing: {code} {said!r}")


def parts(world, tally):
    world.make_parts()
    damaged_parts(world, tally)
    foreign_parts(world, tally)


CAMPAIGNS = {"parts": parts}
