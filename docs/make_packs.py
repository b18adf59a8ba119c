"""Write the tables of clauses in docs/packs.md, made of the packs that are tables.

python docs/make_packs.py
"""

from pathlib import Path

from bridgegen.scenario.language.reader import pack_tables

HERE = Path(__file__).parent


def page(text: str) -> str:
    """Return the page with its tables as the packs are now."""
    for pack in pack_tables():
        begin, end = (
            f"<!-- clauses of {pack}: python docs/make_packs.py -->\n",
            f"<!-- end of {pack} -->\n",
        )
        before, _, rest = text.partition(begin)
        text = f"{before}{begin}\n{clauses(pack)}\n{end}{rest.partition(end)[2]}"
    return text


def clauses(pack: str) -> str:
    """Return what a pack requires, clause by clause, and the scenarios that answer it."""
    table = pack_tables()[pack]
    lines = ["| clause | requirement | scenarios |", "|---|---|---|"]
    for key, row in table.rows.items():
        names = [f"`{entry}`" for entry, (_, keys) in table.entries.items() if key in keys]
        answer = ", ".join(names) or f"**not answered**: {row.lacks}"
        lines.append(f"| `{table.id_of(key)}` | {row.text} | {answer} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    path = HERE / "packs.md"
    path.write_text(page(path.read_text("utf-8")), "utf-8")
