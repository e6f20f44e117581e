"""The command `ncfix`, and `python -m ncfix`: nothing is imported before an interruption would be caught."""

import gc
import sys

YOUNG = 100_000
"""New objects after which Python looks for cycles among them; what is imported stays, and is most of a short run."""


def main() -> None:
    """The console script; Ctrl-C while it starts ends it as it does later on."""
    try:
        gc.set_threshold(YOUNG)
        from ncfix.cli.main import main as run

        run()
    except KeyboardInterrupt:
        sys.stderr.write("NCF012: interrupted\n")
        sys.exit(130)


if __name__ == "__main__":
    main()
