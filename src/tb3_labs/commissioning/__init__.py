"""What is this robot like? A guided test drive measures it, and the simulated robot becomes it.

`steps` is the list of movements, `ride` goes through them, and stops at once if it must.
`recording` keeps the samples; `sensors`, `responses` and `estimates` compute numbers with their
errors, and `findings` judges them. `page` writes them down, and `twin` drives a simulated robot.
Only the files `ros_*` know ROS.
"""
