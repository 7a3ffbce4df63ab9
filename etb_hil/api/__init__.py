"""What programmers build on: the functions and types that `import etb_hil` offers, and the command line stands on."""
