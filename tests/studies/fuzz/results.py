"""Damaged results of every kind: what flipped bits, lost and swapped blocks, and a cut end do to them.

Every command that reads results says that the file is damaged, or gives what the sound file gives: no crash, no hang,
no changed number."""


from samples import LOCK, samples
from sandbox import Finding

STUDY = 40
BLOCK = 512


def damaged(rng, sound):
    """A sound file with one damage, and its name."""
    raw = bytearray(sound)
    head = rng.random() < 0.5  # where HDF5 has most of its structures
    at = rng.randrange(min(8192, len(raw)) if head else len(raw))
    other = rng.randrange(len(raw))
    span = rng.choice((1, 8, BLOCK))
    kind = rng.choice(("bit", "bit", "bit", "bit", "byte", "cut", "zero", "swap", "lost", "longer"))
    match kind:
        case "bit":
            raw[at] ^= 1 << rng.randrange(8)
        case "byte":
            raw[at] = rng.choice((0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)))
        case "cut":
            del raw[at:]
        case "zero":
            raw[at:at + span] = bytes(len(raw[at:at + span]))
        case "swap":
            a, b = min(at, other) // BLOCK * BLOCK, max(at, other) // BLOCK * BLOCK
            raw[a:a + BLOCK], raw[b:b + BLOCK] = raw[b:b + BLOCK], raw[a:a + BLOCK]
        case "lost":
            del raw[at:at + span]
        case "longer":
            raw += bytes(rng.randrange(256) for _ in range(span))
    return kind, bytes(raw)


def commands(kind):
    """What reads a result, `run --resume` last, since it may write it."""
    for form in ("--csv", "--json", None):
        yield ("show", "case.hdf", *filter(None, [form]))
    if kind != "scan":
        yield "compare", "case.hdf", "case.hdf", "--csv", "--no-shapes"
    if kind in ("tube", "curve"):
        yield "stability", "case.hdf", "--csv", "--modes=0", "--rates=1"
    if kind not in ("scan", "equilibrium", "killed"):
        yield "run", "case.toml", "-o", "case.hdf", "--resume"


def answer(box, arguments, **options):
    return box.run(*arguments, statuses=(0, 2), **options)


ANSWERS = {}


def of_the_sound_file(box, sample, arguments):
    """What a command says of the sound file; asked once."""
    with LOCK:
        if (sample.kind, arguments) not in ANSWERS:
            ANSWERS[sample.kind, arguments] = answer(box, arguments).out
        return ANSWERS[sample.kind, arguments]


def resumed(box):
    """After a killed run --resume goes on with what is left, or refuses."""
    if box.run("run", "case.toml", "--quiet", "--resume", statuses=(0, 2)).status == 0:
        last = box.run("show", "case.hdf", "--csv", statuses=(0,)).out.splitlines()[-1]
        if float(last.split(",")[0]) != 0.2:
            raise Finding("changed", f"resumed, the run ends with {last}")
    return "resumed"


def one(rng, box):
    sample = rng.choice(samples(box.program))
    sample.put(box)
    kind, contents = damaged(rng, sample.result)
    asked = list(commands(sample.kind))
    arguments = asked[0] if rng.random() < 0.5 else rng.choice(asked)
    expected = of_the_sound_file(box, sample, arguments)
    damage = f"{kind} in {sample.kind}"
    result = box.write("case.hdf", contents)
    if sample.kind == "killed" and rng.random() < 0.2:
        return resumed(box)
    done = answer(box, arguments)
    if done.status == 2:
        if "case.hdf" not in done.err:
            raise Finding("no-place", f"{damage}: refused without its name: {done.err[:500]}")
        if result.read_bytes() != contents:
            raise Finding("written", f"{damage}: refused, yet changed")
        return "refused"
    if done.out != expected:
        raise Finding("changed", f"{damage}: {arguments[0]} differs from that of the sound file\n{done.err}")
    return "harmless"
