"""The command line in this process: what it answers, and the tables that it writes."""

import csv

import pytest

from creeping.commands.main import main


def ran(*words):
    """Exit code of a command."""
    with pytest.raises(SystemExit) as end:
        main([str(word) for word in words])
    return end.value.code


def creeping(*words, capsys):
    """Exit code of a command, and what it wrote to both streams."""
    code = ran(*words)
    said = capsys.readouterr()
    return code, said.out, said.err


def table(file):
    """Rows of a file of comma-separated values, without its notes."""
    return list(csv.DictReader(line for line in file.read_text().splitlines() if line[0] != "#"))
