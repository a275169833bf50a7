"""What is wrong with this computer, network or robot? Judgements of what the doctor measured.

Each function turns measured numbers and names into one line: ok, warning or fault, the reason, and
what to do. Nothing here measures: that is :mod:`tb3_labs.ros.doctor`. A function that has nothing
to judge by says so in its line; none raises.
"""
