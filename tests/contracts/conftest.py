"""The command line as the tests of `tests/cli` call it."""

from cli.conftest import examples, ncfix, ncfix_process, shop

__all__ = ["examples", "ncfix", "ncfix_process", "shop"]
