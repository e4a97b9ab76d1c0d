"""What a command says when it refuses."""

from reference.__main__ import main


def refusal(capsys, *arguments):
    """Exit status and message of a command that refuses; nothing is on stdout."""
    try:
        status = main(list(arguments))
    except SystemExit as end:
        status = end.code
    told = capsys.readouterr()
    assert told.out == ""
    return status, told.err
