"""What the base model leaves out: one effect a file, and the ports where they enter the equations."""
