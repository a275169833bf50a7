"""Prints the answers of mystery robots: python3 PATH/mystery_key.py FIRST LAST"""
import sys

from tb3_labs.simulation.mystery_robot import fault_of

print('number  fault            value')
for number in range(int(sys.argv[1]), int(sys.argv[2]) + 1):
    fault, value, _ = fault_of(number)
    print(f'{number:6}  {fault.name:15}  {fault.text(value)} (within {fault.tolerance:g})')
