"""The study of the chunk layer on its small setting: every step is measured, the table is written."""
from studies import chunk_overhead


def test_every_step_of_a_chunk_is_measured(tmp_path, capsys):
    seen = chunk_overhead.main(["--setting", "small", "--output", str(tmp_path)])
    assert set(seen["parts"]) == {"name", "write", "read", "queue"}
    assert all(wall >= 0.0 and cpu >= 0.0 for wall, cpu in seen["parts"].values())
    text = (tmp_path / "chunk_overhead.txt").read_text(encoding="utf-8")
    assert "together" in text and text == capsys.readouterr().out
