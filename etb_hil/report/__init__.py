"""What people look at: the HTML report, plots, the live panel."""
