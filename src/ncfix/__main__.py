"""The command `ncfix`, and `python -m ncfix`; imports happen where an interruption is caught."""

import gc
import sys

YOUNG = 100_000
"""Number of new objects after which Python searches for cycles; in a short run most objects are imports, which stay."""


def main() -> None:
    """Entry point of the console script; Ctrl-C during start-up ends it as it does later."""
    try:
        gc.set_threshold(YOUNG)
        from ncfix.cli.main import main as run

        run()
    except KeyboardInterrupt:
        sys.stderr.write("NCF012: interrupted\n")
        sys.exit(130)


if __name__ == "__main__":
    main()
