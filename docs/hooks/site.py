"""What the site gets beside its written pages: tables of results, pictures, notebooks, the generated reference."""

import pkgutil
from pathlib import Path

import command_line
import configuration
import notebooks
import tables
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[2]


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Append the generated pages to the navigation's last part."""
    (reference,) = config.nav[-1].values()
    reference += [
        {"Commands": "reference/commands.md"},
        {"Configuration": [{name: f"reference/configuration/{name}.md"} for name in configuration.pages()]},
        {"API": [{name: f"reference/api/{name}.md"} for name in _rooms()]},
    ]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages, and the repository's pictures."""
    for name in _rooms():
        text = f"# {name}\n\n::: {name}\n"
        files.append(File.generated(config, f"reference/api/{name}.md", content=text))
    for name, text in notebooks.pages().items():
        files.append(File.generated(config, f"notebooks/{name}.md", content=text))
    files.append(File.generated(config, "reference/commands.md", content=command_line.page()))
    for name, text in configuration.pages().items():
        files.append(File.generated(config, f"reference/configuration/{name}.md", content=text))
    for picture in sorted((ROOT / "renders").glob("*.png")):
        files.append(File.generated(config, f"renders/{picture.name}", abs_src_path=str(picture)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Put tables of results in the place of what asks for them."""
    return tables.with_tables(markdown)


def _rooms() -> list[str]:
    """The package, then its rooms, by their import names."""
    found = pkgutil.iter_modules([str(ROOT / "vision_s2r")], "vision_s2r.")
    return ["vision_s2r", *sorted(each.name for each in found if each.ispkg)]
