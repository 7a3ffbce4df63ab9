"""The HTML report, plots and the live panel."""
