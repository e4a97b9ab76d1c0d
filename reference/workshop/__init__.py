"""The workshop: tools around the book; no chapter of the book imports them."""


def command_line() -> None:
    """Run `python -m reference`, under the name `fire-rescue` that pip installs."""
    from runpy import run_module

    run_module("reference", run_name="__main__", alter_sys=True)
