"""Log files of every format, read to and written from columns of frames."""
