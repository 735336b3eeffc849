"""The page of results is what the files of benchmarks and studies say; nothing on it is typed by hand."""

from docs.reference import results


def test_the_page_is_made_of_the_files() -> None:
    made = results.page()
    assert results.PAGE.read_text(encoding="utf-8") == made, "run `python -m docs.reference.results`"


def test_every_result_file_and_every_program_stands_on_it() -> None:
    page = results.page()
    for path in (results.DOCS / "benchmarks").glob("*.md"):
        if path.stem != "index":
            assert f"[benchmarks/{path.name}](benchmarks/{path.name})" in page
            first = next(line for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("|"))
            assert first in page
    for path in results.BENCHMARKS.glob("*.py"):
        assert path.stem in (*results.SHARED, "__init__") or f"benchmarks.{path.stem}" in page or path.stem in page
    assert page.count("](studies.md#") == len(list((results.BENCHMARKS / "studies" / "results").glob("*.json")))
