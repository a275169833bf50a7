"""The lab sheets, and the places in them to which the criteria of several labs point."""
from tb3_labs.marking.criteria import Place

IMU_SHEET, TRANSFORMATION_SHEET = 'imu_lab.md', 'transformation_lab.md'
HEADING_EXERCISE, TURN_LAB = '2. Exercise: the heading', '3. Lab: turn 90 and 180 degrees'
EXERCISE = Place(IMU_SHEET, HEADING_EXERCISE, 3)
STATES = Place(TRANSFORMATION_SHEET, '2. The four states')
THUMB = Place(TRANSFORMATION_SHEET, '4. By thumb')
