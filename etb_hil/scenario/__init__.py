"""What a run is asked to do: the phases of a scenario, their set-points over time, and conditions on signals."""
