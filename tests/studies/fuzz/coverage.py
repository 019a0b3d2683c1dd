"""Coverage-guided fuzzing, by libFuzzer under sanitizers, of everything that reads files: the targets of targets.cpp, each
for a while in turn. The inputs found on the way stay beside the program, so that the next while goes on from them.

A case is not repeated by its number, since it begins with the inputs that were found before: a finding keeps the input."""

import os
import re
import subprocess

from sandbox import Finding, text

STUDY = 0  # the targets have a test of their own, targets_test.cpp
TARGETS = ("case", "override", "scan", "mesh", "profile", "formula", "result")
SECONDS = 20


def one(rng, box):
    readers = box.program.parents[1] / "fuzz" / "fuzz_readers"
    if not readers.exists():
        return "not built"
    target = rng.choice(TARGETS)
    corpus = readers.parent / "corpus" / target
    corpus.mkdir(parents=True, exist_ok=True)
    environment = os.environ | {"TUBULE_TARGET": target, "TMPDIR": str(box.folder), "ASAN_OPTIONS": "detect_leaks=0"}
    if not any(corpus.iterdir()):
        subprocess.run([readers], env=environment | {"TUBULE_SEEDS": str(corpus)}, check=True)
    limits = [f"-max_total_time={SECONDS}", "-timeout=10", "-rss_limit_mb=4096", "-malloc_limit_mb=2048"]
    command = [readers, corpus, *limits, f"-seed={rng.randrange(1, 2**31)}", f"-artifact_prefix={box.folder}/", "-print_final_stats=1"]
    box.note(f"TUBULE_TARGET={target} {readers} FILE  # the crash, timeout or oom file that is kept here")
    done = subprocess.run(command, env=environment, cwd=box.folder, capture_output=True)
    said = text(done.stderr)
    (box.folder / "log").write_text(said[-20000:], errors="surrogateescape")
    if done.returncode != 0:
        at = re.search(r"ERROR: |runtime error|what\(\)", said)
        raise Finding("crash", f"{target}: {said[max(0, at.start() - 300) if at else -1500:][:1500]}")
    runs = re.search(r"number_of_executed_units: (\d+)", said)
    COUNTS[target] = COUNTS.get(target, 0) + int(runs[1] if runs else 0)
    return target


COUNTS = {}
