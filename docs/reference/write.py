"""Write the generated pages: ``python -m docs.reference.write``; Sphinx calls it before it reads any page."""

from pathlib import Path

from docs.reference import catalogue, commands, policy, schemas

FOLDER = Path(__file__).parents[1] / "generated"


def pages() -> dict[str, str]:
    """Return the generated pages by file name."""
    return {
        "models.md": catalogue.page("model"),
        "effects.md": catalogue.page("effect"),
        "optimizers.md": catalogue.page("optimizer"),
        "readers.md": catalogue.page("reader"),
        "commands.md": commands.page(),
        "workspace.md": schemas.page(),
        "policy.md": policy.page(),
    }


def write(folder: Path = FOLDER) -> None:
    """Write pages and figures; a page that has not changed keeps its time, so that it is not built again."""
    from docs.reference import figures

    folder.mkdir(exist_ok=True)
    for name, text in pages().items():
        path = folder / name
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
    figures.write(folder / "figures")


if __name__ == "__main__":
    write()
