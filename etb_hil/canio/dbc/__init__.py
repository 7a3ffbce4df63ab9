"""What a DBC file and its roles make of frames: layouts, protection, commands out, columns and samples in."""
