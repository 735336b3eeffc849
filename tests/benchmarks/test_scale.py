"""The benchmark of scale keeps the tables of parts that did not run, and counts processes that outlive their parent."""

import os
import subprocess
import sys

from benchmarks.scale import adopting, children, merged


def test_a_page_keeps_the_sections_that_were_not_made_again() -> None:
    page = merged("", "## Long logs\n\n| a |\n\nfirst\n")
    page = merged(page, "## Many logs in one workspace\n\nsecond\n\n## Batch\n\nthird\n")
    page = merged(page, "## Long logs\n\nfourth\n")
    assert [line for line in page.splitlines() if line.startswith("## ")] == [
        "## Batch",
        "## Long logs",
        "## Many logs in one workspace",
    ]
    assert "first" not in page and page.index("third") < page.index("fourth") < page.index("second")
    assert merged(page, "") == page


def test_a_process_whose_parent_ends_is_adopted() -> None:
    program = "import subprocess as s, sys; o = s.DEVNULL; c = [sys.executable, '-c', 'input()']\n"
    program += "print(s.Popen(c, stdout=o, stderr=o).pid)"
    others = children(os.getpid())
    reading, writing = os.pipe()
    with adopting():
        done = subprocess.run([sys.executable, "-c", program], stdin=reading, stdout=subprocess.PIPE, check=True)
        assert children(os.getpid()) - others == {int(done.stdout)}
        os.close(writing)
        os.waitpid(int(done.stdout), 0)
    os.close(reading)
    assert children(os.getpid()) == others
