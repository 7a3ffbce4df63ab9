"""The layout table in the documentation is that of the DBC files."""

from pathlib import Path

import cantools
import pytest

from etb_hil.base.stock import find

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "can.md"


@pytest.mark.parametrize("name", ["etb_controller", "etb_controller_fd"])
def test_every_signal_stands_in_the_table(name):
    text = PAGE.read_text(encoding="utf-8")
    text = text[text.index(f"`dbc/{name}.dbc`") :].split("###")[0]
    for message in cantools.database.load_file(find("dbc", name)).messages:
        part = text[text.index(f"**{message.name}** {message.frame_id:#x}, {message.length} bytes") :].split("**", 3)[2]
        rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in part.splitlines() if line.startswith("| ")]
        for signal in message.signals:
            first_of_ten = signal.name.endswith("0") and f"{signal.name}..9" in part
            later = signal.name[-1].isdigit() and f"{signal.name[:-1]}0..9" in part and not first_of_ten
            if later:
                continue
            shown = f"{signal.name}..9" if first_of_ten else signal.name
            bits = f"{signal.start}, {'10 x ' if first_of_ten else ''}{signal.length}"
            row = next(row for row in rows if row[0] == shown)
            assert row[1] == bits + (" signed" if signal.is_signed else "")
            assert float(row[2]) == pytest.approx(float(signal.scale), rel=1e-6)
            assert row[4] == (signal.unit or "")
