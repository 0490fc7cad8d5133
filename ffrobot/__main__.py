"""`python -m ffrobot` is the command line, in any environment that has the package."""

from .cli import main

main()
