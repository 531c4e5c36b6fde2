"""Worker process: compute blocks that arrive as messages on standard input.

A message is its length (8 bytes, big-endian) and a pickle. The first message is the study, each
further one a block. The answer is the file of the block, or the traceback of a defect (str). The
process ends at once when its input closes, also during a block.
"""

from __future__ import annotations

import os
import pickle
import queue
import signal
import struct
import sys
import threading
import traceback
from typing import IO, Any

from engine.batch.batch import BatchRunner
from sweep.execution.block_computation import compute_rows
from sweep.store.block_file import encode_block
from sweep.store.manifest import manifest_of
from sweep.store.row import Block

LENGTH_PREFIX = struct.Struct(">Q")
"""The length of a message: 8 bytes, big-endian."""


def send_message(stream: IO[bytes], message: object) -> None:
    """Write a message to a stream as its length and a pickle, and flush it.

    Raises OSError if the reader is gone.
    """
    data = pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL)
    stream.write(LENGTH_PREFIX.pack(len(data)) + data)
    stream.flush()


def receive_message(stream: IO[bytes]) -> Any:
    """Return the next message of a stream. Raises EOFError at its end, also inside a message."""
    head = stream.read(LENGTH_PREFIX.size)
    if len(head) < LENGTH_PREFIX.size:
        raise EOFError
    (length,) = LENGTH_PREFIX.unpack(head)
    data = stream.read(length)
    if len(data) < length:
        raise EOFError
    return pickle.loads(data)


def serve_blocks(run: BatchRunner) -> None:
    """Answer the blocks on standard input with their files; never returns.

    The first message is the study. A block with an exception is answered with its traceback. The
    process ends with exit code 0 when the input closes. Ctrl-C is ignored, and what other code
    prints goes to stderr.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process decides about the end
    source = os.fdopen(os.dup(0), "rb")
    target = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    messages: queue.Queue[Any] = queue.Queue()
    threading.Thread(target=_forward_messages, args=(source, messages), daemon=True).start()
    study = messages.get()
    manifest = manifest_of(study)
    while True:
        block: Block = messages.get()
        try:
            answer: object = encode_block(manifest, block, compute_rows(study, block, run))
        except Exception:
            answer = traceback.format_exc()
        send_message(target, answer)


def _forward_messages(source: IO[bytes], messages: queue.Queue[Any]) -> None:
    """Put the messages of a stream into a queue; exit the process at the end of the stream."""
    while True:
        try:
            messages.put(receive_message(source))
        except (EOFError, OSError):
            sys.stderr.flush()
            os._exit(0)
