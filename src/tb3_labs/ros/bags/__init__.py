"""How does a recorded bag become a `report.run_data.RunData`?"""
