#!/usr/bin/python3
"""Runs the fuzzers of this folder: each looks for faults of the program in random cases, see README.md.

    fuzz.py TUBULE [FUZZER...] [--seed N] [--few | --count N | --minutes M] [--index I] [--keep FOLDER] [--jobs N]

Without --count or --minutes each fuzzer runs as many cases as belong to its study, with --few the first two of them. With
--minutes all share the time equally. Case I of a fuzzer depends on the seed and on I alone. What a finding needs to be repeated is kept.
"""

import argparse
import collections
import concurrent.futures
import importlib
import os
import random
import shlex
import shutil
import sys
import tempfile
import threading
import time
import traceback
from pathlib import Path

from sandbox import Finding, Sandbox

# Each is a module with
#     STUDY            how many cases belong to its study, or which
#     one(rng, box)    makes and judges one case, all of it drawn from `rng`, in the Sandbox `box`: a word for the counts,
#                      such as "refused" or "finished"; raises Finding
FUZZERS = (
    "cases", "scenes", "surfaces", "loads", "auto", "results", "memory", "meshes", "starts", "commands", "coverage",
)  # fmt: skip


class Campaign:
    def __init__(self, arguments):
        self.program, self.seed, self.keep = arguments.program.resolve(), arguments.seed, arguments.keep.resolve()
        self.modules = {name: importlib.import_module(name) for name in arguments.fuzzers or FUZZERS}
        self.keep.mkdir(parents=True, exist_ok=True)
        self.lock = threading.Lock()
        self.counts = {name: collections.Counter() for name in self.modules}
        self.findings = {name: collections.Counter() for name in self.modules}
        self.seconds = dict.fromkeys(self.modules, 0.0)
        self.next = dict.fromkeys(self.modules, 0)

    def run(self, name, index):
        """One case, its folder kept where there is a finding."""
        began = time.monotonic()
        with tempfile.TemporaryDirectory(dir=self.keep, ignore_cleanup_errors=True) as top:
            folder = Path(top) / "case"
            kind, words = self.judge(name, index, folder)
            with self.lock:
                self.seconds[name] += time.monotonic() - began
                self.counts[name][kind] += 1
                if words:
                    self.findings[name][kind] += 1
                    self.report(name, index, words, folder)

    def judge(self, name, index, folder):
        rng = random.Random(f"{name} {self.seed} {index}")
        try:
            return self.modules[name].one(rng, Sandbox(self.program, folder)), None
        except Finding as finding:
            return finding.kind, str(finding)
        except Exception:  # of the fuzzer itself, or of what it reads: to be looked at as well
            return "unexpected", traceback.format_exc()

    def report(self, name, index, words, folder):
        again = [sys.executable, "-B", str(Path(__file__).resolve()), str(self.program), name]
        again = shlex.join([*again, "--seed", str(self.seed), "--index", str(index)])
        kept = self.keep / f"{name}-{self.seed}-{index}"
        shutil.rmtree(kept, ignore_errors=True)
        folder.rename(kept)
        (kept / "finding").write_text(f"{words}\n\nagain: {again}\n", errors="surrogateescape")
        print(f"\n{name} {index}: {words}\n  kept in {kept}\n  again: {again}".encode(errors="replace").decode(), flush=True)

    def take(self, deadline):
        """The next case: of the fuzzer that has had the least time by now."""
        with self.lock:
            if time.monotonic() > deadline:
                return None
            name = min(self.modules, key=self.seconds.get)
            self.seconds[name] += 1e-3  # several workers begin with different fuzzers
            self.next[name] += 1
            return name, self.next[name] - 1

    def share(self, minutes, jobs):
        deadline = time.monotonic() + 60 * minutes

        def work():
            while case := self.take(deadline):
                self.run(*case)

        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            for worker in [pool.submit(work) for _ in range(jobs)]:
                worker.result()

    def summary(self):
        print(f"\nseed {self.seed}")
        for name in self.modules:
            counts = ", ".join(f"{n} {kind}" for kind, n in sorted(self.counts[name].items()))
            findings = sum(self.findings[name].values())
            print(f"{name}: {sum(self.counts[name].values())} cases ({counts}), {self.seconds[name]:.0f} s, {findings} findings")
        return any(self.findings.values())


def parsed():
    parser = argparse.ArgumentParser(description="Looks for faults of the program in random cases.")
    parser.add_argument("program", type=Path)
    parser.add_argument("fuzzers", nargs="*", metavar="FUZZER", help=f"of {', '.join(FUZZERS)}; all by default")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--few", action="store_true", help="the first two cases of each fuzzer's study")
    parser.add_argument("--count", type=int, help="cases of each fuzzer")
    parser.add_argument("--minutes", type=float, help="for all fuzzers together")
    parser.add_argument("--index", type=int, help="this case only")
    parser.add_argument("--keep", type=Path, default=Path("findings"), help="folder for what findings need (findings)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="cases at a time, with --minutes")
    arguments = parser.parse_intermixed_args()
    if unknown := set(arguments.fuzzers) - set(FUZZERS):
        parser.error(f"no such fuzzer: {', '.join(sorted(unknown))}")
    return arguments


def main():
    arguments = parsed()
    campaign = Campaign(arguments)
    if arguments.minutes is not None:
        campaign.share(arguments.minutes, arguments.jobs)
    else:
        for name, module in campaign.modules.items():
            study = range(module.STUDY) if isinstance(module.STUDY, int) else module.STUDY
            wanted = range(arguments.count) if arguments.count is not None else study[:2] if arguments.few else study
            for index in wanted if arguments.index is None else [arguments.index]:
                campaign.run(name, index)
    sys.exit(campaign.summary())


if __name__ == "__main__":
    main()
