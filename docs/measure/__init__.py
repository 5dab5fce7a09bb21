"""How each figure of the pages is measured. A module has `arguments(parser)`, `measure(given, before)`, which returns the figures and the
pictures that go with them, and `blocks(figures)`, the text between markers of pages by the name of the block."""
