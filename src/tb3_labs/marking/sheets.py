"""The lab sheets, and the places in them to which the criteria of several labs point."""
from tb3_labs.marking.criteria import Place

IMU_SHEET, TRANSFORMATION_SHEET = 'imu_lab.md', 'transformation_lab.md'
HEADING_EXERCISE, TURN_LAB = 'Exercise: the heading', 'Lab: turn 90 and 180 degrees'
EXERCISE = Place(IMU_SHEET, HEADING_EXERCISE, 1)
STATES = Place(TRANSFORMATION_SHEET, '1. The node and its states')
THUMB = Place(TRANSFORMATION_SHEET, '3. By thumb')
