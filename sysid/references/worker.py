"""The process that a reference runs in: ``python -m sysid.references.worker``.

It is told what to do on its standard input and answers on its standard output, a JSON object a line; arrays pass
through files. What the reference itself prints goes nowhere near that: its standard output is closed to it. When
whoever started it has gone, it ends, and so does everything that it started.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import sys
import threading
import time
from collections.abc import Mapping
from typing import Any, TextIO

import numpy as np

from sysid.errors import SysidError
from sysid.references.config import ReferenceConfig
from sysid.references.kinds import Loaded, RunError, load


def serve(asked: TextIO, answers: TextIO) -> None:
    """Load a reference and run it as often as is asked.

    Args:
        asked: First the configuration, then a run a line.
        answers: An answer to each.
    """

    def answer(**values: Any) -> None:
        answers.write(json.dumps(values) + "\n")
        answers.flush()

    lines: queue.Queue[str] = queue.Queue()
    threading.Thread(target=_listen, args=(asked, lines), daemon=True).start()
    config = ReferenceConfig.model_validate_json(lines.get())
    try:
        loaded = load(config)
        answer(digest=loaded.digest)
    except SysidError as error:
        answer(what=error.what, **{k: _text(getattr(error, k)) for k in ("where", "expected", "got", "remedy")})
        return
    while True:
        answer(**_answer(loaded, config, json.loads(lines.get())))


def _text(value: object) -> str | None:
    return None if value is None else str(value)


def _listen(asked: TextIO, lines: queue.Queue[str]) -> None:
    """Pass lines on; where there are no more, nobody is left who would hear an answer."""
    for line in asked:
        lines.put(line)
    if hasattr(os, "killpg") and os.getpgrp() == os.getpid():
        os.killpg(os.getpid(), signal.SIGKILL)
    os._exit(0)


def _answer(loaded: Loaded, config: ReferenceConfig, order: Mapping[str, Any]) -> dict[str, Any]:
    inputs = np.load(order["inputs"], allow_pickle=False)
    settling = round(config.settling / config.sample_time)
    whole = np.concatenate([np.repeat(inputs[:1], settling, axis=0), inputs])
    began = _processor_time()
    try:
        first, outputs = loaded.run(whole, order["parameters"])
    except RunError as error:
        return {"reason": str(error), "cpu_s": _processor_time() - began}
    cpu = _processor_time() - began
    first = outputs[settling - 1] if settling else outputs[0] if first is None else first
    np.save(order["outputs"], np.concatenate([first[np.newaxis], outputs[settling:]]), allow_pickle=False)
    return {"reason": None, "cpu_s": cpu}


def _processor_time() -> float:
    """Seconds that this process and what it started have had a processor."""
    spent = os.times()
    return max(time.process_time(), spent.user + spent.system) + spent.children_user + spent.children_system


if __name__ == "__main__":
    # What a reference prints must not be taken for an answer.
    channel = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    serve(sys.stdin, channel)
