"""A worker for tests: it does what requests of strangers might make one do."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def answer(request: bytes) -> bytes:
    """Do what a request says, in words."""
    match request.decode().split():
        case ["add", *numbers]:
            return str(sum(map(int, numbers))).encode()
        case ["grow"]:
            return bytes(10**10)[:1]
        case ["return", size]:
            return bytes(int(size))
        case ["loop"]:
            while True:
                pass
        case ["sleep"]:
            os.read(os.pipe()[0], 1)
        case ["abort"]:
            os.abort()
        case ["exit"]:
            os._exit(3)
        case ["print"]:
            print("hello")
            os.write(1, b"hello")
            sys.stderr.write("hello")
        case ["write", path]:
            Path(path).write_text("something")
        case _:
            raise ValueError("unknown request")
    return b"done"
