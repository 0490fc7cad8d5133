"""What a library may do to the process that reads a part."""

import os


def crash(where):
    os.abort()


def endless(where):
    while True:
        pass


def loud(where):
    os.write(1, b"statistics on transfer")
    return where, sorted(os.listdir())


def failing(where):
    raise KeyError(where)
