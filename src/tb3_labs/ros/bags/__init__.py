"""From a recorded bag to a `report.run_data.RunData`."""
